"""A worker as who asks sees it: a process that is started, asked, and ended."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import Pipe
from threading import Lock
from typing import Final

from tickrig.emulators.testing.campaign.order import (
    Collected,
    Order,
    Refusal,
    Run,
    Verdict,
    verdicts_of,
)

START_S: Final = 300.0
"""So long collecting may take."""

LOOK_S: Final = 1.0

MOST_BYTES: Final = 64 << 20
"""Of an answer."""


class WorkerDied(Exception):  # noqa: N818 - nobody's fault
    """The process of a worker has ended; the text says how."""


class RunHung(Exception):  # noqa: N818 - that of the test
    """A run took too long; its worker was ended."""


class WorkerProcess:
    """A process in which pytest waits with the tests of an order.

    Args:
        order: what is collected.

    Raises:
        Refusal: pytest refuses it.
        WorkerDied: the process has ended before it could say anything.
    """

    def __init__(self, order: Order) -> None:
        if not os.path.isdir(order.folder):
            raise Refusal(f"no directory {order.folder}")
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
            answer = self._receive(START_S)
            if not isinstance(answer, Collected):
                raise Refusal(str(answer))
            self.collected: Collected = answer
        except RunHung:
            raise Refusal(f"the tests were not collected within {START_S:g} s") from None
        except BrokenPipeError:
            raise self._died() from None
        finally:
            if not hasattr(self, "collected"):
                self.end()

    def request(self, runs: Sequence[Run]) -> None:
        """Ask for runs; WorkerDied if nobody is there."""
        try:
            self._conn.send(list(runs))
        except OSError:
            raise self._died() from None

    def verdict(self, run: Run, timeout_s: float) -> Verdict:
        """Wait for the verdict of a run.

        Raises:
            RunHung: it did not come in time.
            WorkerDied: it never will, or something else came.
        """
        answer = self._receive(timeout_s)
        try:
            return verdicts_of([answer], [run])[0]
        except ValueError as mistake:
            raise WorkerDied(f"when it sent {mistake}") from None

    def _receive(self, timeout_s: float) -> object:
        """Wait for an answer; time in which this process is stopped does not count."""
        waited_s = 0.0
        try:
            while not self._conn.poll(LOOK_S):
                waited_s += LOOK_S
                if waited_s >= timeout_s:
                    raise RunHung
            data = self._conn.recv_bytes(MOST_BYTES)
        except (EOFError, OSError):
            raise self._died() from None
        try:
            return pickle.loads(data)
        except Exception as error:  # pickle raises anything
            raise WorkerDied(f"when it sent what cannot be read: {error!r}") from None

    def _died(self) -> WorkerDied:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LOOK_S)
        status = self._process.poll()
        if status is not None and status < 0:
            return WorkerDied(f"by signal {-status}, {signal.strsignal(-status)}")
        return WorkerDied(f"with exit status {status}")

    @property
    def is_alive(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def kill(self) -> None:
        """End the process, and what it has started, whatever it is at."""
        with self._lock:
            if self._process.poll() is None:
                os.killpg(self._process.pid, signal.SIGKILL)
                self._process.wait()

    def end(self) -> None:
        """End the process, and give back what it was spoken to by."""
        self.kill()
        self._conn.close()
        if self._alive >= 0:
            os.close(self._alive)
        self._alive = -1
