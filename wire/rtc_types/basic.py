"""BasicDataType.idl of OpenRTM-aist 1.x: time stamps, and each IDL type with one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

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

_US: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class Time(Struct):
    """A time stamp in seconds and nanoseconds."""

    sec: ULong = 0
    nsec: ULong = 0

    @classmethod
    def from_us(cls, now_us: int) -> Time:
        """Return the time stamp of a time in microseconds."""
        return cls(now_us // _US, now_us % _US * 1_000)

    @property
    def us(self) -> int:
        """The time in microseconds, rounded down."""
        return self.sec * _US + self.nsec // 1_000


@dataclass(frozen=True, slots=True)
class TimedState(Struct):
    """A state (IDL: short), with its time."""

    tm: Time = Time()
    data: Short = 0


@dataclass(frozen=True, slots=True)
class TimedShort(Struct):
    """A short, with its time."""

    tm: Time = Time()
    data: Short = 0


@dataclass(frozen=True, slots=True)
class TimedLong(Struct):
    """A long, with its time."""

    tm: Time = Time()
    data: Long = 0


@dataclass(frozen=True, slots=True)
class TimedUShort(Struct):
    """An unsigned short, with its time."""

    tm: Time = Time()
    data: UShort = 0


@dataclass(frozen=True, slots=True)
class TimedULong(Struct):
    """An unsigned long, with its time."""

    tm: Time = Time()
    data: ULong = 0


@dataclass(frozen=True, slots=True)
class TimedFloat(Struct):
    """A float, with its time."""

    tm: Time = Time()
    data: Float = 0.0


@dataclass(frozen=True, slots=True)
class TimedDouble(Struct):
    """A double, with its time."""

    tm: Time = Time()
    data: Double = 0.0


@dataclass(frozen=True, slots=True)
class TimedChar(Struct):
    """A char, with its time."""

    tm: Time = Time()
    data: Char = "\0"


@dataclass(frozen=True, slots=True)
class TimedWChar(Struct):
    """A wchar, with its time."""

    tm: Time = Time()
    data: WChar = "\0"


@dataclass(frozen=True, slots=True)
class TimedBoolean(Struct):
    """A boolean, with its time."""

    tm: Time = Time()
    data: Boolean = False


@dataclass(frozen=True, slots=True)
class TimedOctet(Struct):
    """An octet, with its time."""

    tm: Time = Time()
    data: Octet = 0


@dataclass(frozen=True, slots=True)
class TimedString(Struct):
    """A string, with its time."""

    tm: Time = Time()
    data: String = ""


@dataclass(frozen=True, slots=True)
class TimedWString(Struct):
    """A wstring, with its time."""

    tm: Time = Time()
    data: WString = ""


@dataclass(frozen=True, slots=True)
class TimedShortSeq(Struct):
    """A sequence of short, with its time."""

    tm: Time = Time()
    data: tuple[Short, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedLongSeq(Struct):
    """A sequence of long, with its time."""

    tm: Time = Time()
    data: tuple[Long, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedUShortSeq(Struct):
    """A sequence of unsigned short, with its time."""

    tm: Time = Time()
    data: tuple[UShort, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedULongSeq(Struct):
    """A sequence of unsigned long, with its time."""

    tm: Time = Time()
    data: tuple[ULong, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedFloatSeq(Struct):
    """A sequence of float, with its time."""

    tm: Time = Time()
    data: tuple[Float, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedDoubleSeq(Struct):
    """A sequence of double, with its time."""

    tm: Time = Time()
    data: tuple[Double, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedCharSeq(Struct):
    """A sequence of char, with its time."""

    tm: Time = Time()
    data: tuple[Char, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedWCharSeq(Struct):
    """A sequence of wchar, with its time."""

    tm: Time = Time()
    data: tuple[WChar, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedBooleanSeq(Struct):
    """A sequence of boolean, with its time."""

    tm: Time = Time()
    data: tuple[Boolean, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedOctetSeq(Struct):
    """A sequence of octet, with its time."""

    tm: Time = Time()
    data: OctetSeq = b""


@dataclass(frozen=True, slots=True)
class TimedStringSeq(Struct):
    """A sequence of string, with its time."""

    tm: Time = Time()
    data: tuple[String, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedWStringSeq(Struct):
    """A sequence of wstring, with its time."""

    tm: Time = Time()
    data: tuple[WString, ...] = ()
