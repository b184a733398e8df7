"""Workers of a machine: each run is done even if workers are killed."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from multiprocessing import Pipe
from threading import Lock
from typing import Final

from tickrig.emulators.testing.campaign.order import (
    DIED,
    HUNG,
    CampaignOrder,
    CampaignRefusal,
    Collected,
    Run,
    RunVerdict,
    verdicts_of,
)

# The parent's view of a worker: a process that is started, asked and ended.

_START_S: Final = 300.0
"""Time-out of the collection."""

_LOOK_S: Final = 1.0

_MOST_BYTES: Final = 64 << 20
"""Largest size of an answer."""


class _WorkerDied(Exception):  # noqa: N818 - nobody's fault
    """The process of a worker has ended; the message says how."""


class _RunHung(Exception):  # noqa: N818 - that of the test
    """A run took too long; its worker was ended."""


class _WorkerProcess:
    """A process in which pytest has collected the tests of an order.

    Args:
        order: the tests to collect.

    Raises:
        Refusal: pytest refuses the order.
        _WorkerDied: the process has ended before its first answer.
    """

    def __init__(self, order: CampaignOrder) -> None:
        if not os.path.isdir(order.folder):
            raise CampaignRefusal(f"no directory {order.folder}")
        self._lock = Lock()
        self._conn, theirs = Pipe()
        alive, self._alive = os.pipe()
        words = [sys.executable, "-P", "-m", "tickrig.emulators.testing.campaign.worker"]
        self._process = subprocess.Popen(
            [*words, str(theirs.fileno()), str(alive)],
            cwd=order.folder,
            pass_fds=(theirs.fileno(), alive),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for who asks
        )
        theirs.close()
        os.close(alive)
        try:
            self._conn.send(order)
            answer = self._receive(_START_S)
            if not isinstance(answer, Collected):
                raise CampaignRefusal(str(answer))
            self.collected: Collected = answer
        except _RunHung:
            raise CampaignRefusal(f"the tests were not collected within {_START_S:g} s") from None
        except BrokenPipeError:
            raise self._died() from None
        finally:
            if not hasattr(self, "collected"):
                self.end()

    def request(self, runs: Sequence[Run]) -> None:
        """Request runs; raise _WorkerDied if the process has ended."""
        try:
            self._conn.send(list(runs))
        except OSError:
            raise self._died() from None

    def verdict(self, run: Run, timeout_s: float) -> RunVerdict:
        """Wait for the verdict of a run that was requested from this worker process.

        Args:
            run: the requested run.
            timeout_s: longest wait in seconds.

        Raises:
            _RunHung: no verdict has arrived in time.
            _WorkerDied: the process has ended, or has sent something that is not a verdict.
        """
        answer = self._receive(timeout_s)
        try:
            return verdicts_of([answer], [run])[0]
        except ValueError as mistake:
            raise _WorkerDied(f"when it sent {mistake}") from None

    def _receive(self, timeout_s: float) -> object:
        """Wait for an answer; time in which this process is stopped does not count."""
        waited_s = 0.0
        try:
            while not self._conn.poll(_LOOK_S):
                waited_s += _LOOK_S
                if waited_s >= timeout_s:
                    raise _RunHung
            data = self._conn.recv_bytes(_MOST_BYTES)
        except (EOFError, OSError):
            raise self._died() from None
        try:
            return pickle.loads(data)
        except Exception as error:  # pickle raises anything
            raise _WorkerDied(f"when it sent unreadable data: {error!r}") from None

    def _died(self) -> _WorkerDied:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_LOOK_S)
        status = self._process.poll()
        if status is not None and status < 0:
            return _WorkerDied(f"by signal {-status}, {signal.strsignal(-status)}")
        return _WorkerDied(f"with exit status {status}")

    @property
    def is_alive(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def kill(self) -> None:
        """Kill the process and its children."""
        with self._lock:
            if self._process.poll() is None:
                os.killpg(self._process.pid, signal.SIGKILL)
                self._process.wait()

    def end(self) -> None:
        """Kill the process, and close its pipe."""
        self.kill()
        self._conn.close()
        if self._alive >= 0:
            os.close(self._alive)
        self._alive = -1


_ATTEMPTS: Final = 3


class Crew:
    """The worker processes of a campaign on this machine; several threads can use them.

    A new process is started if none is idle.

    Args:
        order: options by which each worker collects and runs the tests.

    Attributes:
        order: options by which each worker collects and runs the tests.
    """

    def __init__(self, order: CampaignOrder) -> None:
        self.order = order
        self._idle: deque[_WorkerProcess] = deque()
        self._busy: set[_WorkerProcess] = set()
        self._closed = False

    def collect(self) -> Collected:
        """Return the collected tests; raise Refusal if pytest refuses them."""
        if not self._idle:
            self._idle.append(self._start())
        return self._idle[-1].collected

    def do(self, runs: Sequence[Run], digest: str) -> list[RunVerdict]:
        """Execute test runs one after the other in a worker process, and return their verdicts.

        Args:
            runs: runs of collected tests.
            digest: hash of the test files on the machine that started the campaign. The runs are
                refused if the test files on this machine have another hash.

        Raises:
            Refusal: the files of the tests are different on this machine.
        """
        left, verdicts = deque(runs), list[RunVerdict]()
        deaths = Counter[int]()
        while left:
            if self._closed:
                raise CampaignRefusal("the campaign is over")
            try:
                for verdict in self._request(left, digest):
                    verdicts.append(verdict)
                    left.popleft()
            except _RunHung:
                reason = f"no verdict within {self.order.timeout_s:g} s"
                verdicts.append(RunVerdict(left.popleft().number, HUNG, 0, "", reason))
            except _WorkerDied as death:  # its run is done again
                number = left[0].number
                deaths[number] += 1
                if deaths[number] == _ATTEMPTS:
                    left.popleft()
                    reason = f"its process ended {_ATTEMPTS} times, the last {death}"
                    verdicts.append(RunVerdict(number, DIED, 0, "", reason))
        return verdicts

    def _request(self, runs: Sequence[Run], digest: str) -> Iterator[RunVerdict]:
        """Yield the verdicts of runs as they arrive; a failing worker is killed."""
        worker = self._take(digest)
        self._busy.add(worker)
        try:
            worker.request(runs)
            for run in tuple(runs):
                yield worker.verdict(run, self.order.timeout_s)
        except BaseException:
            worker.end()
            raise
        finally:
            self._busy.discard(worker)
        self._idle.append(worker)

    def _take(self, digest: str) -> _WorkerProcess:
        """Return an idle worker, or a new one."""
        worker = None
        while worker is None or not worker.is_alive:  # one that was idle for long has ended
            if worker is not None:
                worker.end()
            try:
                worker = self._idle.pop()
            except IndexError:
                worker = self._start()
        if worker.collected.digest != digest:
            worker.end()
            raise CampaignRefusal(
                "the files of the tests are not the same everywhere: they were changed"
            )
        return worker

    def _start(self) -> _WorkerProcess:
        """Start a worker; if the worker ends at once, try again."""
        for attempt in range(_ATTEMPTS):
            try:
                return _WorkerProcess(self.order)
            except _WorkerDied as death:
                if attempt == _ATTEMPTS - 1:
                    raise CampaignRefusal(f"no worker starts; the last ended {death}") from None
        raise AssertionError

    def close(self) -> None:
        """Kill all workers."""
        self._closed = True
        while self._idle:
            self._idle.pop().end()
        for worker in [*self._busy]:  # whoever waits for it gives it back
            worker.kill()


# Workers on this machine.


class LocalWorkers:
    """Runs the tests of a campaign in several processes of this machine.

    Args:
        crew: the processes, which have collected the tests.
        digest: hash of the files of the tests.
        count: number of processes.
    """

    def __init__(self, crew: Crew, digest: str, count: int) -> None:
        self._crew, self._digest, self.count = crew, digest, count
        self._threads = ThreadPoolExecutor(count)  # a thread waits for each process

    def submit(self, runs: Sequence[Run]) -> Future[list[RunVerdict]]:
        """Submit runs to a process."""
        return self._threads.submit(self._crew.do, runs, self._digest)

    def close(self) -> None:
        """End all processes."""
        self._crew.close()
        self._threads.shutdown(cancel_futures=True)
