"""What a frame says, once it is decoded, and an SDO transfer as one value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo_frame import describe_abort

# An SDO transfer as one value.


class TransferDirection(StrEnum):
    """Which way the value goes, in the words of CiA 301."""

    UPLOAD = "upload"
    DOWNLOAD = "download"
    UNKNOWN = "transfer of"  # an abort alone was heard


class TransferMode(StrEnum):
    """How the bytes are carried."""

    EXPEDITED = "expedited"
    SEGMENTED = "segmented"
    BLOCK = "block"


class TransferOutcome(StrEnum):
    """How a transfer ended, as far as the bus shows it."""

    DONE = "done"
    ABORTED = "aborted"
    UNANSWERED = "unanswered"  # the server sent nothing
    BROKEN = "broken off"  # the client began another one

    @property
    def answered(self) -> bool:
        """Whether the server was heard."""
        return self is not TransferOutcome.UNANSWERED


@dataclass(frozen=True, slots=True)
class Transfer:
    """One SDO transfer.

    Attributes:
        at_us: when its first frame was heard.
        duration_us: from there to its last frame.
        node: the server.
        direction: upload reads, download writes.
        mode: how the bytes were carried.
        index: None where the beginning was not heard.
        sub: likewise.
        outcome: how it ended.
        data: the bytes; None where they were not heard.
        abort_code: why, where it was aborted.
        by_client: the client aborted it.
        retries: frames, and segments of a block, that were sent again.
        partial: its beginning was not heard.
        flaws: what does not fit: a gap, a size, a CRC.
        sized: the number of bytes was told; of an expedited transfer without it there are four.
        length: what is odd about it, for people.
        name: of the object, empty where nobody named it.
        value: of the bytes; a number of up to 8 bytes where the type is not known.
        text: the value for people.
        unit: of the value.
        source: where name and type come from.
    """

    at_us: int
    duration_us: int
    node: int
    direction: TransferDirection
    mode: TransferMode
    index: int | None
    sub: int | None
    outcome: TransferOutcome
    data: bytes | None = None
    abort_code: int = 0
    by_client: bool = False
    retries: int = 0
    partial: bool = False
    flaws: tuple[str, ...] = ()
    sized: bool = True
    length: str = ""
    name: str = ""
    value: Value | None = None
    text: str = ""
    unit: str = ""
    source: str = ""

    @property
    def entry(self) -> tuple[int, int] | None:
        """Index and sub-index; None where they were not heard."""
        return None if self.index is None or self.sub is None else (self.index, self.sub)

    def __str__(self) -> str:
        """Write one line."""
        parts = [f"{self.direction} {write_entry(self.entry)}"]
        parts += [self.name] if self.name else []
        parts += [f"= {self.text}{self.unit}"] if self.text else []
        parts += [f"({', '.join(notes)})"] if (notes := self._notes()) else []
        return " ".join(parts)

    def _notes(self) -> list[str]:
        """Say what people want to know beside the value."""
        notes = (
            []
            if self.mode is TransferMode.EXPEDITED
            else [f"{self.mode}, {len(self.data or b'')} B"]
        )
        if self.outcome is TransferOutcome.ABORTED:
            by = "client" if self.by_client else "server"
            notes.append(f"aborted by {by}: {describe_abort(self.abort_code)}")
        elif self.outcome is not TransferOutcome.DONE:
            notes.append(self.outcome)
        notes += [f"{self.retries} sent again"] if self.retries else []
        notes += ["beginning not heard"] if self.partial else []
        notes += [self.length] if self.length else []
        return [*notes, *self.flaws, f"{self.duration_us / 1_000:.1f} ms"]


def write_entry(entry: tuple[int, int] | None) -> str:
    """Write index and sub-index.

    >>> write_entry((0x6041, 0)), write_entry(None)
    ('6041h:00', 'an unknown object')
    """
    return "an unknown object" if entry is None else f"{entry[0]:04X}h:{entry[1]:02X}"


# What a frame says, once it is decoded.

EDS: Final = "eds"
SEEN: Final = "seen"
DBC: Final = "dbc"
"""Where names and mappings come from: a file, SDO traffic, a DBC file; else the standard."""


class Signal(NamedTuple):
    """A value of a frame.

    Attributes:
        name: of an object in lower case, a member of a record behind a dot; `6041h:00` where
            nobody named it; as the DBC file has it.
        value: what it is.
        unit: as the EDS or DBC file gives it, else empty.
        text: how people read it where that is not the value itself.
    """

    name: str
    value: Value
    unit: str = ""
    text: str = ""

    def __str__(self) -> str:
        """Write name and value."""
        return f"{self.name}={self.text or str(self.value)}{self.unit}"


class Decoded(NamedTuple):
    """A frame, for people and filters.

    Attributes:
        kind: nmt, sync, time, emcy, heartbeat, boot-up, guard, sdo, tpdo1.., rpdo1.., lss, dbc,
            error, rrc, rtc-lite; unmapped for a PDO nobody described, fd for a CAN FD frame,
            raw for all else.
        node: whose object it is; None where it belongs to none.
        summary: one line; None where transfers or else signals say it all.
        signals: the values in it.
        source: `EDS`, `SEEN`, `DBC`; empty where the standard alone says it.
        entry: index and sub-index that an SDO frame is about.
        transfers: the SDO transfers that ended with this frame.
        asks: who sent it waits for an answer: SDO client, NMT master that guards.
        size: bytes that a PDO must have by its mapping, None where nobody told it.
        flaw: what does not fit with an SDO frame, where that is new in its transfer.
    """

    kind: str
    node: int | None = None
    summary: str | None = ""
    signals: tuple[Signal, ...] = ()
    source: str = ""
    entry: tuple[int, int] | None = None
    transfers: tuple[Transfer, ...] = ()
    asks: bool = False
    size: int | None = None
    flaw: str = ""

    @property
    def text(self) -> str:
        """One line for people."""
        if self.summary is not None:
            return self.summary
        return "; ".join(map(str, self.transfers)) or " ".join(map(str, self.signals))
