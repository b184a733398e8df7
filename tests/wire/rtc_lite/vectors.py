"""The golden vectors of RTC-Lite, and frames as they are written there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

VECTORS: Final[dict[str, list[dict[str, Any]]]] = json.loads(
    (Path(__file__).parents[2] / "golden" / "rtc_lite.json").read_text("utf-8")
)


def raw(*frames: str) -> bytes:
    """Read frames written in hex."""
    return b"".join(bytes.fromhex(frame) for frame in frames)


REQUESTS: Final = [
    raw(step["proxy"])
    for dialogue in VECTORS["dialogues"]
    if dialogue["id"] not in {"L09", "L11", "L12"}  # these are no requests
    for step in dialogue["steps"]
] + [raw(row["frame"]) for row in VECTORS["marshalling"]]
REPLIES: Final = [
    raw(frame)
    for dialogue in VECTORS["dialogues"]
    for step in dialogue["steps"]
    for frame in step["device"]
]
