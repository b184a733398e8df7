"""What passes the doors to real devices, and what is done to them, for a journal."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from tickrig.emulators.testing.bench.journal import Journal
from tickrig.emulators.testing.bench.modes.real.door_watch import DoorWatch, HostPace
from tickrig.emulators.testing.bench.mounts import LineMount, Mount
from tickrig.host.text.trace import Mark


class DoorJournal(Journal):
    """A journal of what hosts send and receive; hosts have threads.

    Args:
        now_us: the time.
        after: called when something has been heard.
    """

    def __init__(self, now_us: Callable[[], int], after: Callable[[], None]) -> None:
        super().__init__()
        self._now_us, self._after, self._lock = now_us, after, threading.Lock()

    def watch(self, mount: Mount, pace: HostPace) -> DoorWatch:
        """Return a watch at a door of a wire.

        Args:
            mount: such a wire.
            pace: learns how late the host is.
        """
        if isinstance(mount, LineMount):
            return _Watch(pace, partial(self._hear_bytes, self._splitting(mount)))
        return _Watch(pace, partial(self._hear_frames, mount.name))

    def note(self, device: str, text: str) -> None:
        """Note what was done to a device."""
        with self._lock:
            self.add(self._now_us(), Mark.PHYSICAL, text.encode(), device)

    def _splitting(self, mount: LineMount) -> Callable[[int, Mark, bytes], None]:
        return self.of_line(mount.name, mount.settings.splitter)

    def _hear_bytes(
        self, hear: Callable[[int, Mark, bytes], None], mark: Mark, data: bytes
    ) -> None:
        with self._lock:
            hear(self._now_us(), mark, data)
        self._after()

    def _hear_frames(self, wire: str, mark: Mark, frames: tuple[Any, ...]) -> None:
        with self._lock:
            for frame in frames:
                self.add(self._now_us(), mark, str(frame).encode(), wire)
        self._after()


class _Watch:
    """Lets hosts pass, and hands on what they carry."""

    def __init__(self, pace: HostPace, hear: Callable[[Mark, Any], None]) -> None:
        self.waited, self.passed = pace.waited, hear

    def used(self) -> None:
        """Anybody may, at any time."""
