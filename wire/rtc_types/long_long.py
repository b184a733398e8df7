"""64-bit integers with a time stamp: not in BasicDataType.idl, ours (K5)."""

# ruff: noqa: RUF009 - values are immutable

from __future__ import annotations

from dataclasses import dataclass

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import LongLong, Struct, ULongLong


@dataclass(frozen=True, slots=True)
class TimedLongLong(Struct):
    """A long long, with its time."""

    tm: Time = Time()
    data: LongLong = 0


@dataclass(frozen=True, slots=True)
class TimedULongLong(Struct):
    """An unsigned long long, with its time."""

    tm: Time = Time()
    data: ULongLong = 0
