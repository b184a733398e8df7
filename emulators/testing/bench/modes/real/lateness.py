"""How late a bench was: in real time a device can be judged only by one that keeps up."""

from __future__ import annotations

from typing import Final

LATE_US: Final = 5_000
"""Later than this the bench cannot be believed: half a period of the RRC."""


def too_slow(**late_us: int) -> str:
    """Say which parts of a bench were too late to judge a device; empty if none was.

    Args:
        late_us: of each part, in microseconds.

    >>> too_slow(host=1_000, emulator=57_400)
    'the machine was too slow: host up to 1 ms, emulator up to 57 ms late'
    """
    if max(late_us.values()) <= LATE_US:
        return ""
    times = ", ".join(f"{name} up to {us / 1_000:.0f} ms" for name, us in late_us.items())
    return f"the machine was too slow: {times} late"
