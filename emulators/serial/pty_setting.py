"""What the host has set its end of a pseudo-terminal to, as far as the kernel keeps it."""

from __future__ import annotations

import termios
from collections.abc import Callable
from typing import Final

LOOK_US: Final = 500_000

BAUDS: Final = {
    code: int(name[1:])
    for name, code in vars(termios).items()
    if name[:1] == "B" and name[1:].isdigit()
}
"""Bit rates by their number in a termios; others have none."""


class HostSetting:
    """Tells, once each, the settings in which a device would not understand its host.

    Linux keeps the bit rate, the stop bits and whether parity is odd. A pseudo-terminal always
    has 8 bits, and even parity cannot be told from none.

    Args:
        terminal: either side, open.
        baud: the device's rate, with 8N1. It is set, so that a host which sets nothing has it.
        tell: called with a setting as `9600 8N1` that is not the device's.

    Attributes:
        differing: the present setting, if it is not the device's.
    """

    def __init__(self, terminal: int, baud: int, tell: Callable[[str], None]) -> None:
        self._terminal, self._tell = terminal, tell
        self._told: set[str] = set()
        self._next_us = 0
        self.differing = ""
        codes = [code for code, rate in BAUDS.items() if rate == baud]
        self._known = bool(codes)
        if codes:
            attributes = termios.tcgetattr(terminal)
            attributes[4:6] = codes[0], codes[0]
            termios.tcsetattr(terminal, termios.TCSANOW, attributes)
        self._wanted = setting_of(terminal)

    def look(self, now_us: int) -> None:
        """Look whether it differs, every now and then."""
        if not self._known or now_us < self._next_us:
            return
        self._next_us = now_us + LOOK_US
        setting = setting_of(self._terminal)
        self.differing = "" if setting == self._wanted else setting
        if self.differing and setting not in self._told:
            self._told.add(setting)
            self._tell(setting)


def setting_of(terminal: int) -> str:
    """Return rate, bits, parity and stop bits, as `115200 8N1`."""
    _, _, flags, _, _, speed, _ = termios.tcgetattr(terminal)
    bits = {termios.CS5: 5, termios.CS6: 6, termios.CS7: 7}.get(flags & termios.CSIZE, 8)
    parity = "O" if flags & termios.PARODD else "E" if flags & termios.PARENB else "N"
    stops = 2 if flags & termios.CSTOPB else 1
    return f"{BAUDS.get(speed, 'another rate,')} {bits}{parity}{stops}"
