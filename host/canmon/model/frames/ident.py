"""One number for each kind of frame, the CAN-ID with flags above it, and candump's filters of it.

>>> chosen = CandumpFilter.parse("123:7FF,400~700,#FF")
>>> [chosen.passes(ident) for ident in (0x123, 0x400, 0x501, ERROR_FLAG | 0x20, ERROR_FLAG | 0x100)]
[True, False, True, True, False]
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from tickrig.host.canmon.model.frames.record import Record
from tickrig.wire.can import EXTENDED_MAX, CanFrame
from tickrig.wire.can_error import ERROR_FLAG, ErrorFrame
from tickrig.wire.can_fd import FdFrame

EXTENDED: Final = 1 << 31
REMOTE: Final = 1 << 30
ERROR: Final = 1 << 29
FD: Final = 1 << 33
"""Above what an identifier with flags of struct can_frame takes."""


def ident_of(frame: CanFrame) -> int:
    """Return the CAN-ID with a bit each for an extended and for a remote frame.

    >>> hex(ident_of(CanFrame.parse("00000605#R")))
    '0xc0000605'
    """
    return frame.can_id | frame.extended << 31 | frame.remote << 30


def fd_ident(frame: FdFrame) -> int:
    """Return the CAN-ID with a bit each for an extended and for a CAN FD frame.

    >>> hex(fd_ident(FdFrame.parse("00000605##1")))
    '0x280000605'
    """
    return frame.can_id | frame.extended << 31 | FD


def any_ident(frame: CanFrame | FdFrame) -> int:
    """Return the CAN-ID with its flags."""
    return fd_ident(frame) if isinstance(frame, FdFrame) else ident_of(frame)


def ident_text(ident: int) -> str:
    """Write it as candump does, with an R for remote frames and a # for those of CAN FD.

    >>> ident_text(0x181), ident_text(0xC000_0605), ident_text(FD | 0x181)
    ('181', '00000605R', '181#')
    """
    can_id, mark = ident & EXTENDED_MAX, "R" if ident & REMOTE else "#" if ident & FD else ""
    return (f"{can_id:08X}" if ident & EXTENDED else f"{can_id:03X}") + mark


def parse_ident(text: str) -> int:
    """Read what `ident_text` writes: 3 digits for 11-bit identifiers, 8 for 29-bit ones.

    Raises:
        ValueError: not an identifier.

    >>> parse_ident("181"), parse_ident("181R") == 0x181 | REMOTE, parse_ident("181#") == 0x181 | FD
    (385, True, True)
    """
    digits = text.removesuffix("R") if text.endswith("R") else text.removesuffix("#")
    most = {3: 0x7FF, 8: EXTENDED_MAX}.get(len(digits))
    if most is None or not set(digits) <= set("0123456789abcdefABCDEF") or int(digits, 16) > most:
        raise ValueError(f"{text!r} is not a CAN-ID: write 3 or 8 hex digits, as 181 or 00000605")
    flags = EXTENDED * (len(digits) == 8) | REMOTE * text.endswith("R") | FD * text.endswith("#")
    return int(digits, 16) | flags


NODE_BITS: Final = 7
NODE_MASK: Final = 0x7F

FUNCTIONS: Final = frozenset([1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14])
"""Function codes that go with a node-ID: EMCY, PDO1 to PDO4, SDO, error control."""

SENDING: Final = frozenset([1, 3, 5, 7, 9, 11, 14])
"""Those of them that the node itself sends with: EMCY, TPDO1 to TPDO4, SDO, error control."""


def node_of(ident: int) -> int | None:
    """Return the node-ID; None where the identifier has none by default.

    A COB-ID that was configured may belong to another node.

    >>> node_of(0x181), node_of(0x701), node_of(0x080), node_of(0x7E5)
    (1, 1, None, None)
    """
    can_id = ident & ~REMOTE
    node = can_id & NODE_MASK
    return node if node and can_id >> NODE_BITS in FUNCTIONS else None


def sender_of(ident: int) -> int | None:
    """Return the node-ID that sends with an identifier; None where others do, or nobody by default.

    >>> sender_of(0x181), sender_of(0x581), sender_of(0x201), sender_of(0x701 | REMOTE)
    (1, 1, None, None)
    """
    node = ident & NODE_MASK
    return node if node and ident >> NODE_BITS in SENDING else None


_RULE: Final = re.compile(r"([0-9A-Fa-f]{1,8})([:~])([0-9A-Fa-f]{1,8})")
_ERRORS: Final = re.compile(r"#([0-9A-Fa-f]{1,8})")


def flagged_id(record: Record) -> int:
    """Return the identifier with its flags, as struct can_frame has it (linux/can.h)."""
    frame = record.frame
    if isinstance(frame, ErrorFrame):
        return ERROR_FLAG | frame.error_class
    return any_ident(frame) & ~FD


@dataclass(frozen=True, slots=True)
class CandumpFilter:
    """Which frames are wanted.

    As in candump, frames pass if one rule holds, with `j` among the words if all
    do; without a rule all frames pass. Error frames pass by `#MASK` alone.

    Attributes:
        rules: identifier, mask, and whether the rule is inverse.
        error_mask: classes of error frames that are wanted.
        joined: all rules must hold.
    """

    rules: tuple[tuple[int, int, bool], ...] = ()
    error_mask: int = 0
    joined: bool = False

    @classmethod
    def parse(cls, text: str) -> CandumpFilter:
        """Read the words behind a bus; ValueError if one is no filter."""
        rules, error_mask, joined = [], 0, False
        for word in text.split(","):
            if rule := _RULE.fullmatch(word):
                flag = EXTENDED if len(rule[1]) == 8 else 0
                mask = int(rule[3], 16) & ~ERROR_FLAG
                rules.append((int(rule[1], 16) | flag, mask, rule[2] == "~"))
            elif errors := _ERRORS.fullmatch(word):
                error_mask = int(errors[1], 16)
            elif word in ("j", "J"):
                joined = True
            else:
                raise ValueError(f"{word!r} is no filter like 123:7FF, 400~700 or #FF")
        return cls(tuple(rules), error_mask, joined)

    def passes(self, flagged: int) -> bool:
        """Say whether a frame is wanted, by its identifier with flags."""
        if flagged & ERROR_FLAG and not flagged & EXTENDED:
            return bool(flagged & self.error_mask & ~ERROR_FLAG)
        held = ((flagged & mask == ident & mask) != inverse for ident, mask, inverse in self.rules)
        return not self.rules or (all(held) if self.joined else any(held))
