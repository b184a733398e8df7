"""Maxon's own modes: a setting value is the reference at once (EPOS Firmware Specification)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.ds402.modes.cyclic import LatchedSetPoint
from tickrig.device.canopen.ds402.modes.mode import Mode
from tickrig.device.canopen.ds402.motion.reference import Control

CURRENT_SETTING: Final = 0x2030
POSITION_SETTING: Final = 0x2062
VELOCITY_SETTING: Final = 0x206B

SETTINGS: Final = (CURRENT_SETTING, POSITION_SETTING, VELOCITY_SETTING)


class PositionSetting(LatchedSetPoint):
    """Position mode, -1: 2062h in position units.

    That bit 8 of the controlword does nothing in these modes is DECISION K21.
    """

    index = POSITION_SETTING

    def follow(self, now_us: int) -> bool:
        """Be at the setting value."""
        self.reference.place(self.target())
        return True


class VelocitySetting(Mode):
    """Velocity mode, -2: 206Bh in velocity units.

    When the mode is chosen while the drive is enabled, 206Bh takes the present
    velocity (DECISION K21).
    """

    control = Control.VELOCITY
    halts = False

    def enter(self, *, enabled: bool) -> None:
        """Take the present velocity, unless the drive is just being enabled."""
        if enabled:
            present = round(self.reference.velocity / self.settings.units.per_velocity)
            self.drive.parameters.write(VELOCITY_SETTING, present)

    def run(self, now_us: int) -> bool:
        """Turn as fast as the setting value."""
        wanted = self.number(VELOCITY_SETTING) * self.settings.units.per_velocity
        velocity = self.take(self.drive.limits.velocity(wanted))
        self.reference.place(self.reference.position, velocity)
        return True


class CurrentSetting(Mode):
    """Current mode, -3: 2030h in milliamperes.

    When the mode is chosen while the drive is enabled, 2030h takes the present
    current (DECISION K21).
    """

    control = Control.CURRENT
    halts = False

    def enter(self, *, enabled: bool) -> None:
        """Take the present current, unless the drive is just being enabled."""
        if enabled:
            present = round(1_000 * self.reference.current_a) * self.axis.forward
            self.drive.parameters.write(CURRENT_SETTING, present)

    def run(self, now_us: int) -> bool:
        """Have the current of the setting value."""
        wanted_a = self.number(CURRENT_SETTING) / 1_000 * self.axis.forward
        self.reference.current_a = self.take(self.drive.limits.current(wanted_a))
        return True


MODES: Final[dict[int, type[Mode]]] = {
    -1: PositionSetting,
    -2: VelocitySetting,
    -3: CurrentSetting,
}
"""By number in 6060h."""
