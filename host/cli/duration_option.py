"""Times that options take."""

from __future__ import annotations

from tickrig.host.cli.duration import parse_time_us
from tickrig.host.cli.refused import refused_at


def time_us(option: str, word: str) -> int:
    """Read the time of an option, as `--wait`, in microseconds; Refused if it is none."""
    with refused_at(option):
        return parse_time_us(word)
