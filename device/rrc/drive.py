"""What goes to the power module: the stick, shaped, geared and limited, or the host's values."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import isqrt

from tickrig.device.physical import InputBank
from tickrig.device.rrc.gearbox import Gear, Gearbox
from tickrig.device.rrc.settings import Settings
from tickrig.device.rrc.states import RrcState
from tickrig.wire.rrc.commands import Limit


@lru_cache(maxsize=256)
def shape_table(low_pct: int, high_pct: int, exponent: int) -> tuple[int, ...]:
    """Return the output magnitude for each input magnitude from 0 to 100 %.

    The exponent acts on the stick position between the dead zones, and the
    result is rounded half up (DECISION R16).

    Args:
        low_pct: what counts as 0, 0..99 %.
        high_pct: what counts as 100, above `low_pct`, at most 100 %.
        exponent: 0..15; the power is 1 + 0.1 * exponent.
    """
    span, power = high_pct - low_pct, 1 + 0.1 * exponent
    positions = [min(max(a - low_pct, 0), span) / span for a in range(101)]
    return tuple(int(100 * s**power + 0.5 + 1e-9) for s in positions)


def shape(value_pct: int, low_pct: int, high_pct: int, exponent: int) -> int:
    """Shape one axis, -100..100 %; the sign is kept (RRC manual, `joystick` #1 to #6).

    >>> shape(-50, 0, 100, 5)
    -35
    """
    table = shape_table(low_pct, high_pct, exponent)
    return table[value_pct] if value_pct >= 0 else -table[-value_pct]


def apply_limits(v_pct: int, w_pct: int, limit: Limit) -> tuple[int, int]:
    """Return translation and rotation within the limits, signs kept (RRC manual, `limit`).

    First each input is cut off at its own limit. Then one common factor, which
    keeps the direction, is the smallest that sum, product and radius ask for;
    all is integer and rounds down (DECISION R19).

    >>> apply_limits(-100, -100, Limit(70, 100, 120, 30, 90))
    (-45, -65)
    """
    a, b = min(abs(v_pct), limit.v_pct), min(abs(w_pct), limit.w_pct)
    candidates = [(a, b)]
    if a + b > limit.sum_pct:
        candidates.append((a * limit.sum_pct // (a + b), b * limit.sum_pct // (a + b)))
    if a * b > (product := 100 * limit.product_pct):
        candidates.append((isqrt(product * a // b), isqrt(product * b // a)))
    if (square := a * a + b * b) > (most := limit.radius_pct * limit.radius_pct):
        candidates.append((isqrt(a * a * most // square), isqrt(b * b * most // square)))
    a, b = min(c[0] for c in candidates), min(c[1] for c in candidates)
    return (a if v_pct >= 0 else -a), (b if w_pct >= 0 else -b)


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
