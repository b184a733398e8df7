"""Modes of operation by their number in 6060h (CiA 402-2)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.ds402.cyclic import CyclicPosition, CyclicVelocity
from tickrig.device.canopen.ds402.mode import Mode
from tickrig.device.canopen.ds402.profile_velocity import ProfileVelocity
from tickrig.device.canopen.ds402.provisional import Homing, ProfilePosition

MODES: Final[dict[int, type[Mode]]] = {
    0: Mode,
    1: ProfilePosition,
    3: ProfileVelocity,
    6: Homing,
    8: CyclicPosition,
    9: CyclicVelocity,
}
"""Of any drive; a model may have more of its own, with negative numbers."""


def supported(modes: dict[int, type[Mode]]) -> int:
    """Return 6502h: bit n - 1 for mode n.

    >>> hex(supported(MODES))
    '0x1a5'
    """
    return sum(1 << number - 1 for number in modes if number > 0)
