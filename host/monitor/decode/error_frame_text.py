"""Error frames, decoded (linux/can/error.h)."""

from __future__ import annotations

from typing import Final

from tickrig.host.monitor.decode.decoded import Decoded, Signal
from tickrig.wire.can_error import ErrorFrame

_CLASSES: Final = (
    "TX timeout",
    "lost arbitration",
    "controller",
    "protocol",
    "transceiver",
    "no acknowledge",
    "bus off",
    "bus error",
    "restarted",
)
_CONTROLLER: Final = (
    "RX overflow",
    "TX overflow",
    "RX warning",
    "TX warning",
    "RX passive",
    "TX passive",
    "active again",
)


def decode_error(frame: ErrorFrame) -> Decoded:
    """Decode what a controller says.

    >>> decode_error(ErrorFrame.parse("20000004#0020000000006080")).text
    'controller: TX passive'
    """
    words = [text for bit, text in enumerate(_CLASSES) if frame.error_class >> bit & 1]
    states = [text for bit, text in enumerate(_CONTROLLER) if frame.data[1] >> bit & 1]
    text = ", ".join(words) or f"class {frame.error_class:X}h"
    text += f": {', '.join(states)}" if states and "controller" in words else ""
    return Decoded("error", None, text, (Signal("class", frame.error_class),))
