"""How late a bench was, and how long its threads had to wait for a processor."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path
from typing import Final

# How late a bench was: in real time a device can be judged only by one that keeps up.

_LATE_US: Final = 5_000
"""Later than this the bench cannot be believed: half a period of the RRC."""


def too_slow(**late_us: int) -> str:
    """Say which parts of a bench were too late to judge a device; empty if none was.

    Args:
        late_us: of each part, in microseconds.

    >>> too_slow(host=1_000, emulator=57_400)
    'the machine was too slow: host up to 1 ms, emulator up to 57 ms late'
    """
    if max(late_us.values()) <= _LATE_US:
        return ""
    times = ", ".join(f"{name} up to {us / 1_000:.0f} ms" for name, us in late_us.items())
    return f"the machine was too slow: {times} late"


# How long the threads of this process had to wait for a processor, as Linux counts it.

_TASKS: Final = Path("/proc/self/task")
_LOOK_US: Final = 10_000
"""Waits are added up over at least so long; sleepers wait a little each time they wake."""

_LONG_US: Final = 20 * _LOOK_US
"""In a longer time many short waits add up to what a late thread has."""


class CpuWaits:
    """The longest wait that came on in a short time; none where the system does not count.

    A thread waits for a processor when it could run and others are served. That is in the
    second number of `schedstat` of each thread (Linux, Documentation/scheduler/sched-stats).

    Args:
        tasks: the folder of the threads.
        spares_looker: the thread that looks is not looked at: it knows how late it is.

    Attributes:
        worst_us: the longest so far, in about `_LOOK_US`.
    """

    def __init__(self, tasks: Path = _TASKS, *, spares_looker: bool = False) -> None:
        self._tasks, self._spares_looker, self.worst_us = tasks, spares_looker, 0
        self._waited_ns: dict[str, int] = {}
        self._seen_us, self._own = -_LOOK_US, ""

    def look(self, now_us: int) -> None:
        """Look at all threads, unless that was a moment ago; what was long ago says nothing."""
        passed_us, before = now_us - self._seen_us, self._waited_ns
        if passed_us < _LOOK_US:
            return
        if self._spares_looker and not self._own:
            self._own = str(threading.get_native_id())
        self._seen_us, self._waited_ns = now_us, self._read()
        if passed_us > _LONG_US:
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
