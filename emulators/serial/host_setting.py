"""What the hosts of a line have set their port to, where the device has something else."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

LOOK_US: Final = 500_000


class HostSetting:
    """Tells, once each, the settings in which a device would not understand its host.

    Args:
        read: returns the present setting, as `9600 8N1`.
        wanted: the device's.
        notify: called with a setting that is not the device's.

    Attributes:
        differing: the present setting, if it is not the device's.
    """

    def __init__(self, read: Callable[[], str], wanted: str, notify: Callable[[str], None]) -> None:
        self._read, self._wanted, self._notify = read, wanted, notify
        self._notified: set[str] = set()
        self._next_us = 0
        self.differing = ""

    def look(self, now_us: int, *, at_once: bool = False) -> None:
        """Look whether it differs: twice a second, or at once.

        Args:
            now_us: the present.
            at_once: whether the host did something.
        """
        if now_us < self._next_us and not at_once:
            return
        self._next_us = now_us + LOOK_US
        setting = self._read()
        self.differing = "" if setting == self._wanted else setting
        if self.differing and setting not in self._notified:
            self._notified.add(setting)
            self._notify(setting)
