"""Filters as candump takes them behind the name of a bus.

>>> chosen = CandumpFilter.parse("123:7FF,400~700,#FF")
>>> [chosen.passes(ident) for ident in (0x123, 0x400, 0x501, ERROR_FLAG | 0x20, ERROR_FLAG | 0x100)]
[True, False, True, True, False]
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from tickrig.host.monitor.frames.ident import EXTENDED, ident_of
from tickrig.host.monitor.frames.record import Record
from tickrig.wire.can_error import ERROR_FLAG, ErrorFrame

_RULE: Final = re.compile(r"([0-9A-Fa-f]{1,8})([:~])([0-9A-Fa-f]{1,8})")
_ERRORS: Final = re.compile(r"#([0-9A-Fa-f]{1,8})")


def flagged_id(record: Record) -> int:
    """Return the identifier with its flags, as struct can_frame has it (linux/can.h)."""
    frame = record.frame
    if isinstance(frame, ErrorFrame):
        return ERROR_FLAG | frame.error_class
    return ident_of(frame)


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
