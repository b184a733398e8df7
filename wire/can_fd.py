"""CAN FD frames, their candump notation, and how long they are on the bus.

>>> frame = FdFrame.parse("123##1" + "AA" * 9)
>>> frame.brs, len(frame.data), frame.dlc, str(frame)
(True, 12, 9, '123##1AAAAAAAAAAAAAAAAAA000000')
>>> fd_bits(FdFrame.parse("123##1AABB")), fd_bits(FdFrame.parse("123##0AABB"))
(FdBits(nominal=30, fast=48), FdBits(nominal=79, fast=0))
"""

from __future__ import annotations

import re
from bisect import bisect_left
from functools import lru_cache
from typing import Final, NamedTuple

from tickrig.wire.can import EXTENDED_MAX, STANDARD_MAX, CanFrame
from tickrig.wire.can_bits import INTERFRAME_BITS, NEXT, STUFFED
from tickrig.wire.errors import FieldError, FramingError

MAX_FD_BYTES: Final = 64
FD_LENGTHS: Final = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Bytes that a frame can have, by data length code (ISO 11898-1)."""

BRS: Final = 0x1
ESI: Final = 0x2
"""Flags of a frame (linux/can.h, CANFD_BRS and CANFD_ESI)."""

_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})##([0-9A-Fa-f])((?:[0-9A-Fa-f]{2}\.?)*)"
)


class FdFrame(NamedTuple):
    """A CAN FD frame; it is always a data frame. Not checked, see `checked`.

    Attributes:
        can_id: 0x000..0x7FF, extended 0x0000_0000..0x1FFF_FFFF.
        data: payload, one of `FD_LENGTHS` bytes.
        extended: a 29-bit identifier.
        flags: `BRS` and `ESI`.
    """

    can_id: int
    data: bytes = b""
    extended: bool = False
    flags: int = 0

    @property
    def brs(self) -> bool:
        """Its data are sent at the data bit rate (bit rate switch)."""
        return bool(self.flags & BRS)

    @property
    def esi(self) -> bool:
        """Its sender was error passive (error state indicator)."""
        return bool(self.flags & ESI)

    @property
    def remote(self) -> bool:
        """No: CAN FD has no remote frames."""
        return False

    @property
    def dlc(self) -> int:
        """The data length code, 0 to 15."""
        return bisect_left(FD_LENGTHS, len(self.data))

    @classmethod
    def parse(cls, text: str) -> FdFrame:
        """Read candump's compact notation.

        Args:
            text: `ID##FDATA`: F is one hex digit, 1 BRS and 2 ESI; other flags are passed over.
                An ID of 8 digits is a 29-bit one. Data are filled up as `checked` says.

        Returns:
            The frame.

        Raises:
            FramingError: not a frame in this notation.
            FieldError: an identifier or length that CAN FD does not have.
        """
        match = _NOTATION.fullmatch(text.strip())
        if match is None:
            raise FramingError(f"{text!r} is not a CAN FD frame like 123##1AABB")
        can_id, flags, data = match.groups()
        frame = cls(
            int(can_id, 16),
            bytes.fromhex(data.replace(".", "")),
            len(can_id) == 8,
            int(flags, 16) & (BRS | ESI),
        )
        return frame.checked()

    def checked(self) -> FdFrame:
        """Check the frame.

        Returns:
            The frame; data of a length that CAN FD does not have are filled up with zeros to the
            next one, as a controller sends them.

        Raises:
            FieldError: it cannot be on a CAN FD bus.
        """
        most = EXTENDED_MAX if self.extended else STANDARD_MAX
        if not 0 <= self.can_id <= most:
            raise FieldError(f"CAN-ID 0x{self.can_id:X} is not {29 if self.extended else 11}-bit")
        if len(self.data) > MAX_FD_BYTES:
            raise FieldError(f"a CAN FD frame of {len(self.data)} bytes, at most 64 fit")
        length = FD_LENGTHS[self.dlc]
        if length == len(self.data):
            return self
        return self._replace(data=self.data.ljust(length, b"\0"))

    def __str__(self) -> str:
        """Write candump's compact notation."""
        can_id = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        return f"{can_id}##{self.flags:X}{self.data.hex().upper()}"


class FdBits(NamedTuple):
    """The length of a frame on the bus.

    The rate is taken to switch behind the bit BRS and before the CRC delimiter; it does at the
    sample points of these two, which differ from bus to bus.

    Attributes:
        nominal: bits at the nominal bit rate, with the interframe space.
        fast: bits at the data bit rate; none in a frame without BRS.
    """

    nominal: int
    fast: int


_CRC_FIELD: Final = {False: 4 + 17 + 6, True: 4 + 21 + 7}
"""Stuff count, CRC and fixed stuff bits: of no more than 16 bytes, and of more."""

_TAIL: Final = 1 + 2 + 7 + INTERFRAME_BITS  # CRC delimiter, ACK, end of frame
_KEPT: Final = 1_024


def fd_bits(frame: FdFrame) -> FdBits:
    """Return the bits of a frame with stuff bits and interframe space (ISO 11898-1).

    From start of frame to the data bits are stuffed as in classic CAN. The CRC field has stuff
    bits at fixed places; the first of them stands for one that the last data would want.
    """
    data, length = frame.data, frame.dlc
    nominal, fast, state = _head(frame.can_id, frame.extended, frame.flags, length)
    for byte in data:
        place = state << 8 | byte
        fast += STUFFED[place]
        state = NEXT[place] >> 8
    fast -= state >> 2 != (data[-1] if data else length) & 1  # the last bit was a stuff bit
    fast += 8 * len(data) + _CRC_FIELD[len(data) > 16]
    return FdBits(nominal, fast) if frame.flags & BRS else FdBits(nominal + fast, 0)


@lru_cache(_KEPT)
def _head(can_id: int, extended: bool, flags: int, dlc: int) -> tuple[int, int, int]:
    """Return the bits at each rate but those of data and CRC, and the state before the data."""
    brs, esi = flags & BRS, flags >> 1 & 1
    if extended:
        stream = f"0{can_id >> 18:011b}11{can_id & 0x3_FFFF:018b}010{brs}"
    else:
        stream = f"0{can_id:011b}0010{brs}"
    last, run, slow = _stuff(1, 0, stream)
    last, run, stuffed = _stuff(last, run, f"{esi}{dlc:04b}")
    return len(stream) + slow + _TAIL, 5 + stuffed, last << 2 | run - 1


def _stuff(last: int, run: int, stream: str) -> tuple[int, int, int]:
    """Return value and run of the last bit, and how many bits were stuffed."""
    stuffed = 0
    for bit in map(int, stream):
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            last, run, stuffed = 1 - bit, 1, stuffed + 1
    return last, run, stuffed


def parse_sent(text: str) -> CanFrame | FdFrame:
    """Read a frame in candump's compact notation, of CAN FD where it has `##`.

    Raises:
        FramingError: not a frame in this notation.
        FieldError: an identifier or length that there is not.
    """
    return FdFrame.parse(text) if "##" in text else CanFrame.parse(text)
