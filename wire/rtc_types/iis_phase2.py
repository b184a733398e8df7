"""The common interfaces of mobile robots in phase 2 (RSi2/NEDO, mobile WG, 2009).

`id` told which robot was meant in the joint experiments; `error` was not used.
"""

from __future__ import annotations

from tickrig.wire.rtc_types.idl import Double
from tickrig.wire.rtc_types.iis import IisStruct


class TimedVelocity(IisStruct):
    """A moving command, also for bases that go sideways: m/s, m/s, rad/s."""

    vx: Double = 0.0
    vy: Double = 0.0
    w: Double = 0.0
    error: tuple[Double, ...] = ()


class TimedPosition(IisStruct):
    """Where a robot is: m, m, rad."""

    x: Double = 0.0
    y: Double = 0.0
    theta: Double = 0.0
    error: tuple[Double, ...] = ()
