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
    UNKNOWN = "transfer of"  # only an abort was seen


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
        """Whether a frame of the server was seen."""
        return self is not TransferOutcome.UNANSWERED


@dataclass(frozen=True, slots=True)
class Transfer:
    """One SDO transfer.

    Attributes:
        at_us: time of its first frame.
        duration_us: time from its first to its last frame.
        node: the server.
        direction: an upload reads, a download writes.
        mode: transfer mode.
        index: None if the beginning is missing.
        sub: None if the beginning is missing.
        outcome: how it ended.
        data: the bytes; None if they are missing.
        abort_code: the reason if it was aborted.
        by_client: whether the client aborted it.
        retries: number of repeated frames and segments.
        partial: whether its beginning is missing.
        flaws: inconsistencies: a gap, a size, a CRC.
        sized: whether the number of bytes is indicated; an expedited transfer without it has four.
        length: text about an unusual length; empty if the length is usual.
        name: of the object, empty if unknown.
        value: value of the bytes; for an unknown type, up to 8 bytes are a number.
        text: the value as text.
        unit: unit of the value.
        source: source of name and type.
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
        """Index and sub-index; None if they are unknown."""
        return None if self.index is None or self.sub is None else (self.index, self.sub)

    def __str__(self) -> str:
        """Write one line."""
        parts = [f"{self.direction} {write_entry(self.entry)}"]
        parts += [self.name] if self.name else []
        parts += [f"= {self.text}{self.unit}"] if self.text else []
        parts += [f"({', '.join(notes)})"] if (notes := self._notes()) else []
        return " ".join(parts)

    def _notes(self) -> list[str]:
        """Return details to show besides the value."""
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
        notes += ["beginning missing"] if self.partial else []
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
        name: name of an object in lower case, with a dot before the member of a record. For an
            object without a name, index and sub-index, such as `6041h:00`. For a DBC file, the name
            in that file.
        value: the value.
        unit: unit in the EDS or DBC file, otherwise empty.
        text: the value as text, if it differs from the value.
    """

    name: str
    value: Value
    unit: str = ""
    text: str = ""

    def __str__(self) -> str:
        """Write name and value."""
        return f"{self.name}={self.text or str(self.value)}{self.unit}"


class Decoded(NamedTuple):
    """A decoded frame, for display and filters.

    Attributes:
        kind: nmt, sync, time, emcy, heartbeat, boot-up, guard, sdo, tpdo1.., rpdo1.., lss, dbc,
            error, rrc, rtc-lite; unmapped for a PDO without a description, fd for a CAN FD frame,
            raw for all others.
        node: the node of the object; None if there is none.
        summary: one line of text; None if transfers or signals contain everything.
        signals: the values in the frame.
        source: `EDS`, `SEEN`, `DBC`; empty if the standard alone defines it.
        entry: index and sub-index that an SDO frame is about.
        transfers: the SDO transfers that ended with this frame.
        asks: whether its sender waits for an answer, as an SDO client does, or an NMT master with
            node guarding.
        size: number of bytes of a PDO according to its mapping; None if unknown.
        flaw: an inconsistency that an SDO frame adds to its transfer.
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
