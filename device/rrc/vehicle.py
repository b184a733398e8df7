"""The vehicle behind VR2: its speed and battery, computed from the output.

The manual has no numbers of the vehicle. All values in this module are our choice: those of a
common electric wheelchair with a top speed of 6 km/h.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

_TOP_MM_S: Final = (333.0, 667.0, 1_000.0, 1_333.0, 1_667.0)
"""Forward speed at an output of 100 %, by speed mode."""

_BACKING: Final = 0.5
"""Share of the speed when driving backward."""

_TURN_MRAD_S: Final = (300.0, 600.0, 900.0, 1_200.0, 1_500.0)
"""Turning speed at an output of 100 %, by speed mode."""

_SPEEDING_MM_S2: Final = 800.0
_SLOWING_MM_S2: Final = 1_200.0
_BRAKING_MM_S2: Final = 3_000.0
"""Deceleration by the brakes, which are applied while VR2 is off."""

_TURN_PER_SPEED: Final = 3.0
"""Ratio of the turning acceleration in mrad/s² to the translation's acceleration in mm/s²."""

_IDLE_W: Final = 10.0
_ROLLING_N: Final = 30.0
_MASS_KG: Final = 150.0
_TURNING_W: Final = 60.0
_EFFICIENCY: Final = 0.6

_STEP_S: Final = 0.01
_J_PER_WH: Final = 3_600.0
_GAUGE_TOP: Final = 10


@dataclass(slots=True)
class Vehicle:
    """The wheelchair as a vehicle: its speed, path and battery, computed period by period.

    Args:
        battery_wh: capacity of the battery.

    Attributes:
        gauge: latest value of the physical input that sets the battery gauge, 1..10. Driving does
            not change this value. Driving changes `charge`.
        speed_mm_s: true speed, which is positive forward.
        turn_mrad_s: true turning speed, which is positive to the right.
        distance_mm: distance along the path. Backing counts negative.
        heading_mrad: angle by which the vehicle has turned to the right.
        charge: charge of the battery, 0..1.
    """

    battery_wh: int
    gauge: int = field(default=_GAUGE_TOP, init=False)
    speed_mm_s: float = field(default=0.0, init=False)
    turn_mrad_s: float = field(default=0.0, init=False)
    distance_mm: float = field(default=0.0, init=False)
    heading_mrad: float = field(default=0.0, init=False)
    charge: float = field(default=1.0, init=False)

    @property
    def moving(self) -> bool:
        """Whether the vehicle is still moving."""
        return self.speed_mm_s != 0.0 or self.turn_mrad_s != 0.0

    @property
    def shown_gauge(self) -> int:
        """The voltage gauge of the battery, 1..10."""
        return max(1, -int(-self.charge * _GAUGE_TOP // 1))

    def set_gauge(self, gauge: int) -> None:
        """Charge or discharge the battery if the input has changed."""
        if gauge != self.gauge:
            self.gauge, self.charge = gauge, gauge / _GAUGE_TOP

    def step(self, out_pct: tuple[int, int], speed_mode: int, *, running: bool) -> None:
        """Move the wheelchair for one period of 10 ms, and drain its battery.

        Args:
            out_pct: translation and rotation for the motors.
            speed_mode: speed mode, 1..5.
            running: whether the wheelchair control (VR2) is on. Otherwise the brakes are on.
        """
        v_pct, w_pct = out_pct if self.charge > 0.0 else (0, 0)
        top_mm_s = _TOP_MM_S[speed_mode - 1] * (_BACKING if v_pct < 0 else 1.0)
        before_mm_s, before_mrad_s = self.speed_mm_s, self.turn_mrad_s
        slowing = _SLOWING_MM_S2 if running else _BRAKING_MM_S2
        self.speed_mm_s = _toward(before_mm_s, top_mm_s * v_pct / 100, _SPEEDING_MM_S2, slowing)
        self.turn_mrad_s = _toward(
            before_mrad_s,
            _TURN_MRAD_S[speed_mode - 1] * w_pct / 100,
            _SPEEDING_MM_S2 * _TURN_PER_SPEED,
            slowing * _TURN_PER_SPEED,
        )
        self.distance_mm += (before_mm_s + self.speed_mm_s) / 2 * _STEP_S
        self.heading_mrad += (before_mrad_s + self.turn_mrad_s) / 2 * _STEP_S
        if running:
            self._use(abs(before_mm_s) / 1_000)

    def _use(self, before_m_s: float) -> None:
        """Drain the battery by the energy of this period."""
        speed_m_s = abs(self.speed_mm_s) / 1_000
        pushing_n = max(0.0, speed_m_s - before_m_s) / _STEP_S * _MASS_KG
        wheels_w = (_ROLLING_N + pushing_n) * speed_m_s
        turning_w = _TURNING_W * abs(self.turn_mrad_s) / _TURN_MRAD_S[-1]
        used_j = (_IDLE_W + wheels_w / _EFFICIENCY + turning_w) * _STEP_S
        self.charge = max(0.0, self.charge - used_j / (self.battery_wh * _J_PER_WH))


def _toward(value: float, wanted: float, speeding: float, slowing: float) -> float:
    """Return the speed one period later; the speed reaches zero before the direction reverses.

    >>> _toward(0.0, 100.0, 800.0, 1_200.0), _toward(5.0, -100.0, 800.0, 1_200.0)
    (8.0, 0.0)
    """
    if value * wanted < 0.0:
        wanted = 0.0
    change = (speeding if abs(wanted) > abs(value) else slowing) * _STEP_S
    return min(wanted, value + change) if wanted > value else max(wanted, value - change)
