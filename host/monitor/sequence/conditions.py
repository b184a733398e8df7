"""What a sequence waits for: frames by a pattern, or decoded frames by a filter.

>>> from tickrig.wire.can import CanFrame
>>> frames = map(CanFrame.parse, ("585#6041", "585#60F1AA", "585#6042"))
>>> [parse_pattern("585#60?1*").matches(Record(0, "can0", frame)) for frame in frames]
[True, True, False]
"""

from __future__ import annotations

import re
from typing import Final

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.filter import parse_filter
from tickrig.host.monitor.frames.record import Record
from tickrig.host.text.steps import Condition

_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f?]{3}|[0-9A-Fa-f?]{8})#(R[0-8]?|(?:[0-9A-Fa-f?]{2}\.?){0,8}\*?)"
)


FrameCondition = Condition[Record]


def parse_pattern(text: str) -> FrameCondition:
    """Read a frame in candump notation, with `?` for any hex digit and `*` for any more bytes.

    Raises:
        ValueError: it is none.
    """
    match = _NOTATION.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"{text!r} is not a frame like 705#05, 585#60??????* or 705#R")
    can_id, data = (part.upper().replace(".", "") for part in match.groups())
    body = data.replace("?", "[0-9A-F]").replace("*", "[0-9A-F]*")
    regex = re.compile(f"{can_id.replace('?', '[0-9A-F]')}#{body}")
    return Condition(text, lambda record: regex.fullmatch(str(record.frame)) is not None)


class DecodedCondition:
    """Keeps the latest frame with its meaning, for the conditions of a sequence."""

    def __init__(self) -> None:
        self._latest: tuple[Record, Decoded] | None = None

    def take(self, record: Record, decoded: Decoded) -> None:
        """Take a frame; conditions are asked about it next."""
        self._latest = record, decoded

    def condition(self, text: str) -> FrameCondition:
        """Return the condition of a filter expression; ValueError if it is none."""
        chosen = parse_filter(text)

        def matches(record: Record) -> bool:
            latest = self._latest
            return latest is not None and latest[0] is record and chosen.matches(*latest)

        return Condition(text, matches)
