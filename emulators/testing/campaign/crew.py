"""Workers of a machine: each run is done, whoever is killed meanwhile."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from typing import Final

from tickrig.emulators.testing.campaign.order import (
    DIED,
    HUNG,
    Collected,
    Order,
    Refusal,
    Run,
    Verdict,
)
from tickrig.emulators.testing.campaign.worker_process import RunHung, WorkerDied, WorkerProcess

ATTEMPTS: Final = 3


class Crew:
    """Starts workers where none is idle; threads may ask at the same time.

    Args:
        order: what they collect.

    Attributes:
        order: the same.
    """

    def __init__(self, order: Order) -> None:
        self.order = order
        self._idle: deque[WorkerProcess] = deque()
        self._busy: set[WorkerProcess] = set()
        self._closed = False

    def collect(self) -> Collected:
        """Return what a worker has found; Refusal if pytest refuses it."""
        if not self._idle:
            self._idle.append(self._start())
        return self._idle[-1].collected

    def do(self, runs: Sequence[Run], digest: str) -> list[Verdict]:
        """Do runs one after the other.

        Args:
            runs: of tests that were collected.
            digest: of the files of the tests; others are refused.

        Raises:
            Refusal: they are not the same here.
        """
        left, verdicts = deque(runs), list[Verdict]()
        deaths = Counter[int]()
        while left:
            if self._closed:
                raise Refusal("the campaign is over")
            try:
                for verdict in self._request(left, digest):
                    verdicts.append(verdict)
                    left.popleft()
            except RunHung:
                reason = f"no verdict within {self.order.timeout_s:g} s"
                verdicts.append(Verdict(left.popleft().number, HUNG, 0, "", reason))
            except WorkerDied as death:  # its run is done again
                number = left[0].number
                deaths[number] += 1
                if deaths[number] == ATTEMPTS:
                    left.popleft()
                    reason = f"its process ended {ATTEMPTS} times, the last {death}"
                    verdicts.append(Verdict(number, DIED, 0, "", reason))
        return verdicts

    def _request(self, runs: Sequence[Run], digest: str) -> Iterator[Verdict]:
        """Yield the verdicts of runs as they come; a worker that fails is ended."""
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

    def _take(self, digest: str) -> WorkerProcess:
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
            raise Refusal("the files of the tests are not the same everywhere: they were changed")
        return worker

    def _start(self) -> WorkerProcess:
        """Start a worker; one that dies at once is tried again."""
        for attempt in range(ATTEMPTS):
            try:
                return WorkerProcess(self.order)
            except WorkerDied as death:
                if attempt == ATTEMPTS - 1:
                    raise Refusal(f"no worker starts; the last ended {death}") from None
        raise AssertionError

    def close(self) -> None:
        """End all workers, whatever they are at."""
        self._closed = True
        while self._idle:
            self._idle.pop().end()
        for worker in [*self._busy]:  # whoever waits for it gives it back
            worker.kill()
