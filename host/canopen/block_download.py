"""SDO block download as a script (CiA 301, SDO block download)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NoReturn, TypeVar

from tickrig.host.canopen.dialogue import Script, SdoFrame, SdoRequest
from tickrig.host.canopen.errors import SdoAborted
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import Abort
from tickrig.wire.canopen.sdo.sdo_block import (
    BlockAcknowledge,
    BlockDownloadInitiateRequest,
    BlockDownloadInitiateResponse,
    BlockEnd,
    BlockEnded,
    BlockSegment,
    crc16,
)
from tickrig.wire.canopen.sdo.sdo_command import MAX_BLOCK_SIZE, SEGMENT_BYTES

MOST_IDLE: Final = 20
"""So many blocks in a row of which nothing came through end the transfer."""

Answer = TypeVar("Answer")

OnProgress = Callable[[int], object]
"""Called with the number of bytes that the server has acknowledged."""


def download_blocks(index: int, sub: int, data: bytes, on_progress: OnProgress) -> Script[None]:
    """Write an object in blocks, with CRC if the server can.

    What is lost within a block is sent again from there on. If the last segment of a block or
    its acknowledgement is lost, CiA 301 has no way to go on: the transfer times out.

    Args:
        index: of the object.
        sub: its sub-index.
        data: what is written.
        on_progress: is told how far it is.

    Raises:
        SdoAborted: the server refuses, or answers something else; `COMMAND_SPECIFIER` from
            one that does no block transfer.
        SdoTimeout: it does not answer.
    """
    request = BlockDownloadInitiateRequest(index, sub, crc=True, size=len(data)).encode()
    first = SdoRequest(request, index, sub)
    begun = yield from _request(first, BlockDownloadInitiateResponse)
    block_size, total, taken, idle = begun.block_size, max(1, -(-len(data) // SEGMENT_BYTES)), 0, 0
    while taken < total:
        if not 1 <= block_size <= MAX_BLOCK_SIZE:
            yield from _abort(index, sub, AbortCode.BLOCK_SIZE)
        count = min(block_size, total - taken)
        receipt = yield from _send_block(index, sub, data, taken, count)
        idle = 0 if receipt.ackseq else idle + 1
        if receipt.ackseq > count or idle == MOST_IDLE:
            yield from _abort(index, sub, AbortCode.SEQUENCE_NUMBER)
        taken, block_size = taken + receipt.ackseq, receipt.block_size
        on_progress(min(taken * SEGMENT_BYTES, len(data)))
    end = BlockEnd(total * SEGMENT_BYTES - len(data), crc16(data) if begun.crc else 0)
    yield from _request(SdoRequest(end.encode(), index, sub, goes_on=True), BlockEnded)


def _send_block(
    index: int, sub: int, data: bytes, first: int, count: int
) -> Script[BlockAcknowledge]:
    """Send segments; return the receipt of the last of them."""
    at = first * SEGMENT_BYTES
    for seqno in range(1, count):
        yield SdoFrame(bytes((seqno,)) + data[at : at + SEGMENT_BYTES])
        at += SEGMENT_BYTES
    last = BlockSegment(count, data[at : at + SEGMENT_BYTES], at + SEGMENT_BYTES >= len(data))
    request = SdoRequest(last.encode(), index, sub, goes_on=True)
    return (yield from _request(request, BlockAcknowledge))


def _request(request: SdoRequest, kind: type[Answer]) -> Script[Answer]:
    """Send, and return the answer; what is no such answer ends the transfer."""
    answer = yield request
    if isinstance(answer, kind):
        return answer
    if isinstance(answer, Abort):
        raise SdoAborted(request.index, request.sub, answer.code)
    return (yield from _abort(request.index, request.sub, AbortCode.COMMAND_SPECIFIER))


def _abort(index: int, sub: int, code: AbortCode) -> Script[NoReturn]:
    """End the transfer: the server has said what it may not."""
    yield SdoFrame(Abort(index, sub, code).encode())
    raise SdoAborted(index, sub, code)
