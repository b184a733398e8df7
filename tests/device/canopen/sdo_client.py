"""An SDO client of a slave of the reference dictionary: frames by hand, or whole transfers."""

from __future__ import annotations

from tests.device.canopen.reference import NODE_ID, make_dictionary
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.sdo import SdoServers
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.sdo import (
    Abort,
    DownloadInitiateRequest,
    Request,
    Response,
    Segment,
    UploadInitiateRequest,
    UploadInitiateResponse,
    UploadSegmentRequest,
    parse_response,
)
from tickrig.wire.canopen.sdo_frame import (
    BlockAcknowledge,
    BlockDownloadInitiateRequest,
    BlockDownloadInitiateResponse,
    BlockEnd,
    BlockEnded,
    BlockSegment,
    BlockStart,
    BlockUploadInitiateRequest,
    BlockUploadInitiateResponse,
    crc16,
)

OPEN_SECOND = ("605#23011201A0060000", "605#23011202A1060000")
"""Make the server of 1201h serve 6A0h and 6A1h."""


def booted() -> Bus:
    """Make a slave in Pre-operational."""
    bus = Bus(make_slave(make_dictionary(()), NODE_ID))
    assert bus.step() == ["705#00"]
    return bus


def offer_blocks_of(bus: Bus, segments: int) -> None:
    """Let the default server offer this block size."""
    SdoServers.of(bus.slave).default.block_size = segments


def pattern(size: int) -> bytes:
    """Return bytes that are all different from their neighbours."""
    return bytes((7 * k + size) % 251 for k in range(size))


class Client:
    """A client of the default server; `AssertionError` if the server aborts."""

    def __init__(self, bus: Bus, request_id: int = 0x605, response_id: int = 0x585) -> None:
        self._bus, self._request_id, self._response_id = bus, request_id, response_id

    def send(self, *requests: Request | BlockSegment) -> list[bytes]:
        """Send requests in one tick; return what the server sent."""
        head = f"{self._response_id:03X}#"
        texts = (f"{self._request_id:03X}#{request.encode().hex()}" for request in requests)
        return [
            bytes.fromhex(text.removeprefix(head))
            for text in self._bus.step(*texts)
            if text.startswith(head)
        ]

    def ask(self, *requests: Request | BlockSegment) -> Response:
        """Send requests in one tick; return the one answer."""
        (answer,) = self.send(*requests)
        return parse_response(answer)

    def upload(self, index: int, sub: int = 0) -> bytes:
        """Read, expedited or segmented as the server likes."""
        answer = self.ask(UploadInitiateRequest(index, sub))
        assert isinstance(answer, UploadInitiateResponse), answer
        if answer.data is not None:
            return answer.data
        data, toggle = b"", False
        while True:
            part = self.ask(UploadSegmentRequest(toggle))
            assert isinstance(part, Segment), part
            assert part.toggle is toggle
            data += part.data
            toggle = not toggle
            if part.last:
                assert answer.size == len(data)
                return data

    def download(self, index: int, data: bytes, sub: int = 0, *, sized: bool = True) -> Response:
        """Write in segments; return the last answer."""
        size = len(data) if sized else None
        answer = self.ask(DownloadInitiateRequest(index, sub, size=size))
        for at in range(0, max(len(data), 1), 7):
            if isinstance(answer, Abort):
                break
            last = at + 7 >= len(data)
            answer = self.ask(Segment(bool(at // 7 % 2), data[at : at + 7], last))
        return answer

    def block_upload(self, index: int, sizes: list[int]) -> bytes:
        """Read in blocks of these sizes in turn, with CRC."""
        answer = self.ask(BlockUploadInitiateRequest(index, 0, crc=True, block_size=sizes[0]))
        assert isinstance(answer, BlockUploadInitiateResponse), answer
        data, number, replies = b"", 0, self.send(BlockStart())
        while True:
            segments = [BlockSegment.parse(reply) for reply in replies]
            assert [one.seqno for one in segments] == list(range(1, len(segments) + 1))
            data += b"".join(one.data for one in segments)
            number += 1
            block_size = sizes[number % len(sizes)]
            replies = self.send(BlockAcknowledge(len(segments), block_size))
            if segments[-1].last:
                break
            assert len(segments) == sizes[(number - 1) % len(sizes)]
        end = parse_response(replies[0])
        assert isinstance(end, BlockEnd), end
        data = data[: len(data) - end.fill]
        assert (answer.size, end.crc) == (len(data), crc16(data))
        assert self.send(BlockEnded()) == []
        return data

    def block_download(
        self, index: int, data: bytes, lost: frozenset[int] = frozenset()
    ) -> Response:
        """Write in blocks, with CRC; segments whose running number is in `lost` do not arrive.

        The end of a block always arrives: else the client would time out.
        """
        answer = self.ask(BlockDownloadInitiateRequest(index, 0, crc=True, size=len(data)))
        assert isinstance(answer, BlockDownloadInitiateResponse), answer
        block_size, at, running = answer.block_size, 0, 0
        while at < max(len(data), 1):
            sent: list[BlockSegment] = []
            for seqno in range(1, block_size + 1):
                start = at + 7 * (seqno - 1)
                part = data[start : start + 7]
                last = start + 7 >= len(data)
                end = last or seqno == block_size
                if running not in lost or end:
                    sent.append(BlockSegment(seqno, part, last))
                running += 1
                if last:
                    break
            receipt = self.ask(*sent)
            assert isinstance(receipt, BlockAcknowledge), receipt
            at, block_size = at + 7 * receipt.ackseq, receipt.block_size
        return self.ask(BlockEnd(-len(data) % 7 if data else 7, crc16(data)))
