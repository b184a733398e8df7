"""BasicDataType.idl of OpenRTM-aist 1.x: time stamps, and each IDL type with one."""

from __future__ import annotations

from typing import Any, Final, Generic, TypeVar

from tickrig.wire.rtc_types.idl import (
    Boolean,
    Char,
    Double,
    Float,
    Long,
    Octet,
    OctetSeq,
    Short,
    String,
    Struct,
    ULong,
    UShort,
    WChar,
    WString,
)

D = TypeVar("D")

_US: Final = 1_000_000
_ZERO: Final[Any] = None  # the metaclass puts that of the type in its place


class Time(Struct):
    """A time stamp in seconds and nanoseconds.

    Attributes:
        sec: whole seconds.
        nsec: the rest in nanoseconds.
    """

    sec: ULong = 0
    nsec: ULong = 0

    @classmethod
    def from_us(cls, now_us: int) -> Time:
        """Make a time stamp.

        Args:
            now_us: a time in microseconds.

        Returns:
            The same in seconds and nanoseconds.
        """
        return cls(now_us // _US, now_us % _US * 1_000)

    @property
    def us(self) -> int:
        """The time in microseconds, rounded down."""
        return self.sec * _US + self.nsec // 1_000


class Stamped(Struct):
    """A struct that begins with its time."""

    tm: Time = Time()


class Timed(Stamped, Generic[D]):
    """A time and one value, of the type in brackets."""

    data: D = _ZERO


class TimedState(Timed[Short]):
    """A state (IDL: short), with its time."""


class TimedShort(Timed[Short]):
    """A short, with its time."""


class TimedLong(Timed[Long]):
    """A long, with its time."""


class TimedUShort(Timed[UShort]):
    """An unsigned short, with its time."""


class TimedULong(Timed[ULong]):
    """An unsigned long, with its time."""


class TimedFloat(Timed[Float]):
    """A float, with its time."""


class TimedDouble(Timed[Double]):
    """A double, with its time."""


class TimedChar(Timed[Char]):
    """A char, with its time."""


class TimedWChar(Timed[WChar]):
    """A wchar, with its time."""


class TimedBoolean(Timed[Boolean]):
    """A boolean, with its time."""


class TimedOctet(Timed[Octet]):
    """An octet, with its time."""


class TimedString(Timed[String]):
    """A string, with its time."""


class TimedWString(Timed[WString]):
    """A wstring, with its time."""


class TimedShortSeq(Timed[tuple[Short, ...]]):
    """A sequence of short, with its time."""


class TimedLongSeq(Timed[tuple[Long, ...]]):
    """A sequence of long, with its time."""


class TimedUShortSeq(Timed[tuple[UShort, ...]]):
    """A sequence of unsigned short, with its time."""


class TimedULongSeq(Timed[tuple[ULong, ...]]):
    """A sequence of unsigned long, with its time."""


class TimedFloatSeq(Timed[tuple[Float, ...]]):
    """A sequence of float, with its time."""


class TimedDoubleSeq(Timed[tuple[Double, ...]]):
    """A sequence of double, with its time."""


class TimedCharSeq(Timed[tuple[Char, ...]]):
    """A sequence of char, with its time."""


class TimedWCharSeq(Timed[tuple[WChar, ...]]):
    """A sequence of wchar, with its time."""


class TimedBooleanSeq(Timed[tuple[Boolean, ...]]):
    """A sequence of boolean, with its time."""


class TimedOctetSeq(Timed[OctetSeq]):
    """A sequence of octet, with its time."""


class TimedStringSeq(Timed[tuple[String, ...]]):
    """A sequence of string, with its time."""


class TimedWStringSeq(Timed[tuple[WString, ...]]):
    """A sequence of wstring, with its time."""
