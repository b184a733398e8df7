"""Frames of SDO transfers, initiation, segments and blocks, as a third party hears them."""

from __future__ import annotations

from typing import Final

from tickrig.host.canmon.model.decode.sdo.sdo_open import OpenTransfer, Phase
from tickrig.host.canmon.model.decode.sdo.transfer import Direction, Mode
from tickrig.wire.canopen.sdo.sdo import (
    DownloadInitiateRequest,
    DownloadInitiateResponse,
    DownloadSegmentResponse,
    Request,
    Response,
    Segment,
    UploadInitiateRequest,
    UploadInitiateResponse,
    UploadSegmentRequest,
)
from tickrig.wire.canopen.sdo.sdo_block import (
    BlockAcknowledge,
    BlockDownloadInitiateRequest,
    BlockDownloadInitiateResponse,
    BlockEnd,
    BlockEnded,
    BlockSegment,
    BlockStart,
    BlockUploadInitiateRequest,
    BlockUploadInitiateResponse,
)
from tickrig.wire.canopen.sdo.sdo_command import BLOCK_END, BLOCK_SEQNO, FRAME_BYTES

Initiate = (
    UploadInitiateRequest
    | DownloadInitiateRequest
    | BlockUploadInitiateRequest
    | BlockDownloadInitiateRequest
)
Answer = UploadInitiateResponse | DownloadInitiateResponse


def begin(at_us: int, node: int, request: Initiate, data: bytes) -> OpenTransfer:
    """Open a transfer with the request that began it."""
    uploads = isinstance(request, UploadInitiateRequest | BlockUploadInitiateRequest)
    direction = Direction.UPLOAD if uploads else Direction.DOWNLOAD
    opened = OpenTransfer(at_us, node, direction, Mode.EXPEDITED, request.index, request.sub, data)
    match request:
        case DownloadInitiateRequest(data=None, size=size):
            opened.mode, opened.size = Mode.SEGMENTED, size
        case DownloadInitiateRequest(data=bytes(value), size=size):
            opened.data += value
            opened.sized = size is not None
        case BlockUploadInitiateRequest(crc=crc):
            opened.mode, opened.crc = Mode.BLOCK, crc
        case BlockDownloadInitiateRequest(crc=crc, size=size):
            opened.mode, opened.crc, opened.size = Mode.BLOCK, crc, size
    return opened


def answers(running: OpenTransfer, answer: Answer) -> bool:
    """Say whether this is the answer to the request; block upload may be switched to another."""
    upload = isinstance(answer, UploadInitiateResponse)
    return (
        running.phase is Phase.ASKED
        and running.entry == (answer.index, answer.sub)
        and running.direction is (Direction.UPLOAD if upload else Direction.DOWNLOAD)
        and (upload or running.mode is not Mode.BLOCK)
    )


def take_answer(running: OpenTransfer, answer: Answer) -> str:
    """Take the answer: the value itself, or leave for segments."""
    if isinstance(answer, DownloadInitiateResponse):
        running.done = running.mode is Mode.EXPEDITED and not running.partial
        running.phase = Phase.SEGMENTS
        return "ready for segments" if running.mode is Mode.SEGMENTED else "download confirmed"
    if answer.data is not None:
        running.mode, running.done = Mode.EXPEDITED, True
        running.data += answer.data
        running.sized = answer.size is not None
        return "upload"
    running.mode, running.phase, running.size = Mode.SEGMENTED, Phase.SEGMENTS, answer.size
    size = "their size is not told" if answer.size is None else running.progress
    return f"segments follow, {size}"


def unheard(at_us: int, node: int, answer: Answer) -> OpenTransfer:
    """Open a transfer whose request was not heard."""
    upload = isinstance(answer, UploadInitiateResponse)
    direction = Direction.UPLOAD if upload else Direction.DOWNLOAD
    opened = OpenTransfer(at_us, node, direction, Mode.SEGMENTED, answer.index, answer.sub)
    opened.partial = True
    return opened


def request_segment(running: OpenTransfer, request: UploadSegmentRequest) -> str:
    """Take what a client of an upload asks for."""
    running.retries += running.requested_toggle == request.toggle
    running.requested_toggle = request.toggle
    return f"asks for a segment, {running.progress} so far"


def take_segment(running: OpenTransfer, segment: Segment) -> str:
    """Take a segment of an upload, unless it was sent twice or a toggle bit is wrong."""
    if segment.toggle != running.requested_toggle or segment.toggle == running.taken:
        return "segment with the wrong toggle bit, or sent again"
    running.taken = segment.toggle
    running.data += segment.data
    running.done = segment.last
    return f"segment, {running.progress}"


def send_segment(running: OpenTransfer, segment: Segment) -> str:
    """Take a segment of a download; it counts when the server has confirmed it."""
    again = running.sent is not None and running.sent.toggle == segment.toggle
    running.retries += again or segment.toggle == running.taken
    running.sent = segment
    return f"segment of {len(segment.data)} B, {running.progress} so far"


def confirm_segment(running: OpenTransfer, response: DownloadSegmentResponse) -> str:
    """Take the receipt of a segment."""
    sent = running.sent
    if sent is None or sent.toggle != response.toggle or sent.toggle == running.taken:
        return "receipt of no segment that was heard, or of one sent again"
    running.taken, running.sent = sent.toggle, None
    running.data += sent.data
    running.done = sent.last
    return f"segment confirmed, {running.progress}"


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
        case BlockAcknowledge(ackseq=ackseq, block_size=block_size), Phase.BLOCK:
            running.acknowledge_block(ackseq)
            running.block_size = block_size
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
    running.phase, running.block_size = Phase.BLOCK, answer.block_size
    return f"ready for blocks of {answer.block_size} segments"


def _end(running: OpenTransfer, end: BlockEnd) -> str:
    if running.phase is Phase.BLOCK:
        running.add_flaw("a receipt was not heard")
    running.end_block(end)
    return f"end of the blocks, {running.progress}"
