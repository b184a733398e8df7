"""An SDO transfer while it runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, auto

from tickrig.host.canmon.model.decode.sdo.transfer import Direction, Mode, Outcome, Transfer
from tickrig.wire.canopen.sdo.sdo import Segment
from tickrig.wire.canopen.sdo.sdo_block import BlockEnd, BlockSegment, crc16


class Phase(Enum):
    """What is expected next."""

    ASKED = auto()  # the answer to the request that began it
    SEGMENTS = auto()
    BLOCK_READY = auto()  # block upload: the client's start
    BLOCK = auto()  # segments of a block
    BLOCK_ENDING = auto()  # the last segment has its receipt
    BLOCK_ENDED = auto()  # end was said, the answer is expected


@dataclass(slots=True)
class OpenTransfer:
    """What was heard of a transfer so far.

    Args:
        at_us: when it began.
        node: the server.
        direction: which way the value goes.
        mode: as the request wants it.
        index: None where the beginning was not heard.
        sub: likewise.
        begun_by: the request, to tell when it is sent again.

    Attributes:
        phase: what is expected next.
        size: number of bytes, None if it was not said.
        sized: what came says how many bytes it has.
        crc: both sides can do the CRC.
        sent: the segment of a download that has no receipt yet.
        requested_toggle: toggle bit of the segment of an upload that was asked for.
        taken: toggle bit of the latest segment that was taken.
        block_last: place of the last segment in its block, once it was heard.
        block_size: segments of a block, as its receiver wants it; 0 while it has not said so.
        done: nothing more is expected.
    """

    at_us: int
    node: int
    direction: Direction
    mode: Mode
    index: int | None = None
    sub: int | None = None
    begun_by: bytes = b""
    phase: Phase = Phase.ASKED
    size: int | None = None
    sized: bool = True
    retries: int = 0
    partial: bool = False
    crc: bool = False
    data: bytearray = field(default_factory=bytearray)
    flaws: list[str] = field(default_factory=list)
    sent: Segment | None = None
    requested_toggle: bool | None = None
    taken: bool | None = None
    block_last: int | None = None
    block_size: int = 0
    done: bool = False
    _block: dict[int, bytes] = field(default_factory=dict)

    @property
    def entry(self) -> tuple[int, int] | None:
        """Index and sub-index; None where they were not heard."""
        return None if self.index is None or self.sub is None else (self.index, self.sub)

    @property
    def progress(self) -> str:
        """How many bytes have come."""
        return f"{len(self.data)} of {self.size} B" if self.size else f"{len(self.data)} B"

    @property
    def is_block_over(self) -> bool:
        """Whether all segments of a block have come."""
        heard = max(self._block, default=0)
        return heard in (self.block_last, self.block_size) and heard > 0

    def take_block_segment(self, segment: BlockSegment) -> None:
        """Keep a segment until its receipt says that it counts."""
        self._block[segment.seqno] = segment.data
        if segment.last:
            self.block_last = segment.seqno

    def acknowledge_block(self, ackseq: int) -> None:
        """Take the segments that came in sequence; the others are sent again."""
        if any(seqno not in self._block for seqno in range(1, ackseq + 1)):
            self.add_flaw("segments not heard")
        self.data += b"".join(self._block.get(seqno, b"") for seqno in range(1, ackseq + 1))
        self.retries += max(self._block, default=0) > ackseq
        if self.block_last == ackseq:
            self.phase = Phase.BLOCK_ENDING
        self.block_last = None
        self._block.clear()

    def end_block(self, end: BlockEnd) -> None:
        """Cut the fill of the last segment off, and compare the CRC."""
        if end.fill:
            del self.data[-end.fill :]
        if self.crc and not self.flaws and crc16(bytes(self.data)) != end.crc:
            self.add_flaw("wrong CRC")
        self.phase = Phase.BLOCK_ENDED

    def add_flaw(self, text: str) -> None:
        """Note what does not fit, once."""
        if text not in self.flaws:
            self.flaws.append(text)

    def close(
        self, now_us: int, outcome: Outcome, *, code: int = 0, by_client: bool = False
    ) -> Transfer:
        """Return it as a value."""
        done = outcome is Outcome.DONE
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
