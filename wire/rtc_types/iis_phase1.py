"""The common interface of mobile robots in phase 1 (RSi2/NEDO, mobile WG, 2008): one struct."""

from __future__ import annotations

from tickrig.wire.rtc_types.basic import Stamped
from tickrig.wire.rtc_types.idl import Double


class TimedVelocity(Stamped):
    """A moving command for two wheels: m/s forward, rad/s to the left."""

    v: Double = 0.0
    w: Double = 0.0
