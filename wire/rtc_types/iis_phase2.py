# ruff: noqa: RUF009 - names as in the IDL, defaults are frozen
"""The common interfaces of mobile robots in phase 2 (RSi2/NEDO, mobile WG, 2009).

`id` told which robot was meant in the joint experiments; `error` was not used.
"""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import Double, Long
from tickrig.wire.rtc_types.iis import IisStruct


@dataclass(frozen=True, slots=True)
class TimedVelocity(IisStruct):
    """A moving command, also for bases that go sideways: m/s, m/s, rad/s."""

    tm: Time = Time()
    id: tuple[Long, ...] = ()
    vx: Double = 0.0
    vy: Double = 0.0
    w: Double = 0.0
    error: tuple[Double, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedPosition(IisStruct):
    """Where a robot is: m, m, rad."""

    tm: Time = Time()
    id: tuple[Long, ...] = ()
    x: Double = 0.0
    y: Double = 0.0
    theta: Double = 0.0
    error: tuple[Double, ...] = ()
