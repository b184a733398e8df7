"""The mirror that turns: when scans begin and end."""

from __future__ import annotations

from dataclasses import dataclass, field

from tickrig.device.urg.texts import BY_DEFAULT

TURN_US_RPM = 60_000_000


@dataclass(slots=True)
class Rotation:
    """One scan a turn, without drift.

    Attributes:
        speed_rpm: turns a minute.
        level: of CR, 0..10; each takes 1 % off the speed.
        began_us: when the first scan at this speed began.
    """

    speed_rpm: int
    level: int = 0
    began_us: int = field(default=0, init=False)

    @property
    def present_rpm(self) -> int:
        """Turns a minute at the level."""
        return self.speed_rpm * (100 - self.level) // 100

    @property
    def period_us(self) -> int:
        """How long a turn takes."""
        return TURN_US_RPM // self.present_rpm

    @property
    def text(self) -> str:
        """The speed, as II tells it."""
        speed = f"{self.present_rpm}[rpm]"
        return speed if self.level else f"Initial({speed}){BY_DEFAULT}"

    def whole_end_us(self, now_us: int) -> int:
        """Return when the first scan ends that begins now or later."""
        period_us = self.period_us
        return self.began_us + (-(-(now_us - self.began_us) // period_us) + 1) * period_us

    def change(self, now_us: int, level: int) -> None:
        """Turn at another level from now on."""
        self.level, self.began_us = level, now_us
