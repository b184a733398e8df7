"""Workers on this machine."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor

from tickrig.emulators.testing.campaign.crew import Crew
from tickrig.emulators.testing.campaign.order import Run, Verdict


class LocalWorkers:
    """Processes of this machine, each with a thread that waits for it.

    Args:
        crew: who has collected.
        digest: of the files of the tests.
        count: how many.
    """

    def __init__(self, crew: Crew, digest: str, count: int) -> None:
        self._crew, self._digest, self.count = crew, digest, count
        self._threads = ThreadPoolExecutor(count)

    def submit(self, runs: Sequence[Run]) -> Future[list[Verdict]]:
        """Let a process do runs."""
        return self._threads.submit(self._crew.do, runs, self._digest)

    def close(self) -> None:
        """End all processes."""
        self._crew.close()
        self._threads.shutdown(cancel_futures=True)


def cores() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
