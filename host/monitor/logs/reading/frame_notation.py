"""A frame in candump's compact notation, as candump and others write it.

>>> str(parse_frame("123#0011223344556677_C")), str(parse_frame("20000080#01"))
('123#0011223344556677', '20000080#0100000000000000')
"""

from __future__ import annotations

import re
from typing import Final

from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ErrorFrame

_CODED: Final = re.compile(r"(.+#(?:[0-9A-Fa-f]{16}|R8))_[9A-Fa-f]")
_ERROR: Final = re.compile(r"([23][0-9A-Fa-f]{7})#((?:[0-9A-Fa-f]{2}){0,8})")


def parse_frame(notation: str) -> CanFrame | ErrorFrame:
    """Read a frame; WireError if that is none.

    The raw length code behind eight bytes is passed over; an error frame may have less
    than eight bytes.
    """
    if error := _ERROR.fullmatch(notation):
        data = bytes.fromhex(error[2]).ljust(8, b"\0")
        return ErrorFrame(int(error[1], 16) & ERROR_CLASS_MASK, data)
    coded = _CODED.fullmatch(notation)
    return CanFrame.parse(coded[1] if coded else notation)
