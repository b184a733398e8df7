"""SDO frames combined to transfers, as an observer of the bus sees them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import (
    Transfer,
    TransferDirection,
    TransferMode,
    TransferOutcome,
    write_entry,
)
from tickrig.wire.canopen import sdo, sdo_frame
from tickrig.wire.errors import WireError

# Theory of operation
# ===================
#
# A monitor sees both sides of an SDO dialogue, starts anywhere, and may miss frames. So this is
# neither a client nor a server, and it never refuses a frame: it compares each frame with the
# expected one (`_TransferPhase`) and records differences in `flaws`, `retries` and `partial`.
#
# - One `SdoChannel` is one client and one server (a pair of CAN-IDs). It has at most one running
#   transfer; a new initiate ends it, as `unanswered` if no answer came and `broken off` otherwise.
#   It has no time-outs: they belong to the client.
# - A repeated request (same bytes, no answer yet) is a retry and not a second transfer.
# - Toggle bits distinguish a repeated segment from the next one. A segment of a download counts
#   when its receipt comes, one of an upload when it comes.
# - Inside a block the first byte has no command specifier. `_is_block_segment` decides by
#   the state alone, and by three exceptions: 80h is an abort, a frame of the other
#   direction is none, and C1h with fill is the end once the last segment was seen.
#   Segments are kept by number and count only up to the acknowledged one, because the
#   others are sent again.
# - Beginning in the middle: a segment without a transfer opens one that is `partial`, with
#   no object; an answer without a request opens one that knows its object. A block cannot be joined
#   like that, because its frames cannot be distinguished: they are `_ORPHAN`.
# - An abort ends the running transfer only if it names its object, or none (0000h:00, as some
#   clients send it); with another object it is a transfer of its own whose other frames are
#   missing.
#
# The code that processes the last frame sets `done`; `SdoChannel` then closes the transfer into a
# `Transfer`, the value that everything else works with. `BusDecoder` learns only from those
# without flaws.

# An SDO transfer while it runs.


class _TransferPhase(Enum):
    """The frame of a transfer that is expected next."""

    ASKED = auto()  # the answer to the request that began it
    SEGMENTS = auto()
    BLOCK_READY = auto()  # block upload: the client's start
    BLOCK = auto()  # segments of a block
    BLOCK_ENDING = auto()  # the last segment has its receipt
    BLOCK_ENDED = auto()  # end was said, the answer is expected


_SEQNOS: Final = bytes(range(1, sdo_frame.MAX_BLOCK_SIZE + 1))


@dataclass(slots=True)
class _OpenTransfer:
    """The known part of a transfer.

    Args:
        at_us: time of the first frame.
        node: node-ID of the server.
        direction: direction of the value.
        mode: transfer mode of the request.
        index: index of the object, or None if the beginning is missing.
        sub: sub-index of the object, or None if the beginning is missing.
        begun_by: first request of the transfer, used to detect its repetition.

    Attributes:
        phase: phase that names the frame expected next.
        size: number of bytes, or None if it is not indicated.
        sized: whether the number of bytes is indicated.
        crc: whether both sides support the CRC.
        sent: segment of a download that is not confirmed yet.
        requested_toggle: toggle bit of the requested upload segment.
        taken: toggle bit of the latest accepted segment.
        block_last: position of the last segment in its block, which is valid after that segment.
        block_size: number of segments of a block that the receiver requires, or 0 until the
            receiver has sent it.
        done: whether no more frames are expected.
        new_flaw: inconsistency that the latest frame added to `flaws`, empty if there is none.
    """

    at_us: int
    node: int
    direction: TransferDirection
    mode: TransferMode
    index: int | None = None
    sub: int | None = None
    begun_by: bytes = b""
    phase: _TransferPhase = _TransferPhase.ASKED
    size: int | None = None
    sized: bool = True
    retries: int = 0
    partial: bool = False
    crc: bool = False
    data: bytearray = field(default_factory=bytearray)
    flaws: list[str] = field(default_factory=list)
    sent: sdo.Segment | None = None
    requested_toggle: bool | None = None
    taken: bool | None = None
    block_last: int | None = None
    block_size: int = 0
    done: bool = False
    new_flaw: str = ""
    _run: bytes = b""  # segments 1, 2, .. of a block, 7 bytes each, that came as the first
    _block: dict[int, bytes] = field(default_factory=dict)

    @property
    def entry(self) -> tuple[int, int] | None:
        """Index and sub-index, or None if they are unknown."""
        return None if self.index is None or self.sub is None else (self.index, self.sub)

    @property
    def progress(self) -> str:
        """The number of bytes received."""
        return f"{len(self.data)} of {self.size} B" if self.size else f"{len(self.data)} B"

    @property
    def is_block_over(self) -> bool:
        """Whether all segments of a block have arrived."""
        self._take_run()
        heard = max(self._block, default=0)
        return heard in (self.block_last, self.block_size) and heard > 0

    def take_block_segment(self, segment: sdo_frame.BlockSegment) -> None:
        """Keep a segment until the receiver acknowledges it."""
        self._take_run()
        self._block[segment.seqno] = segment.data
        if segment.last:
            self.block_last = segment.seqno

    def take_block_segments(self, numbers: bytes, data: bytes, last: int | None) -> None:
        """Keep many segments, as `take_block_segment` keeps one."""
        self._take_run()
        if not self._block and _SEQNOS.startswith(numbers):
            self._run = data
        else:
            self._keep(numbers, data)
        if last is not None:
            self.block_last = last

    def _keep(self, numbers: bytes, data: bytes) -> None:
        parts = range(0, len(data), sdo_frame.SEGMENT_BYTES)
        segments = (data[at : at + sdo_frame.SEGMENT_BYTES] for at in parts)
        self._block.update(zip(numbers, segments, strict=True))

    def _take_run(self) -> None:
        """Keep the segments of the run one by one."""
        if self._run:
            run, self._run = self._run, b""
            self._keep(_SEQNOS[: len(run) // sdo_frame.SEGMENT_BYTES], run)

    def acknowledge_block(self, ackseq: int) -> None:
        """Accept the segments that arrived in sequence. The others are sent again."""
        if self._run and len(self._run) == ackseq * sdo_frame.SEGMENT_BYTES:
            self._run, run = b"", self._run
            self.data += run
            if self.block_last == ackseq:
                self.phase = _TransferPhase.BLOCK_ENDING
            self.block_last = None
            return
        self._take_run()
        if any(seqno not in self._block for seqno in range(1, ackseq + 1)):
            self.add_flaw("segments missing")
        self.data += b"".join(self._block.get(seqno, b"") for seqno in range(1, ackseq + 1))
        # Segments behind the acknowledged one come again, in the next block.
        self.retries += max(self._block, default=0) > ackseq
        if self.block_last == ackseq:
            self.phase = _TransferPhase.BLOCK_ENDING
        self.block_last = None
        self._block.clear()

    def end_block(self, end: sdo_frame.BlockEnd) -> None:
        """Remove the padding of the last segment, and compare the CRC."""
        if end.fill:
            del self.data[-end.fill :]
        if self.crc and not self.flaws and sdo_frame.crc16(bytes(self.data)) != end.crc:
            self.add_flaw("wrong CRC")
        self.phase = _TransferPhase.BLOCK_ENDED

    def add_flaw(self, text: str) -> None:
        """Record an inconsistency once."""
        if text not in self.flaws:
            self.flaws.append(text)
            self.new_flaw = text

    def close(
        self, now_us: int, outcome: TransferOutcome, *, code: int = 0, by_client: bool = False
    ) -> Transfer:
        """Return the transfer as a value."""
        done = outcome is TransferOutcome.DONE
        if done and not self.partial and self.size not in (None, len(self.data)):
            self.add_flaw(f"size {self.size} was said")
        return Transfer(
            *(self.at_us, now_us - self.at_us, self.node, self.direction, self.mode),
            *(self.index, self.sub, outcome),
            data=bytes(self.data) if self.data or done else None,
            abort_code=code,
            by_client=by_client,
            retries=self.retries,
            partial=self.partial,
            flaws=tuple(self.flaws),
            sized=self.sized,
        )


# Frames of SDO transfers, initiation, segments and blocks, as a third party hears them.

_Initiate = (
    sdo.UploadInitiateRequest
    | sdo.DownloadInitiateRequest
    | sdo_frame.BlockUploadInitiateRequest
    | sdo_frame.BlockDownloadInitiateRequest
)
_Answer = sdo.UploadInitiateResponse | sdo.DownloadInitiateResponse


def begin(at_us: int, node: int, request: _Initiate, data: bytes) -> _OpenTransfer:
    """Open a transfer with its first request."""
    uploads = isinstance(request, sdo.UploadInitiateRequest | sdo_frame.BlockUploadInitiateRequest)
    direction = TransferDirection.UPLOAD if uploads else TransferDirection.DOWNLOAD
    opened = _OpenTransfer(
        at_us, node, direction, TransferMode.EXPEDITED, request.index, request.sub, data
    )
    match request:
        case sdo.DownloadInitiateRequest(data=None, size=size):
            opened.mode, opened.size = TransferMode.SEGMENTED, size
        case sdo.DownloadInitiateRequest(data=bytes(value), size=size):
            opened.data += value
            opened.sized = size is not None
        case sdo_frame.BlockUploadInitiateRequest(crc=crc):
            opened.mode, opened.crc = TransferMode.BLOCK, crc
        case sdo_frame.BlockDownloadInitiateRequest(crc=crc, size=size):
            opened.mode, opened.crc, opened.size = TransferMode.BLOCK, crc, size
    return opened


def _answers(running: _OpenTransfer, answer: _Answer) -> bool:
    """Return whether a frame is the answer to the request. A block upload may fall back."""
    upload = isinstance(answer, sdo.UploadInitiateResponse)
    return (
        running.phase is _TransferPhase.ASKED
        and running.entry == (answer.index, answer.sub)
        and running.direction
        is (TransferDirection.UPLOAD if upload else TransferDirection.DOWNLOAD)
        # A server may answer a block upload by an expedited or segmented one (protocol
        # switch threshold).
        and (upload or running.mode is not TransferMode.BLOCK)
    )


def _take_answer(running: _OpenTransfer, answer: _Answer) -> str:
    """Process the answer, which is the value, or starts segments."""
    if isinstance(answer, sdo.DownloadInitiateResponse):
        running.done = running.mode is TransferMode.EXPEDITED and not running.partial
        running.phase = _TransferPhase.SEGMENTS
        return (
            "ready for segments" if running.mode is TransferMode.SEGMENTED else "download confirmed"
        )
    if answer.data is not None:
        running.mode, running.done = TransferMode.EXPEDITED, True
        running.data += answer.data
        running.sized = answer.size is not None
        return "upload"
    running.mode, running.size = TransferMode.SEGMENTED, answer.size
    running.phase = _TransferPhase.SEGMENTS
    size = "their size is not indicated" if answer.size is None else running.progress
    return f"segments follow, {size}"


def _unheard(at_us: int, node: int, answer: _Answer) -> _OpenTransfer:
    """Open a transfer whose request is missing."""
    upload = isinstance(answer, sdo.UploadInitiateResponse)
    direction = TransferDirection.UPLOAD if upload else TransferDirection.DOWNLOAD
    opened = _OpenTransfer(at_us, node, direction, TransferMode.SEGMENTED, answer.index, answer.sub)
    opened.partial = True
    return opened


WRONG_TOGGLE: Final = "wrong toggle bit"


def _check_toggle(running: _OpenTransfer, toggle: bool) -> None:
    """Report a client that does not alternate the toggle bit, or does not begin with 0."""
    began = running.requested_toggle is not None or running.sent is not None
    first = running.taken is None and not began and not running.partial
    if toggle == running.taken or (first and toggle):
        running.add_flaw(WRONG_TOGGLE)


def _request_segment(running: _OpenTransfer, request: sdo.UploadSegmentRequest) -> str:
    """Process the next request of an upload client."""
    running.retries += running.requested_toggle == request.toggle
    _check_toggle(running, request.toggle)
    running.requested_toggle = request.toggle
    return f"asks for a segment, {running.progress} so far"


def _take_segment(running: _OpenTransfer, segment: sdo.Segment) -> str:
    """Process a segment of an upload, unless it was repeated or its toggle bit is wrong."""
    if segment.toggle != running.requested_toggle or segment.toggle == running.taken:
        if segment.toggle != running.requested_toggle is not None:
            running.add_flaw(WRONG_TOGGLE)
        return "segment with the wrong toggle bit, or sent again"
    running.taken = segment.toggle
    running.data += segment.data
    running.done = segment.last
    return f"segment, {running.progress}"


def _send_segment(running: _OpenTransfer, segment: sdo.Segment) -> str:
    """Process a segment of a download. The segment counts when the server has confirmed it."""
    again = running.sent is not None and running.sent.toggle == segment.toggle
    if not again:
        _check_toggle(running, segment.toggle)
    running.retries += again or segment.toggle == running.taken
    running.sent = segment
    return f"segment of {len(segment.data)} B, {running.progress} so far"


def _confirm_segment(running: _OpenTransfer, response: sdo.DownloadSegmentResponse) -> str:
    """Process the confirmation of a segment."""
    sent = running.sent
    if sent is None or sent.toggle != response.toggle or sent.toggle == running.taken:
        if sent is not None and sent.toggle != response.toggle:
            running.add_flaw(WRONG_TOGGLE)
        return "confirmation of a missing segment, or of a repeated one"
    running.taken, running.sent = sent.toggle, None
    running.data += sent.data
    running.done = sent.last
    return f"segment confirmed, {running.progress}"


_ORPHAN: Final = "of a block transfer whose beginning is missing"

_END_MASK: Final = 0xE3


def _is_block_segment(running: _OpenTransfer, sender: TransferDirection, data: bytes) -> bool:
    """Return whether a frame is a segment of a block. Only the state shows this."""
    if running.phase is not _TransferPhase.BLOCK or running.direction is not sender:
        return False
    if len(data) != sdo_frame.FRAME_BYTES or not data[0] & sdo_frame.BLOCK_SEQNO:
        return False  # 80h, an abort: no segment has the number 0
    # E3h: bits of an end without n, C1h | n << 2. Before the last segment such a byte is
    # segment 41h.
    return running.block_last is None or data[0] & _END_MASK != sdo_frame.BLOCK_END


def _take_block_segment(running: _OpenTransfer, data: bytes) -> str:
    """Keep a segment until its acknowledgement."""
    segment = sdo_frame.BlockSegment.parse(data)
    running.take_block_segment(segment)
    return f"segment {segment.seqno} of a block"


def _take_block_frame(running: _OpenTransfer, message: sdo.Request | sdo.Response) -> str:
    """Process any other frame of a block transfer."""
    upload = running.direction is TransferDirection.UPLOAD
    match message, running.phase:
        case (
            (sdo_frame.BlockDownloadInitiateResponse() | sdo_frame.BlockUploadInitiateResponse()),
            _TransferPhase.ASKED,
        ):
            return _answer(running, message)
        case sdo_frame.BlockStart(), _TransferPhase.BLOCK_READY:
            running.phase = _TransferPhase.BLOCK
            return "start of a block upload"
        case sdo_frame.BlockAcknowledge(ackseq=ackseq, block_size=block_size), _TransferPhase.BLOCK:
            running.acknowledge_block(ackseq)
            running.block_size = block_size
            return f"segments to {ackseq} confirmed, {running.progress}"
        case sdo_frame.BlockEnd(), (_TransferPhase.BLOCK | _TransferPhase.BLOCK_ENDING):
            return _end(running, message)
        case sdo_frame.BlockEnded(), _TransferPhase.BLOCK_ENDED:
            running.done = True
            return "end of a block upload confirmed" if upload else "block download confirmed"
        case _:
            return _ORPHAN


def _answer(
    running: _OpenTransfer,
    answer: sdo_frame.BlockDownloadInitiateResponse | sdo_frame.BlockUploadInitiateResponse,
) -> str:
    running.crc = running.crc and answer.crc
    if isinstance(answer, sdo_frame.BlockUploadInitiateResponse):
        running.size = answer.size
        running.phase = _TransferPhase.BLOCK_READY
        return f"block upload of {'unknown size' if answer.size is None else f'{answer.size} B'}"
    running.phase, running.block_size = _TransferPhase.BLOCK, answer.block_size
    return f"ready for blocks of {answer.block_size} segments"


def _end(running: _OpenTransfer, end: sdo_frame.BlockEnd) -> str:
    if running.phase is _TransferPhase.BLOCK:
        running.add_flaw("a confirmation is missing")
    running.end_block(end)
    return f"end of the blocks, {running.progress}"


# SDO frames of one client and one server, put together to transfers.


class SdoStep(NamedTuple):
    """The effect of one SDO frame on the transfer that it belongs to.

    Attributes:
        text: description of the frame, used if no transfer ended with the frame.
        entry: index and sub-index of the transferred object, or None if unknown.
        ended: transfers that ended with the frame.
        asks: whether the client waits for an answer after the frame.
        flaw: description of an inconsistency that the frame caused, such as a wrong toggle bit, or
            empty.
    """

    text: str
    entry: tuple[int, int] | None = None
    ended: tuple[Transfer, ...] = ()
    asks: bool = False
    flaw: str = ""


class SdoChannel:
    """Passive listener that combines the SDO frames of one client and one server to transfers.

    If listening starts in the middle of a transfer, the received part of the transfer is returned,
    and marked as partial. A listener does not know the time-out of the client. Therefore a transfer
    counts as unanswered only when the client starts another transfer, or when the log ends.

    Args:
        node: node-ID of the SDO server.
    """

    def __init__(self, node: int) -> None:
        self.node = node
        self._running: _OpenTransfer | None = None
        self._latest: Transfer | None = None
        self._ended: list[Transfer] = []

    def pending(self, now_us: int) -> Transfer | None:
        """Return the running transfer, as if it ended now."""
        running = self._running
        return None if running is None or running.partial else _given_up(running, now_us)

    # A reader of blocks takes frames that fit at once, and all others by `request` and `response`.

    def turn(self) -> int:
        """Return a code for the request that must come next in the running transfer.

        The block-wise decoder compares this code with the frames of a block.

        Returns:
            0 if no transfer is running. 1 or 2 if the next request must ask for an upload segment
            with toggle bit 0 or 1. 3 or 4 if the next request must contain a download segment with
            toggle bit 0 or 1. -1 if a transfer is running, but none of these requests is next.
        """
        running = self._running
        if running is None:
            return 0
        taken, upload = running.taken, running.direction is TransferDirection.UPLOAD
        waits = running.requested_toggle != taken if upload else running.sent is not None
        begins = taken is None and running.partial
        if running.phase is not _TransferPhase.SEGMENTS or waits or begins:
            return -1
        return (1 if upload else 3) + (taken is False)

    def received(self) -> tuple[int, int]:
        """Return the number of received bytes of the running transfer, and its total size.

        The size is 0 if it is unknown. Both numbers are 0 if no transfer is running.
        """
        running = self._running
        return (0, 0) if running is None else (len(running.data), running.size or 0)

    def runs(self) -> tuple[int, int] | None:
        """Return the object of the running transfer, or None if no transfer was answered."""
        running = self._running
        if running is None or running.phase is _TransferPhase.ASKED:
            return None
        return running.entry

    def take_segments(self, data: bytes, toggle: bool) -> None:
        """Add the data of several segments to the running transfer at once.

        Args:
            data: data bytes of all these segments.
            toggle: toggle bit of the last segment.
        """
        running = self._running
        assert running is not None, "a transfer runs"
        running.data += data
        running.taken, running.sent = toggle, None
        if running.direction is TransferDirection.UPLOAD:
            running.requested_toggle = toggle

    def end_exchanges(self) -> None:
        """Record that transfers were completed without a repetition, so that none is running."""
        self._running = self._latest = None

    def block_from(self) -> TransferDirection | None:
        """Return the direction, upload or download, of the running block transfer.

        The result is None if no segments of a block are expected, or if the last segment has
        arrived.
        """
        running = self._running
        if running is None or running.phase is not _TransferPhase.BLOCK:
            return None
        return running.direction if running.block_last is None else None

    def take_block(self, numbers: bytes, data: bytes, last: int | None) -> None:
        """Add segments of a block.

        Args:
            numbers: number of each segment.
            data: data of the segments, 7 bytes for each.
            last: number of the last segment of the transfer, or None if that segment has not
                arrived.
        """
        running = self._running
        assert running is not None, "a transfer runs"
        running.take_block_segments(numbers, data, last)

    def request(self, at_us: int, data: bytes) -> SdoStep:
        """Process a frame of the client."""
        running = self._running
        if running and _is_block_segment(running, TransferDirection.DOWNLOAD, data):
            text = _take_block_segment(running, data)
            return SdoStep(text, running.entry, asks=running.is_block_over)
        try:
            message = sdo.parse_request(data)
        except WireError as error:
            return SdoStep(str(error))
        step = self._step(at_us, self._take_request(at_us, message, data), message)
        return step._replace(asks=not isinstance(message, sdo.Abort | sdo_frame.BlockEnded))

    def response(self, at_us: int, data: bytes) -> SdoStep:
        """Process a frame of the server."""
        running = self._running
        if running and _is_block_segment(running, TransferDirection.UPLOAD, data):
            return SdoStep(_take_block_segment(running, data), running.entry)
        try:
            message = sdo.parse_response(data)
        except WireError as error:
            return SdoStep(str(error))
        return self._step(at_us, self._take_response(at_us, message), message)

    def _step(self, at_us: int, text: str, message: sdo.Request | sdo.Response) -> SdoStep:
        """Close a finished transfer and return it."""
        running, flaw = self._running, ""
        if running:
            flaw, running.new_flaw = running.new_flaw, ""
        if running and running.done:
            self._end(running.close(at_us, TransferOutcome.DONE))
        ended, self._ended = tuple(self._ended), []
        entry = _named(message)
        if entry is None and ended:
            entry = ended[-1].entry
        elif entry is None and running:
            entry = running.entry
        return SdoStep(text, entry, ended, flaw=flaw)

    def _end(self, transfer: Transfer) -> None:
        self._latest, self._running = transfer, None
        self._ended.append(transfer)

    def _take_request(self, at_us: int, message: sdo.Request, data: bytes) -> str:
        match message:
            case (
                sdo.UploadInitiateRequest()
                | sdo.DownloadInitiateRequest()
                | sdo_frame.BlockUploadInitiateRequest()
                | sdo_frame.BlockDownloadInitiateRequest()
            ):
                return self._begin(at_us, message, data)
            case sdo.Abort():
                return self._abort(at_us, message, by_client=True)
            case sdo.UploadSegmentRequest():
                return _request_segment(self._segmented(at_us, TransferDirection.UPLOAD), message)
            case sdo.Segment():
                return _send_segment(self._segmented(at_us, TransferDirection.DOWNLOAD), message)
            case _:
                return _take_block_frame(self._running, message) if self._running else _ORPHAN

    def _take_response(self, at_us: int, message: sdo.Response) -> str:
        running = self._running
        match message:
            case sdo.UploadInitiateResponse() | sdo.DownloadInitiateResponse():
                return self._answer(at_us, message)
            case sdo.Abort():
                return self._abort(at_us, message, by_client=False)
            case _ if running is None:
                return _ORPHAN
            case sdo.Segment():
                return _take_segment(running, message)
            case sdo.DownloadSegmentResponse():
                return _confirm_segment(running, message)
            case _:
                return _take_block_frame(running, message)

    def _begin(self, at_us: int, message: _Initiate, data: bytes) -> str:
        running = self._running
        if running and running.begun_by == data and running.phase is _TransferPhase.ASKED:
            running.retries += 1
            return f"{running.direction} of {write_entry(running.entry)} asked for again"
        self._give_up(at_us)
        self._running = begin(at_us, self.node, message, data)
        return f"{self._running.direction} of {write_entry(self._running.entry)} asked for"

    def _give_up(self, at_us: int) -> None:
        if self._running and not self._running.partial:
            self._end(_given_up(self._running, at_us))

    def _answer(self, at_us: int, message: _Answer) -> str:
        running = self._running
        if running and _answers(running, message):
            return _take_answer(running, message)
        latest = self._latest
        if latest and latest.retries and latest.entry == (message.index, message.sub):
            return "answered again"
        opened = _unheard(at_us, self.node, message)
        text = f"{_take_answer(opened, message)}, request missing"
        if opened.done:
            self._ended.append(opened.close(at_us, TransferOutcome.DONE))
        elif running is None or running.partial:
            self._running = opened
        return text

    def _segmented(self, at_us: int, direction: TransferDirection) -> _OpenTransfer:
        """Return the running segmented transfer, or a new transfer whose beginning is missing."""
        running = self._running
        if running and running.direction is direction and running.phase is _TransferPhase.SEGMENTS:
            return running
        self._give_up(at_us)
        self._running = opened = _OpenTransfer(at_us, self.node, direction, TransferMode.SEGMENTED)
        opened.phase, opened.partial = _TransferPhase.SEGMENTS, True
        return opened

    def _abort(self, at_us: int, message: sdo.Abort, *, by_client: bool) -> str:
        """End the running transfer.

        An abort of another object ends a transfer without other frames.
        """
        running, entry, code = self._running, _named(message), message.code
        if running and (entry is None or running.entry in (None, entry)):
            if entry is not None:
                running.index, running.sub = entry
            self._end(running.close(at_us, TransferOutcome.ABORTED, code=code, by_client=by_client))
            return "aborted"
        other = _OpenTransfer(at_us, self.node, TransferDirection.UNKNOWN, TransferMode.EXPEDITED)
        other.index, other.sub = entry or (None, None)
        other.partial = True
        self._ended.append(
            other.close(at_us, TransferOutcome.ABORTED, code=code, by_client=by_client)
        )
        return "aborted"


def _named(message: sdo.Request | sdo.Response) -> tuple[int, int] | None:
    """Return the index and sub-index in a frame.

    Some clients abort without naming an object: they send 0000h:00, which is not an object.
    """
    if isinstance(message, sdo.Abort) and not (message.index or message.sub):
        return None
    index, sub = getattr(message, "index", None), getattr(message, "sub", None)
    return None if index is None or sub is None else (index, sub)


def _given_up(running: _OpenTransfer, at_us: int) -> Transfer:
    asked = running.phase is _TransferPhase.ASKED
    return running.close(at_us, TransferOutcome.UNANSWERED if asked else TransferOutcome.BROKEN)
