"""The reverse modes and the imitated gear change (RRC manual, `joystick` #7 to #10)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import atan2, degrees
from typing import Final

from tickrig.wire.rrc.commands import Joystick

RESET_TICKS: Final = 20
"""A stick that rests 0.2 s in neutral takes the gear out."""


class Gear(Enum):
    """The imitated gear."""

    NEUTRAL = "N"
    FORWARD = "F"
    REVERSE = "R"


@dataclass(slots=True)
class Gearbox:
    """Gear of modes 2 and 3, chosen by where the stick leaves neutral.

    Attributes:
        gear: the gear after the latest tick.
        reversed_at: tick at which gear R was chosen; the automatic alarm counts from it.
        resets_at: tick at which a stick that stays in neutral takes the gear out.
    """

    gear: Gear = Gear.NEUTRAL
    reversed_at: int = 0
    resets_at: int | None = None

    def reset(self) -> None:
        """Take the gear out: limit mode is entered, or the reverse mode changes."""
        self.gear, self.resets_at = Gear.NEUTRAL, None

    def drive(
        self, tick: int, mode: int, stick: tuple[int, int], shaped: tuple[int, int], knobs: Joystick
    ) -> tuple[int, int]:
        """Return translation and rotation of one tick in reverse mode 0 to 3.

        Args:
            tick: number of the tick.
            mode: reverse mode, #7 or what the buttons chose.
            stick: translation and rotation as received; they choose the gear.
            shaped: the same after shaping; they are what is driven (DECISION R18).
            knobs: #8 to #10.
        """
        v_pct, w_pct = shaped
        if mode == 0:
            return v_pct, w_pct
        if mode == 1:
            return max(v_pct, 0), w_pct
        if self._rests(tick, stick, knobs.neutral_pct):
            return 0, 0
        angle = angle_deg(stick)
        if self.gear is Gear.NEUTRAL:
            self._engage(tick, Gear.REVERSE if angle <= knobs.switch_deg else Gear.FORWARD)
        if self.gear is Gear.FORWARD:
            return max(v_pct, 0), w_pct
        if stick[0] > 0:
            return 0, 0
        turn = -1 if mode == 3 else 1
        return fade(v_pct, angle, knobs.fade_deg), turn * fade(w_pct, angle, knobs.fade_deg)

    def _rests(self, tick: int, stick: tuple[int, int], neutral_pct: int) -> bool:
        """Whether the stick is in neutral; it takes the gear out when it stays there."""
        if stick[0] ** 2 + stick[1] ** 2 > neutral_pct**2:
            self.resets_at = None
            return False
        if self.resets_at is None:
            self.resets_at = tick + RESET_TICKS
        if tick >= self.resets_at:
            self.gear = Gear.NEUTRAL
        return True

    def _engage(self, tick: int, gear: Gear) -> None:
        self.gear = gear
        if gear is Gear.REVERSE:
            self.reversed_at = tick


def angle_deg(stick: tuple[int, int]) -> float:
    """Return the stick's angle: 0 straight back, 90 sideways, 180 forward (DECISION R17)."""
    v_pct, w_pct = stick
    return degrees(atan2(abs(w_pct), -v_pct))


def fade(value_pct: int, angle: float, start_deg: int) -> int:
    """Scale a value from full at `start_deg` to nothing at 90 degrees, toward zero.

    >>> fade(-40, 56.31, 45), fade(60, 90.0, 45), fade(60, 90.0, 90)
    (-29, 0, 60)
    """
    if angle <= start_deg:
        return value_pct
    return int(value_pct * (90 - angle) / (90 - start_deg))
