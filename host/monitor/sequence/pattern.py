"""Which frames an expectation means: `585#60??????*`.

>>> pattern = parse_pattern("585#60?1*")
>>> [pattern.fits(CanFrame.parse(text)) for text in ("585#6041", "585#60F1AA", "585#6042")]
[True, True, False]
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

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
