"""TIME stamp object: milliseconds since midnight and days since 1984 (CiA 301, TIME_OF_DAY).

>>> TimeOfDay.parse(bytes.fromhex("B0A429043143"))
TimeOfDay(ms=69838000, days=17201)
>>> TimeOfDay(69838000, 17201).encode().hex().upper()
'B0A429043143'
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

from tickrig.wire.errors import FieldError, FramingError

DAY_MS: Final = 86_400_000
MAX_DAYS: Final = 0xFFFF

_LAYOUT: Final = struct.Struct("<IH")
_MS_MASK: Final = 0x0FFF_FFFF
"""The upper four bits are reserved."""


class TimeOfDay(NamedTuple):
    """Absolute time.

    Attributes:
        ms: milliseconds after midnight, 0 to 86 399 999.
        days: days since 1 January 1984, 0 to 65 535.
    """

    ms: int
    days: int

    @classmethod
    def parse(cls, data: bytes) -> TimeOfDay:
        """Read a TIME stamp; FramingError if it has not 6 bytes, FieldError if it is no time."""
        if len(data) != _LAYOUT.size:
            raise FramingError(f"a TIME stamp of {len(data)} bytes, it has {_LAYOUT.size}")
        ms, days = _LAYOUT.unpack(data)
        return cls(ms & _MS_MASK, days).checked()

    def checked(self) -> TimeOfDay:
        """Return the time; FieldError if there is no such time."""
        if not 0 <= self.ms < DAY_MS:
            raise FieldError(f"{self.ms} ms after midnight, a day has {DAY_MS}")
        if not 0 <= self.days <= MAX_DAYS:
            raise FieldError(f"{self.days} days, 0 to {MAX_DAYS} fit")
        return self

    def encode(self) -> bytes:
        """Return the six bytes; FieldError if there is no such time."""
        return _LAYOUT.pack(*self.checked())

    def after(self, elapsed_us: int) -> TimeOfDay:
        """Return the time so many microseconds later; the days begin anew after 65 535.

        >>> TimeOfDay(DAY_MS - 1, 7).after(1_500)
        TimeOfDay(ms=0, days=8)
        """
        days, ms = divmod(self.ms + elapsed_us // 1_000, DAY_MS)
        return TimeOfDay(ms, (self.days + days) & MAX_DAYS)
