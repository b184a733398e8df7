"""Classic CAN frames and their candump notation.

>>> str(CanFrame.parse("705#7F")), str(CanFrame.parse("705#R1"))
('705#7F', '705#R1')
>>> CanFrame.parse("00000605#40").extended
True
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tickrig.wire.errors import FieldError, FramingError

MAX_DATA_BYTES: Final = 8
STANDARD_MAX: Final = 0x7FF
EXTENDED_MAX: Final = 0x1FFF_FFFF

_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?:(R)([0-8])?|((?:[0-9A-Fa-f]{2}\.?)*))"
)


class CanFrame(NamedTuple):
    """A data or remote frame. Not checked: it is made millions of times; see `checked`.

    Attributes:
        can_id: 0x000..0x7FF, extended 0x0000_0000..0x1FFF_FFFF.
        data: payload, 0 to 8 bytes; empty in a remote frame.
        remote: a remote frame (RTR).
        extended: a 29-bit identifier.
        remote_length: the DLC of a remote frame.
    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    remote_length: int = 0

    @property
    def dlc(self) -> int:
        """The data length code."""
        return self.remote_length if self.remote else len(self.data)

    @classmethod
    def parse(cls, text: str) -> CanFrame:
        """Read candump's compact notation.

        Args:
            text: `ID#DATA`, or `ID#R` with an optional length; an ID of 8 digits is a 29-bit one.

        Returns:
            The frame.

        Raises:
            FramingError: not a frame in this notation.
            FieldError: an identifier or length that CAN does not have.
        """
        match = _NOTATION.fullmatch(text.strip())
        if match is None:
            raise FramingError(f"{text!r} is not a frame like 705#7F, 705#R1 or 00000605#40")
        can_id, remote, length, data = match.groups()
        frame = cls(
            int(can_id, 16),
            bytes.fromhex((data or "").replace(".", "")),
            bool(remote),
            len(can_id) == 8,
            int(length or 0),
        )
        return frame.checked()

    def checked(self) -> CanFrame:
        """Check the frame.

        Returns:
            The frame itself.

        Raises:
            FieldError: it cannot be on a CAN bus.
        """
        most = EXTENDED_MAX if self.extended else STANDARD_MAX
        if not 0 <= self.can_id <= most:
            raise FieldError(f"CAN-ID 0x{self.can_id:X} is not {29 if self.extended else 11}-bit")
        if len(self.data) > MAX_DATA_BYTES or not 0 <= self.remote_length <= MAX_DATA_BYTES:
            raise FieldError(f"a frame of {self.dlc} bytes, at most 8 fit")
        if self.remote and self.data:
            raise FieldError("a remote frame carries no data")
        return self

    def __str__(self) -> str:
        """Write candump's compact notation."""
        can_id = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        if self.remote:
            return f"{can_id}#R{self.remote_length or ''}"
        return f"{can_id}#{self.data.hex().upper()}"


def data_frame(can_id: int, data: bytes) -> CanFrame:
    """Return `CanFrame(can_id, data)`, in a third of the time: 11-bit, not checked."""
    return _new(CanFrame, (can_id, data, False, False, 0))


_new: Final = tuple.__new__

Frames = tuple[CanFrame, ...]
"""The traffic of one tick on a CAN bus."""
