"""Conditions on the latest frame, by filter expressions."""

from __future__ import annotations

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.filter.filter import parse_filter
from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.sequence.steps import Condition


class HeardCondition:
    """Keeps the latest frame with its meaning, for the conditions of a sequence."""

    def __init__(self) -> None:
        self._latest: tuple[Heard, Decoded] | None = None

    def take(self, heard: Heard, decoded: Decoded) -> None:
        """Take a frame; conditions are asked about it next."""
        self._latest = heard, decoded

    def condition(self, text: str) -> Condition:
        """Return the condition of a filter expression; ValueError if it is none."""
        chosen = parse_filter(text)

        def matches(heard: Heard) -> bool:
            latest = self._latest
            return latest is not None and latest[0] is heard and chosen.matches(*latest)

        return Condition(text, matches)
