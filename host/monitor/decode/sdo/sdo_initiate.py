"""How SDO transfers begin, as a third party hears it."""

from __future__ import annotations

from tickrig.host.monitor.decode.sdo.sdo_open import OpenTransfer, Phase
from tickrig.host.monitor.decode.sdo.transfer import Direction, Mode
from tickrig.wire.canopen.sdo.sdo import (
    DownloadInitiateRequest,
    DownloadInitiateResponse,
    UploadInitiateRequest,
    UploadInitiateResponse,
)
from tickrig.wire.canopen.sdo.sdo_block import (
    BlockDownloadInitiateRequest,
    BlockUploadInitiateRequest,
)

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
        case DownloadInitiateRequest(data=bytes(value)):
            opened.data += value
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
        return "upload"
    running.mode, running.phase, running.size = Mode.SEGMENTED, Phase.SEGMENTS, answer.size
    return f"segments follow, {running.progress}"


def unheard(at_us: int, node: int, answer: Answer) -> OpenTransfer:
    """Open a transfer whose request was not heard."""
    upload = isinstance(answer, UploadInitiateResponse)
    direction = Direction.UPLOAD if upload else Direction.DOWNLOAD
    opened = OpenTransfer(at_us, node, direction, Mode.SEGMENTED, answer.index, answer.sub)
    opened.partial = True
    return opened
