"""64-bit integers with a time stamp, one and many: not in BasicDataType.idl, ours (K5)."""

from __future__ import annotations

from tickrig.wire.rtc_types.basic import Timed
from tickrig.wire.rtc_types.idl import LongLong, ULongLong


class TimedLongLong(Timed[LongLong]):
    """A long long, with its time."""


class TimedULongLong(Timed[ULongLong]):
    """An unsigned long long, with its time."""


class TimedLongLongSeq(Timed[tuple[LongLong, ...]]):
    """A sequence of long long, with its time."""


class TimedULongLongSeq(Timed[tuple[ULongLong, ...]]):
    """A sequence of unsigned long long, with its time."""
