"""Traces as text, and what a decoder makes of them."""

from __future__ import annotations

from collections.abc import Mapping

from tickrig.host.canmon.model.decode.decoded import Decoded, Transfer
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame

STEP_US = 1_000


def trace(text: str, channel: str = "can0") -> list[Record]:
    """Return frames of candump text, one a millisecond."""
    return [
        Record(number * STEP_US, channel, CanFrame.parse(word))
        for number, word in enumerate(text.split())
    ]


def decode(text: str, eds: Mapping[int, EdsObjects] | None = None) -> list[Decoded]:
    """Decode candump text."""
    decoder = Decoder(eds or {})
    return [decoder.take(record) for record in trace(text)]


def last(text: str, eds: Mapping[int, EdsObjects] | None = None) -> Decoded:
    """Return what the last frame says."""
    return decode(text, eds)[-1]


def transfers(text: str) -> list[Transfer]:
    """Return the SDO transfers in candump text."""
    return [transfer for decoded in decode(text) for transfer in decoded.transfers]
