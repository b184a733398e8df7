"""What goes to the power module: the stick, shaped, geared and limited, or the host's values."""

from __future__ import annotations

from dataclasses import dataclass, field

from tickrig.device.physical import InputBank
from tickrig.device.rrc.gearbox import Gear, Gearbox
from tickrig.device.rrc.limits import apply_limits
from tickrig.device.rrc.settings import Settings
from tickrig.device.rrc.shaping import shape
from tickrig.device.rrc.states import RrcState


@dataclass(slots=True)
class Drive:
    """Translation and rotation for the motors (DECISION R18).

    Attributes:
        out_pct: translation and rotation of the latest tick, -100..100 %.
        gearbox: the imitated gear change.
        by_stick: whether the stick drives.
    """

    out_pct: tuple[int, int] = (0, 0)
    gearbox: Gearbox = field(default_factory=Gearbox)
    by_stick: bool = False

    @property
    def alarm_since(self) -> int | None:
        """The tick at which the automatic alarm of the backward gear began."""
        in_reverse = self.by_stick and self.gearbox.gear is Gear.REVERSE
        return self.gearbox.reversed_at if in_reverse else None

    @property
    def changes_at(self) -> int | None:
        """The tick at which a resting stick takes the gear out."""
        engaged = self.by_stick and self.gearbox.gear is not Gear.NEUTRAL
        return self.gearbox.resets_at if engaged else None

    def step(self, tick: int, state: RrcState, settings: Settings, inputs: InputBank) -> None:
        """Decide what the motors get in this tick."""
        mode = driving_mode(state, settings)
        self.by_stick = mode is not None
        if mode is not None:
            steered = self._steer(tick, mode, settings, inputs)
            limited = state is RrcState.LIMIT
            self.out_pct = apply_limits(*steered, settings.limit) if limited else steered
        elif state is RrcState.OUTPUT:
            self.out_pct = settings.output.v_pct, settings.output.w_pct
        else:
            self.out_pct = 0, 0

    def _steer(
        self, tick: int, mode: int, settings: Settings, inputs: InputBank
    ) -> tuple[int, int]:
        """Shape the stick and imitate the gear change."""
        knobs = settings.joystick
        stick = inputs["stick_v_pct"], inputs["stick_w_pct"]
        shaped = (
            shape(stick[0], knobs.v_low_pct, knobs.v_high_pct, knobs.v_exponent),
            shape(stick[1], knobs.w_low_pct, knobs.w_high_pct, knobs.w_exponent),
        )
        return self.gearbox.drive(tick, mode, stick, shaped, knobs)


def driving_mode(state: RrcState, settings: Settings) -> int | None:
    """Return the reverse mode in which the stick drives, None if it does not."""
    if state is RrcState.LIMIT:
        return settings.joystick.reverse_mode
    return settings.button_mode if state is RrcState.STANDBY else None
