"""SDO transfers as scripts, either expedited or segmented (CiA 301, SDO protocols).

The client of the canopen library blocks in its own thread until the answer arrives. The code here
must not block, and runs in virtual time. Therefore tickrig has its own client. Block transfer is
not emulated, because a server must not require it.
"""

from __future__ import annotations

from tickrig.host.canopen.dialogue import Answer, Script, SdoFrame, SdoRequest
from tickrig.host.canopen.errors import SdoAborted
from tickrig.wire.canopen import sdo
from tickrig.wire.canopen.sdo_frame import (
    EXPEDITED_BYTES,
    SEGMENT_BYTES,
    AbortCode,
    ClientCommand,
    frame_at,
)


def upload(index: int, sub: int, size: int = 0) -> Script[bytes]:
    """Script that reads an object by SDO, with an expedited or segmented transfer.

    Args:
        index: index of the object.
        sub: sub-index of the object.
        size: size of the object in bytes, or 0 if it is unknown. The size is used if an expedited
            answer does not indicate how many of the four bytes are data (CiA 301, 7.2.4.3.5).

    Raises:
        SdoAborted: the device refuses the request, or sends an unexpected answer.
        SdoTimeout: the device does not answer in time.
    """
    answer = yield SdoRequest(frame_at(ClientCommand.UPLOAD, index, sub), index, sub)
    match answer:
        case sdo.UploadInitiateResponse():
            if answer.data is not None:
                return answer.data if answer.size or not size else answer.data[:size]
            return (yield from _upload_segments(index, sub))
    return (yield from _fail(index, sub, answer))


def download(index: int, sub: int, data: bytes) -> Script[None]:
    """Write an object. The errors are those of `upload`."""
    if 1 <= len(data) <= EXPEDITED_BYTES:
        request = sdo.DownloadInitiateRequest(index, sub, data, len(data))
    else:
        request = sdo.DownloadInitiateRequest(index, sub, None, len(data))
    answer = yield SdoRequest(request.encode(), index, sub)
    match answer:
        case sdo.DownloadInitiateResponse():
            if request.data is None:
                yield from _download_segments(index, sub, data)
        case _:
            yield from _fail(index, sub, answer)


def upload_number(index: int, sub: int) -> Script[int]:
    """Read an unsigned number."""
    return int.from_bytes((yield from upload(index, sub)), "little")


def download_number(index: int, sub: int, value: int, size: int) -> Script[None]:
    """Write an unsigned number of `size` bytes."""
    yield from download(index, sub, value.to_bytes(size, "little"))


def _upload_segments(index: int, sub: int) -> Script[bytes]:
    data, toggle = b"", False
    while True:
        request = sdo.UploadSegmentRequest(toggle).encode()
        answer = yield SdoRequest(request, index, sub, goes_on=True)
        match answer:
            case sdo.Segment() if answer.toggle == toggle:
                data += answer.data
            case _:
                yield from _fail(index, sub, answer)
        if answer.last:
            return data
        toggle = not toggle


def _download_segments(index: int, sub: int, data: bytes) -> Script[None]:
    toggle = False
    for start in range(0, max(1, len(data)), SEGMENT_BYTES):
        part, last = data[start : start + SEGMENT_BYTES], start + SEGMENT_BYTES >= len(data)
        request = sdo.Segment(toggle, part, last).encode()
        answer = yield SdoRequest(request, index, sub, goes_on=True)
        if not isinstance(answer, sdo.DownloadSegmentResponse) or answer.toggle != toggle:
            yield from _fail(index, sub, answer)
        toggle = not toggle


def _fail(index: int, sub: int, answer: Answer) -> Script[bytes]:
    """Raise the error of an unexpected answer. Abort the transfer unless the device aborted it."""
    if isinstance(answer, sdo.Abort):
        raise SdoAborted(index, sub, answer.code)
    toggled = isinstance(answer, sdo.Segment | sdo.DownloadSegmentResponse)
    code = AbortCode.TOGGLE_BIT if toggled else AbortCode.COMMAND_SPECIFIER
    yield SdoFrame(sdo.Abort(index, sub, code).encode())
    raise SdoAborted(index, sub, code)
