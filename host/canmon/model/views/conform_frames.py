"""The frames of a conformance check, and what they mean: lines as `canmon dump` shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, read_eds_objects
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canopen.conform.bus.evidence import LEFT_OUT
from tickrig.host.canopen.conform.report.evidence import ShowFrames, frame_of, plain_frame
from tickrig.host.canopen.conform.verdict import Direction, Line


def decoded_frames(eds: Mapping[int, Path | EdsObjects]) -> ShowFrames:
    """Return what writes the lines of a check; each call begins anew, knowing only the EDS.

    Between two checks there are frames that no evidence has: what was open or mapped in one
    says nothing of the next.

    Args:
        eds: an EDS, or what was read of one, by node-ID.

    Raises:
        OSError: an EDS cannot be read.
        EdsError: an EDS is malformed.
    """
    known = {
        node: read_eds_objects(item, node) if isinstance(item, Path) else item
        for node, item in eds.items()
    }

    def show(lines: Sequence[Line]) -> list[str]:
        shown, decoder = list[str](), Decoder(known)
        for line in lines:
            if line.direction is Direction.REMARK and line.text.endswith(LEFT_OUT):
                decoder = Decoder(known)
            shown.append(plain_frame(line, _meaning(decoder, line)))
        return shown

    return show


def _meaning(decoder: Decoder, line: Line) -> str:
    frame = None if line.direction is Direction.REMARK else frame_of(line)
    if frame is None:
        return ""
    record = Record(line.at_us, "", frame, sent=line.direction is Direction.SENT)
    return decoder.take(record).text
