"""Modes of operation by their number in 6060h (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.device.canopen.ds402.modes.cyclic import (
    CyclicPosition,
    CyclicVelocity,
    InterpolatedPosition,
)
from tickrig.device.canopen.ds402.modes.homing import Homing
from tickrig.device.canopen.ds402.modes.mode import Mode
from tickrig.device.canopen.ds402.modes.profile_position import ProfilePosition
from tickrig.device.canopen.ds402.modes.velocity_and_torque import (
    CyclicTorque,
    ProfileTorque,
    ProfileVelocity,
)

MODES: Final[dict[int, type[Mode]]] = {
    0: Mode,
    1: ProfilePosition,
    3: ProfileVelocity,
    4: ProfileTorque,
    6: Homing,
    7: InterpolatedPosition,
    8: CyclicPosition,
    9: CyclicVelocity,
    10: CyclicTorque,
}
"""Of any drive; a model may have more of its own, with negative numbers."""


def offered(modes: Mapping[int, type[Mode]], listed: int) -> Mapping[int, type[Mode]]:
    """Return the modes that a dictionary lists in its 6502h, all if it lists none.

    >>> sorted(offered(MODES, 0b101))
    [0, 1, 3]
    """
    return {n: mode for n, mode in modes.items() if n <= 0 or not listed or listed >> n - 1 & 1}


def supported(modes: Mapping[int, type[Mode]]) -> int:
    """Return 6502h: bit n - 1 for mode n.

    >>> hex(supported(MODES))
    '0x3ed'
    """
    return sum(1 << number - 1 for number in modes if number > 0)
