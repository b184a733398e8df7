"""SDO frames of one client and one server, put together to transfers."""

from __future__ import annotations

from typing import NamedTuple

from tickrig.host.canmon.model.decode.sdo.sdo_open import OpenTransfer, Phase
from tickrig.host.canmon.model.decode.sdo.sdo_steps import (
    ORPHAN,
    Answer,
    Initiate,
    answers,
    begin,
    confirm_segment,
    is_block_segment,
    request_segment,
    send_segment,
    take_answer,
    take_block_frame,
    take_block_segment,
    take_segment,
    unheard,
)
from tickrig.host.canmon.model.decode.sdo.transfer import (
    Direction,
    Mode,
    Outcome,
    Transfer,
    write_entry,
)
from tickrig.wire.canopen.sdo.sdo import (
    Abort,
    DownloadInitiateRequest,
    DownloadInitiateResponse,
    DownloadSegmentResponse,
    Request,
    Response,
    Segment,
    UploadInitiateRequest,
    UploadInitiateResponse,
    UploadSegmentRequest,
    parse_request,
    parse_response,
)
from tickrig.wire.canopen.sdo.sdo_block import (
    BlockDownloadInitiateRequest,
    BlockEnded,
    BlockUploadInitiateRequest,
)
from tickrig.wire.errors import WireError


class Step(NamedTuple):
    """What one SDO frame did.

    Attributes:
        text: the step, where no transfer ended with it.
        entry: index and sub-index it is about, as far as known.
        ended: the transfers that ended with it.
        asks: the client waits for an answer to it.
    """

    text: str
    entry: tuple[int, int] | None = None
    ended: tuple[Transfer, ...] = ()
    asks: bool = False


class SdoChannel:
    """Follows the transfers between one client and one server, as a third party hears them.

    It takes up a transfer in the middle: what can be told of it is told, and marked as
    partial. It knows no time-outs, which are the client's own: a transfer is unanswered
    when its client begins another one or the trace ends.

    Args:
        node: the server's node-ID.
    """

    def __init__(self, node: int) -> None:
        self.node = node
        self._running: OpenTransfer | None = None
        self._latest: Transfer | None = None
        self._ended: list[Transfer] = []

    def pending(self, now_us: int) -> Transfer | None:
        """Return the transfer that runs, as it would end now."""
        running = self._running
        return None if running is None or running.partial else _given_up(running, now_us)

    def request(self, at_us: int, data: bytes) -> Step:
        """Take a frame of the client."""
        running = self._running
        if running and is_block_segment(running, Direction.DOWNLOAD, data):
            text = take_block_segment(running, data)
            return Step(text, running.entry, asks=running.is_block_over)
        try:
            message = parse_request(data)
        except WireError as error:
            return Step(str(error))
        step = self._step(at_us, self._take_request(at_us, message, data), message)
        return step._replace(asks=not isinstance(message, Abort | BlockEnded))

    def response(self, at_us: int, data: bytes) -> Step:
        """Take a frame of the server."""
        running = self._running
        if running and is_block_segment(running, Direction.UPLOAD, data):
            return Step(take_block_segment(running, data), running.entry)
        try:
            message = parse_response(data)
        except WireError as error:
            return Step(str(error))
        return self._step(at_us, self._take_response(at_us, message), message)

    def _step(self, at_us: int, text: str, message: Request | Response) -> Step:
        """Close what is done, and tell what ended."""
        running = self._running
        if running and running.done:
            self._end(running.close(at_us, Outcome.DONE))
        ended, self._ended = tuple(self._ended), []
        entry = _named(message)
        if entry is None and ended:
            entry = ended[-1].entry
        elif entry is None and running:
            entry = running.entry
        return Step(text, entry, ended)

    def _end(self, transfer: Transfer) -> None:
        self._latest, self._running = transfer, None
        self._ended.append(transfer)

    def _take_request(self, at_us: int, message: Request, data: bytes) -> str:
        match message:
            case (
                UploadInitiateRequest()
                | DownloadInitiateRequest()
                | BlockUploadInitiateRequest()
                | BlockDownloadInitiateRequest()
            ):
                return self._begin(at_us, message, data)
            case Abort():
                return self._abort(at_us, message, by_client=True)
            case UploadSegmentRequest():
                return request_segment(self._segmented(at_us, Direction.UPLOAD), message)
            case Segment():
                return send_segment(self._segmented(at_us, Direction.DOWNLOAD), message)
            case _:
                return take_block_frame(self._running, message) if self._running else ORPHAN

    def _take_response(self, at_us: int, message: Response) -> str:
        running = self._running
        match message:
            case UploadInitiateResponse() | DownloadInitiateResponse():
                return self._answer(at_us, message)
            case Abort():
                return self._abort(at_us, message, by_client=False)
            case _ if running is None:
                return ORPHAN
            case Segment():
                return take_segment(running, message)
            case DownloadSegmentResponse():
                return confirm_segment(running, message)
            case _:
                return take_block_frame(running, message)

    def _begin(self, at_us: int, message: Initiate, data: bytes) -> str:
        running = self._running
        if running and running.begun_by == data and running.phase is Phase.ASKED:
            running.retries += 1
            return f"{running.direction} of {write_entry(running.entry)} asked for again"
        self._give_up(at_us)
        self._running = begin(at_us, self.node, message, data)
        return f"{self._running.direction} of {write_entry(self._running.entry)} asked for"

    def _give_up(self, at_us: int) -> None:
        if self._running and not self._running.partial:
            self._end(_given_up(self._running, at_us))

    def _answer(self, at_us: int, message: Answer) -> str:
        running = self._running
        if running and answers(running, message):
            return take_answer(running, message)
        latest = self._latest
        if latest and latest.retries and latest.entry == (message.index, message.sub):
            return "answered again"
        opened = unheard(at_us, self.node, message)
        text = f"{take_answer(opened, message)}, request not heard"
        if opened.done:
            self._ended.append(opened.close(at_us, Outcome.DONE))
        elif running is None or running.partial:
            self._running = opened
        return text

    def _segmented(self, at_us: int, direction: Direction) -> OpenTransfer:
        """Return the segmented transfer that runs, or one whose beginning was not heard."""
        running = self._running
        if running and running.direction is direction and running.phase is Phase.SEGMENTS:
            return running
        self._give_up(at_us)
        self._running = opened = OpenTransfer(at_us, self.node, direction, Mode.SEGMENTED)
        opened.phase, opened.partial = Phase.SEGMENTS, True
        return opened

    def _abort(self, at_us: int, message: Abort, *, by_client: bool) -> str:
        """End the transfer that runs; an abort of another object ends one that was not heard."""
        running, entry, code = self._running, _named(message), message.code
        if running and (entry is None or running.entry in (None, entry)):
            if entry is not None:
                running.index, running.sub = entry
            self._end(running.close(at_us, Outcome.ABORTED, code=code, by_client=by_client))
            return "aborted"
        other = OpenTransfer(at_us, self.node, Direction.UNKNOWN, Mode.EXPEDITED)
        other.index, other.sub = entry or (None, None)
        other.partial = True
        self._ended.append(other.close(at_us, Outcome.ABORTED, code=code, by_client=by_client))
        return "aborted"


def _named(message: Request | Response) -> tuple[int, int] | None:
    """Return the index and sub-index that a frame names itself.

    Some clients name none with an abort: 0000h:00 is no object.
    """
    if isinstance(message, Abort) and not (message.index or message.sub):
        return None
    index, sub = getattr(message, "index", None), getattr(message, "sub", None)
    return None if index is None or sub is None else (index, sub)


def _given_up(running: OpenTransfer, at_us: int) -> Transfer:
    asked = running.phase is Phase.ASKED
    return running.close(at_us, Outcome.UNANSWERED if asked else Outcome.BROKEN)
