"""A campaign under way: runs are handed out, and verdicts come back, until all are done."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice
from time import monotonic
from typing import Final, Protocol

from tickrig.emulators.testing.campaign.journal import CampaignJournal
from tickrig.emulators.testing.campaign.order import Run, Verdict
from tickrig.emulators.testing.campaign.plan import Plan

BATCH_S: Final = 1.0
"""So long a batch takes, about: what a kill costs, and the handing out of each."""

MOST: Final = 500
"""Runs of a batch."""


class Workers(Protocol):
    """Who does runs: on this machine, or on a cluster."""

    @property
    def count(self) -> int:
        """How many runs are done at the same time."""
        ...

    def submit(self, runs: Sequence[Run]) -> Future[list[Verdict]]:
        """Let runs be done; the future may raise Refusal."""
        ...

    def close(self) -> None:
        """End all that is under way."""
        ...


class Campaign:
    """Runs that are to be done, and what became of them.

    Args:
        plan: all runs.
        journal: where verdicts are kept; runs that it has are not done again.
        workers: who does them.
    """

    def __init__(self, plan: Plan, journal: CampaignJournal, workers: Workers) -> None:
        self._plan, self._journal, self._workers = plan, journal, workers
        done = journal.verdicts
        self._left = (number for number in plan.numbers() if number not in done)
        self._count = plan.size() - len(done)
        self._under_way: dict[Future[list[Verdict]], float] = {}
        self._size = 1

    def verdicts(self) -> Iterator[list[Verdict]]:
        """Do all runs; give verdicts as they are on the disk.

        Raises:
            Refusal: the workers cannot go on.
            JournalFullError: nothing can be written any more.
        """
        while self._submit():
            done, _ = wait(self._under_way, return_when=FIRST_COMPLETED)
            for future in done:
                verdicts, begun_s = future.result(), self._under_way.pop(future)
                self._count -= len(verdicts)
                self._learn(monotonic() - begun_s)
                yield self._journal.add(verdicts)

    def _submit(self) -> bool:
        """Keep all workers busy, and a batch for each ready; False if all is done."""
        workers = self._workers.count
        while len(self._under_way) < 2 * workers:
            numbers = list(islice(self._left, self._batch(workers)))
            if not numbers:
                break
            future = self._workers.submit([self._plan.run(number) for number in numbers])
            self._under_way[future] = monotonic()
        return bool(self._under_way)

    def _batch(self, workers: int) -> int:
        """Return how many runs are next: less towards the end, so that all workers end together."""
        return max(1, min(self._size, self._count // (4 * workers)))

    def _learn(self, took_s: float) -> None:
        """Make batches larger or smaller; how long they wait for another one counts, too."""
        if took_s < BATCH_S:
            self._size = min(MOST, 2 * self._size)
        elif took_s > 4 * BATCH_S:
            self._size = max(1, self._size // 2)
