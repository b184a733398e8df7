"""The frames of a conformance check, and what they mean: lines as `canmon dump` shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from tickrig.host.canopen.conform.report.evidence import ShowFrames, frame_of, plain_frame
from tickrig.host.canopen.conform.verdict import Direction, Line
from tickrig.host.monitor.decode.decoder import Decoder
from tickrig.host.monitor.decode.node_memory import EdsObjects
from tickrig.host.monitor.frames.record import Record


def decoded_frames(eds: Mapping[int, Path | EdsObjects]) -> ShowFrames:
    """Return what writes the lines of checks, in their order.

    Args:
        eds: an EDS, or what was read of one, by node-ID.
    """
    decoder = Decoder(eds)

    def show(lines: Sequence[Line]) -> list[str]:
        return [plain_frame(line, _meaning(decoder, line)) for line in lines]

    return show


def _meaning(decoder: Decoder, line: Line) -> str:
    frame = None if line.direction is Direction.REMARK else frame_of(line)
    if frame is None:
        return ""
    record = Record(line.at_us, "", frame, sent=line.direction is Direction.SENT)
    return decoder.take(record).text
