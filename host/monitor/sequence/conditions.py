"""What a sequence waits for: frames by a pattern, or decoded frames by a filter.

>>> pattern = parse_pattern("585#60?1*")
>>> [pattern.fits(CanFrame.parse(text)) for text in ("585#6041", "585#60F1AA", "585#6042")]
[True, True, False]
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.filter import parse_filter
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.sequence.steps import Condition
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame

_NOTATION: Final = re.compile(
    r"([0-9A-Fa-f?]{3}|[0-9A-Fa-f?]{8})#(R[0-8]?|(?:[0-9A-Fa-f?]{2}\.?){0,8}\*?)"
)


@dataclass(frozen=True, slots=True)
class FramePattern:
    """A frame in candump notation, with `?` for any hex digit and `*` for any more bytes.

    Attributes:
        text: as it was written.
        regex: what the notation of a frame must be.
    """

    text: str
    regex: re.Pattern[str]

    def fits(self, frame: CanFrame | ErrorFrame) -> bool:
        """Say whether a frame is meant."""
        return self.regex.fullmatch(str(frame)) is not None


def parse_pattern(text: str) -> FramePattern:
    """Read a pattern; ValueError if it is none."""
    match = _NOTATION.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"{text!r} is not a frame like 705#05, 585#60??????* or 705#R")
    can_id, data = (part.upper().replace(".", "") for part in match.groups())
    body = data.replace("?", "[0-9A-F]").replace("*", "[0-9A-F]*")
    regex = re.compile(f"{can_id.replace('?', '[0-9A-F]')}#{body}")
    return FramePattern(text.strip(), regex)


class DecodedCondition:
    """Keeps the latest frame with its meaning, for the conditions of a sequence."""

    def __init__(self) -> None:
        self._latest: tuple[Record, Decoded] | None = None

    def take(self, record: Record, decoded: Decoded) -> None:
        """Take a frame; conditions are asked about it next."""
        self._latest = record, decoded

    def condition(self, text: str) -> Condition:
        """Return the condition of a filter expression; ValueError if it is none."""
        chosen = parse_filter(text)

        def matches(record: Record) -> bool:
            latest = self._latest
            return latest is not None and latest[0] is record and chosen.matches(*latest)

        return Condition(text, matches)
