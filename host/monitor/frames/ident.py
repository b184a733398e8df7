"""One number for each kind of frame: the CAN-ID with flags above it."""

from __future__ import annotations

from typing import Final

from tickrig.wire.can import EXTENDED_MAX, CanFrame

EXTENDED: Final = 1 << 31
REMOTE: Final = 1 << 30
ERROR: Final = 1 << 29


def ident_of(frame: CanFrame) -> int:
    """Return the CAN-ID with a bit each for an extended and for a remote frame.

    >>> hex(ident_of(CanFrame.parse("00000605#R")))
    '0xc0000605'
    """
    return frame.can_id | frame.extended << 31 | frame.remote << 30


def ident_text(ident: int) -> str:
    """Write it as candump does, with an R for remote frames.

    >>> ident_text(0x181), ident_text(0xC000_0605)
    ('181', '00000605R')
    """
    can_id = ident & EXTENDED_MAX
    return (f"{can_id:08X}" if ident & EXTENDED else f"{can_id:03X}") + "R" * bool(ident & REMOTE)


def parse_ident(text: str) -> int:
    """Read what `ident_text` writes: 3 digits for 11-bit identifiers, 8 for 29-bit ones.

    Raises:
        ValueError: not an identifier.

    >>> parse_ident("181"), parse_ident("181R") == 0x181 | REMOTE
    (385, True)
    """
    digits = text.removesuffix("R")
    most = {3: 0x7FF, 8: EXTENDED_MAX}.get(len(digits))
    if most is None or not set(digits) <= set("0123456789abcdefABCDEF") or int(digits, 16) > most:
        raise ValueError(f"{text!r} is not a CAN-ID: write 3 or 8 hex digits, as 181 or 00000605")
    flags = EXTENDED * (len(digits) == 8) | REMOTE * text.endswith("R")
    return int(digits, 16) | flags
