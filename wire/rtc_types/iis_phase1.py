# ruff: noqa: RUF009 - names as in the IDL, defaults are frozen
"""The common interface of mobile robots in phase 1 (RSi2/NEDO, mobile WG, 2008): one struct."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import Double, Struct


@dataclass(frozen=True, slots=True)
class TimedVelocity(Struct):
    """A moving command for two wheels: m/s forward, rad/s to the left."""

    tm: Time = Time()
    v: Double = 0.0
    w: Double = 0.0
