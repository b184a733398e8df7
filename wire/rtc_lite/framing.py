"""What goes over the line."""

from __future__ import annotations

from enum import StrEnum


class Framing(StrEnum):
    """Frames, or the packets of a relative."""

    LITE = "lite"  # the frames of RTC-Lite
    RTNO = "rtno"  # bridge mode: packets of RTno
