"""Boot a node on paper: its EDS answers in its place."""

from __future__ import annotations

from collections.abc import Iterable

from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.canopen.script import Ask, Step
from tickrig.host.rtc_canopen.definition.definition import NodeEntry, SdoEntry
from tickrig.host.rtc_canopen.definition.device_file import DeviceFile
from tickrig.host.rtc_canopen.node.boot import boot
from tickrig.host.rtc_canopen.proxy.pdo_layout import PdoLayout
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import (
    Abort,
    DownloadInitiateRequest,
    DownloadInitiateResponse,
    DownloadSegmentResponse,
    Response,
    Segment,
    UploadInitiateRequest,
    UploadInitiateResponse,
    parse_request,
)

Layouts = tuple[PdoLayout, ...]


def boot_on_paper(entry: NodeEntry, file: DeviceFile, writes: Iterable[SdoEntry]) -> Layouts | None:
    """Return the PDOs that will be on, None where the EDS does not give the values."""
    values = dict(file.defaults)
    script = boot(entry, file, writes)
    try:
        step = next(script)
        while True:
            step = script.send(_answer(step, values))
    except StopIteration as end:
        layouts: Layouts = end.value
        return layouts
    except SdoAborted:
        return None


def _answer(step: Step, values: dict[tuple[int, int], bytes]) -> Response | None:
    """Answer as a device that has these values, and takes any."""
    match parse_request(step.request) if isinstance(step, Ask) else None:
        case UploadInitiateRequest(index=index, sub=sub):
            if (data := values.get((index, sub))) is None:
                return Abort(index, sub, AbortCode.NO_OBJECT)
            return UploadInitiateResponse(index, sub, data, len(data))
        case DownloadInitiateRequest(index=index, sub=sub, data=data):
            values[index, sub] = data or b""
            return DownloadInitiateResponse(index, sub)
        case Segment(toggle=toggle):
            return DownloadSegmentResponse(toggle)
    return None
