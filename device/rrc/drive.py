"""Values for the power module: the shaped, geared and limited stick, or the host's values."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import lru_cache
from math import atan2, degrees, isqrt
from typing import Final

from tickrig.device.physical import InputBank
from tickrig.device.rrc.settings import RrcState, Settings
from tickrig.wire.rrc.commands import Joystick, Limit

# The buttons of the VR2 controller as the RRC sees them while VR2 runs.

_SPEED_MODES: Final = range(1, 6)

_BUTTON_MODES: Final = {(0, 0): 0, (1, 0): 1, (0, 1): 2, (1, 1): 3}
"""Reverse modes by held buttons (down, up) when alarm is pressed (RRC manual, last page)."""


def count_button_edges(inputs: InputBank, settings: Settings) -> bool:
    """Count presses and releases of the speed and alarm buttons, and change the speed mode.

    Each button has a counter, which is odd while the button is pressed (fields #7 to #9 of the
    status line SA in the RRC manual). If a button is pressed and its counter is even, the button
    has just been pressed. If a button is not pressed and its counter is odd, it has just been
    released. In both cases the counter is increased by 1. The counters change whether or not the
    speed buttons are locked (DECISION R23).

    Returns:
        True if the alarm button has just been pressed.
    """
    up, down = inputs["speed_up_button"], inputs["speed_down_button"]
    if settings.speed_up_count & 1 != up:
        settings.speed_up_count = (settings.speed_up_count + 1) & 0xF
        _shift_speed(settings, up)
    if settings.speed_down_count & 1 != down:
        settings.speed_down_count = (settings.speed_down_count + 1) & 0xF
        _shift_speed(settings, -down)
    if settings.alarm_count & 1 != inputs["alarm_button"]:
        settings.alarm_count = (settings.alarm_count + 1) & 0xF
        return bool(inputs["alarm_button"])
    return False


def chosen_mode(inputs: InputBank) -> int:
    """Return the reverse mode that the held speed buttons choose (DECISION R8)."""
    return _BUTTON_MODES[inputs["speed_down_button"], inputs["speed_up_button"]]


def _shift_speed(settings: Settings, step: int) -> None:
    mode = settings.speed_mode + step
    if not settings.speed_locked and mode in _SPEED_MODES:
        settings.speed_mode = mode


# The reverse modes and the imitated gear change (RRC manual, `joystick` #7 to #10).

_RESET_TICKS: Final = 20
"""Time in neutral, 0.2 s, after which the gear is disengaged."""


class Gear(Enum):
    """Gears of the imitated gear change."""

    NEUTRAL = "N"
    FORWARD = "F"
    REVERSE = "R"


@dataclass(slots=True)
class Gearbox:
    """The gear that the RRC imitates in reverse modes 2 and 3.

    The reverse mode of an RRC wheelchair controller determines how the wheelchair moves when the
    stick is pulled back. In modes 2 and 3 there are a forward gear and a backward gear. The
    wheelchair moves back only in the backward gear. The direction in which the stick leaves neutral
    chooses the gear, and the gear is kept until the stick is in neutral again.

    Attributes:
        gear: the gear after the latest tick.
        reversed_at: number of the tick at which gear R was chosen. The automatic alarm counts from
            this tick.
        resets_at: number of the tick at which the gear is disengaged if the stick stays in neutral.
    """

    gear: Gear = Gear.NEUTRAL
    reversed_at: int = 0
    resets_at: int | None = None

    def reset(self) -> None:
        """Disengage the gear when limit mode is entered or the reverse mode changes."""
        self.gear, self.resets_at = Gear.NEUTRAL, None

    def drive(
        self, tick: int, mode: int, stick: tuple[int, int], shaped: tuple[int, int], knobs: Joystick
    ) -> tuple[int, int]:
        """Return translation and rotation for one tick.

        They are the values of `shaped`. The reverse mode and the gear can reduce them, or change
        the sign of the rotation (DECISION R18).

        Args:
            tick: number of the tick.
            mode: reverse mode 0 to 3, which determines the movement when the stick is pulled back
                (see `Gearbox`). Parameter #7 of the command `joystick` or the buttons set this
                mode.
            stick: translation and rotation of the stick itself. They determine the gear.
            shaped: translation and rotation of the stick after the function `shape`.
            knobs: parameters of the command `joystick`. This method uses #8 to #10: the neutral
                radius `neutral_pct`, and the angles `switch_deg` and `fade_deg`.
        """
        v_pct, w_pct = shaped
        if mode == 0:
            return v_pct, w_pct
        if mode == 1:
            return max(v_pct, 0), w_pct
        if self._rests(tick, stick, knobs.neutral_pct):
            return 0, 0
        # The gear follows the raw stick; only the output values are shaped (R18). A dead zone or an
        # exponent must not move the stick angle at which the backward gear engages.
        angle = _angle_deg(stick)
        if self.gear is Gear.NEUTRAL:
            self._engage(tick, Gear.REVERSE if angle <= knobs.switch_deg else Gear.FORWARD)
        # Backward stick in gear F gives standstill, with turning still possible: the stick left
        # neutral more than `switch_deg` from straight back. Only neutral disengages the gear (R17).
        if self.gear is Gear.FORWARD:
            return max(v_pct, 0), w_pct
        if stick[0] > 0:
            return 0, 0
        turn = -1 if mode == 3 else 1
        return _fade(v_pct, angle, knobs.fade_deg), turn * _fade(w_pct, angle, knobs.fade_deg)

    def _rests(self, tick: int, stick: tuple[int, int], neutral_pct: int) -> bool:
        """Return whether the stick is in neutral; if it stays there, disengage the gear."""
        if stick[0] ** 2 + stick[1] ** 2 > neutral_pct**2:
            self.resets_at = None
            return False
        if self.resets_at is None:
            self.resets_at = tick + _RESET_TICKS
        if tick >= self.resets_at:
            # The gear is disengaged twenty ticks after the first tick inside the radius, not in the
            # twentieth tick inside it. A duration is the difference of two tick times, as for the
            # watchdog (spec, section 5, corrected).
            self.gear = Gear.NEUTRAL
        return True

    def _engage(self, tick: int, gear: Gear) -> None:
        self.gear = gear
        if gear is Gear.REVERSE:
            self.reversed_at = tick


def _angle_deg(stick: tuple[int, int]) -> float:
    """Return the stick's angle (DECISION R17): 0 is straight back, 90 sideways, 180 forward."""
    v_pct, w_pct = stick
    return degrees(atan2(abs(w_pct), -v_pct))


def _fade(value_pct: int, angle: float, start_deg: int) -> int:
    """Scale a value from full at `start_deg` to nothing at 90 degrees, toward zero.

    >>> _fade(-40, 56.31, 45), _fade(60, 90.0, 45), _fade(60, 90.0, 90)
    (-29, 0, 60)
    """
    if angle <= start_deg:
        return value_pct
    # `int` truncates toward zero, as R18 requires. `start_deg` = 90 never reaches this line,
    # because no angle at which gear R drives is above 90.
    return int(value_pct * (90 - angle) / (90 - start_deg))


@lru_cache(maxsize=256)
def _shape_table(low_pct: int, high_pct: int, exponent: int) -> tuple[int, ...]:
    """Return the output magnitude for each input magnitude from 0 to 100 %.

    The exponent acts on the stick position between the dead zones, and the
    result is rounded half up (DECISION R16).

    Args:
        low_pct: largest value that counts as 0, 0..99 %.
        high_pct: smallest value that counts as 100 %, above `low_pct`, at most 100 %.
        exponent: exponent 0..15. The power is 1 + 0.1 * exponent.
    """
    span, power = high_pct - low_pct, 1 + 0.1 * exponent
    positions = [min(max(a - low_pct, 0), span) / span for a in range(101)]
    # Half up, as R16 requires. Floating point may make a product such as 0.5 * 100 slightly smaller
    # than the half; adding 1e-9 corrects this.
    return tuple(int(100 * s**power + 0.5 + 1e-9) for s in positions)


def shape(value_pct: int, low_pct: int, high_pct: int, exponent: int) -> int:
    """Apply dead zone and curve to one axis of the stick (RRC manual, `joystick` #1 to #6).

    Args:
        value_pct: position of the stick, -100..100 %. The result has the same sign.
        low_pct: largest value that counts as 0, 0..99 %.
        high_pct: smallest value that counts as 100 %, above `low_pct`, at most 100 %.
        exponent: number 0..15 that selects the curve x^p, with p = 1 + 0.1 * exponent. Here x is
            the position between `low_pct` and `high_pct`, from 0 to 1.

    >>> shape(-50, 0, 100, 5)
    -35
    """
    table = _shape_table(low_pct, high_pct, exponent)
    return table[value_pct] if value_pct >= 0 else -table[-value_pct]


def apply_limits(v_pct: int, w_pct: int, limit: Limit) -> tuple[int, int]:
    """Return translation and rotation, reduced to the limits of a `limit` command.

    The limits apply to the absolute values, and the signs stay. The command has five limits (RRC
    manual, `limit`). The first is for translation, and the second is for rotation. The other three
    are for both values together: for their sum, for their product, and for the root of the sum of
    their squares. First, each value is reduced to its own limit. Then both values are multiplied by
    the same factor, so that the direction of travel stays the same. The factor is the largest one,
    at most 1, with which the other three limits are kept. All arithmetic is integer and rounds down
    (DECISION R19).

    >>> apply_limits(-100, -100, Limit(70, 100, 120, 30, 90))
    (-45, -65)
    """
    a, b = min(abs(v_pct), limit.v_pct), min(abs(w_pct), limit.w_pct)
    candidates = [(a, b)]
    if a + b > limit.sum_pct:
        candidates.append((a * limit.sum_pct // (a + b), b * limit.sum_pct // (a + b)))
    # The limit is a percentage of a percentage. The largest product is 100 * 100 / 100, so 255 is
    # beyond it and means "no limit" for #4, as it does for #3 and #5 (R19).
    if a * b > (product := 100 * limit.product_pct):
        candidates.append((isqrt(product * a // b), isqrt(product * b // a)))
    if (square := a * a + b * b) > (most := limit.radius_pct * limit.radius_pct):
        candidates.append((isqrt(a * a * most // square), isqrt(b * b * most // square)))
    a, b = min(c[0] for c in candidates), min(c[1] for c in candidates)
    return (a if v_pct >= 0 else -a), (b if w_pct >= 0 else -b)


@dataclass(slots=True)
class Drive:
    """Computes translation and rotation for the motors in each tick (DECISION R18).

    Attributes:
        out_pct: translation and rotation of the latest tick, -100..100 %.
        gearbox: the gear that the RRC imitates; see `Gearbox`.
        by_stick: whether the stick drives the motors.
    """

    out_pct: tuple[int, int] = (0, 0)
    gearbox: Gearbox = field(default_factory=Gearbox)
    by_stick: bool = False

    @property
    def alarm_since(self) -> int | None:
        """The tick at which the automatic alarm of the backward gear started."""
        in_reverse = self.by_stick and self.gearbox.gear is Gear.REVERSE
        return self.gearbox.reversed_at if in_reverse else None

    @property
    def changes_at(self) -> int | None:
        """The tick at which a stick in neutral disengages the gear."""
        engaged = self.by_stick and self.gearbox.gear is not Gear.NEUTRAL
        return self.gearbox.resets_at if engaged else None

    def step(self, tick: int, state: RrcState, settings: Settings, inputs: InputBank) -> None:
        """Compute the values for the motors in this tick."""
        mode = _driving_mode(state, settings)
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
        """Shape the stick and apply the imitated gear."""
        knobs = settings.joystick
        stick = inputs["stick_v_pct"], inputs["stick_w_pct"]
        shaped = (
            shape(stick[0], knobs.v_low_pct, knobs.v_high_pct, knobs.v_exponent),
            shape(stick[1], knobs.w_low_pct, knobs.w_high_pct, knobs.w_exponent),
        )
        return self.gearbox.drive(tick, mode, stick, shaped, knobs)


def _driving_mode(state: RrcState, settings: Settings) -> int | None:
    """Return the reverse mode in which the stick drives, or None if it does not drive."""
    if state is RrcState.LIMIT:
        # This is #7 of the `joystick` command, never the mode that the buttons chose: the buttons'
        # mode counts only in Standby (R8).
        return settings.joystick.reverse_mode
    return settings.button_mode if state is RrcState.STANDBY else None
