"""Blocks of an SDO block transfer, as a third party hears them."""

from __future__ import annotations

from typing import Final

from tickrig.host.monitor.decode.sdo.sdo_open import OpenTransfer, Phase
from tickrig.host.monitor.decode.sdo.transfer import Direction
from tickrig.wire.canopen.sdo.sdo import Request, Response
from tickrig.wire.canopen.sdo.sdo_block import (
    BlockAcknowledge,
    BlockDownloadInitiateResponse,
    BlockEnd,
    BlockEnded,
    BlockSegment,
    BlockStart,
    BlockUploadInitiateResponse,
)
from tickrig.wire.canopen.sdo.sdo_command import BLOCK_END, BLOCK_SEQNO, FRAME_BYTES

ORPHAN: Final = "of a block transfer whose beginning was not heard"

_END_MASK: Final = 0xE3


def is_block_segment(running: OpenTransfer, sender: Direction, data: bytes) -> bool:
    """Tell a segment of a block from anything else: only the state can."""
    if running.phase is not Phase.BLOCK or running.direction is not sender:
        return False
    if len(data) != FRAME_BYTES or not data[0] & BLOCK_SEQNO:
        return False  # 80h, an abort: no segment has the number 0
    return running.block_last is None or data[0] & _END_MASK != BLOCK_END


def take_block_segment(running: OpenTransfer, data: bytes) -> str:
    """Keep a segment until its receipt."""
    segment = BlockSegment.parse(data)
    running.take_block_segment(segment)
    return f"segment {segment.seqno} of a block"


def take_block_frame(running: OpenTransfer, message: Request | Response) -> str:
    """Take any other frame of a block transfer."""
    upload = running.direction is Direction.UPLOAD
    match message, running.phase:
        case ((BlockDownloadInitiateResponse() | BlockUploadInitiateResponse()), Phase.ASKED):
            return _answer(running, message)
        case BlockStart(), Phase.BLOCK_READY:
            running.phase = Phase.BLOCK
            return "start of a block upload"
        case BlockAcknowledge(ackseq=ackseq), Phase.BLOCK:
            running.acknowledge_block(ackseq)
            return f"segments to {ackseq} confirmed, {running.progress}"
        case BlockEnd(), (Phase.BLOCK | Phase.BLOCK_ENDING):
            return _end(running, message)
        case BlockEnded(), Phase.BLOCK_ENDED:
            running.done = True
            return "end of a block upload confirmed" if upload else "block download confirmed"
        case _:
            return ORPHAN


def _answer(
    running: OpenTransfer, answer: BlockDownloadInitiateResponse | BlockUploadInitiateResponse
) -> str:
    running.crc = running.crc and answer.crc
    if isinstance(answer, BlockUploadInitiateResponse):
        running.size = answer.size
        running.phase = Phase.BLOCK_READY
        return f"block upload of {'unknown size' if answer.size is None else f'{answer.size} B'}"
    running.phase = Phase.BLOCK
    return f"ready for blocks of {answer.block_size} segments"


def _end(running: OpenTransfer, end: BlockEnd) -> str:
    if running.phase is Phase.BLOCK:
        running.add_flaw("a receipt was not heard")
    running.end_block(end)
    return f"end of the blocks, {running.progress}"
