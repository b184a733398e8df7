"""How long the threads of this process had to wait for a processor, as Linux counts it."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path
from typing import Final

TASKS: Final = Path("/proc/self/task")
LOOK_US: Final = 10_000
"""Waits are added up over at least so long; sleepers wait a little each time they wake."""

LONG_US: Final = 20 * LOOK_US
"""In a longer time many short waits add up to what a late thread has."""


class CpuWaits:
    """The longest wait that came on in a short time; none where the system does not count.

    A thread waits for a processor when it could run and others are served. That is in the
    second number of `schedstat` of each thread (Linux, Documentation/scheduler/sched-stats).

    Args:
        tasks: the folder of the threads.
        spares_looker: the thread that looks is not looked at: it knows how late it is.

    Attributes:
        worst_us: the longest so far, in about `LOOK_US`.
    """

    def __init__(self, tasks: Path = TASKS, *, spares_looker: bool = False) -> None:
        self._tasks, self._spares_looker, self.worst_us = tasks, spares_looker, 0
        self._waited_ns: dict[str, int] = {}
        self._seen_us, self._own = -LOOK_US, ""

    def look(self, now_us: int) -> None:
        """Look at all threads, unless that was a moment ago; what was long ago says nothing."""
        passed_us, before = now_us - self._seen_us, self._waited_ns
        if passed_us < LOOK_US:
            return
        if self._spares_looker and not self._own:
            self._own = str(threading.get_native_id())
        self._seen_us, self._waited_ns = now_us, self._read()
        if passed_us > LONG_US:
            return
        for thread, waited_ns in self._waited_ns.items():
            longer_us = (waited_ns - before.get(thread, waited_ns)) // 1_000
            self.worst_us = max(self.worst_us, longer_us)

    def _read(self) -> dict[str, int]:
        waited_ns = {}
        with suppress(OSError):
            for thread in os.listdir(self._tasks):
                if thread == self._own:
                    continue
                with suppress(OSError, IndexError, ValueError):  # it has ended, or nobody counts
                    text = (self._tasks / thread / "schedstat").read_bytes()
                    waited_ns[thread] = int(text.split()[1])
        return waited_ns
