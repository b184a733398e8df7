"""The meaning of a decoded frame, and an SDO transfer as one value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo_frame import describe_abort

# An SDO transfer as one value.


class TransferDirection(StrEnum):
    """Direction of the value, in the words of CiA 301."""

    UPLOAD = "upload"
    DOWNLOAD = "download"
    UNKNOWN = "transfer of"  # only an abort was seen


class TransferMode(StrEnum):
    """Mode in which the bytes are transferred."""

    EXPEDITED = "expedited"
    SEGMENTED = "segmented"
    BLOCK = "block"


class TransferOutcome(StrEnum):
    """Outcome of a transfer, as far as the bus shows it."""

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
        at_us: time of the first frame.
        duration_us: time from the first to the last frame.
        node: node-ID of the server.
        direction: direction of the value. An upload reads, a download writes.
        mode: transfer mode.
        index: index of the object, or None if the beginning is missing.
        sub: sub-index of the object, or None if the beginning is missing.
        outcome: outcome of the transfer.
        data: bytes of the value, or None if they are missing.
        abort_code: reason of an aborted transfer.
        by_client: whether the client aborted the transfer.
        retries: number of repeated frames and segments.
        partial: whether the beginning of the transfer is missing.
        flaws: inconsistencies such as a gap, a size or a CRC.
        sized: whether the number of bytes is indicated. An expedited transfer without it has four
            bytes.
        length: text about an unusual length, empty if the length is usual.
        name: name of the object, empty if unknown.
        value: value of the bytes. For an unknown type, up to 8 bytes are a number.
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
        """Index and sub-index, or None if they are unknown."""
        return None if self.index is None or self.sub is None else (self.index, self.sub)

    def described(  # noqa: PLR0913, PLR0917 - all that is known
        self, name: str, value: Value | None, text: str, length: str, unit: str, source: str
    ) -> Transfer:
        """Return a copy of the transfer with the name, value and unit of the transferred object.

        Args:
            name: name of the object.
            value: value that was transferred, or None if it is unknown.
            text: value as text, as in `Signal.text`.
            length: text about an unusual length, empty if the length is usual.
            unit: unit of the value.
            source: source of the name, as in `Decoded.source`.
        """
        return Transfer(
            self.at_us,
            self.duration_us,
            self.node,
            self.direction,
            self.mode,
            self.index,
            self.sub,
            self.outcome,
            self.data,
            self.abort_code,
            self.by_client,
            self.retries,
            self.partial,
            self.flaws,
            self.sized,
            length,
            name,
            value,
            text,
            unit,
            source,
        )

    def __str__(self) -> str:
        """Return the transfer as one line."""
        parts = [f"{self.direction} {write_entry(self.entry)}"]
        parts += [self.name] if self.name else []
        parts += [f"= {self.text}{self.unit}"] if self.text else []
        parts += [f"({', '.join(notes)})"] if (notes := self._notes()) else []
        return " ".join(parts)

    def _notes(self) -> list[str]:
        """Return details to show besides the value."""
        notes = list[str]()
        if self.mode is not TransferMode.EXPEDITED:
            notes.append(f"{self.mode}, {len(self.data or b'')} B")
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
    """Return index and sub-index as text.

    >>> write_entry((0x6041, 0)), write_entry(None)
    ('6041h:00', 'an unknown object')
    """
    return "an unknown object" if entry is None else f"{entry[0]:04X}h:{entry[1]:02X}"


# The meaning of a decoded frame.

EDS: Final = "eds"
SEEN: Final = "seen"
DBC: Final = "dbc"
"""Source of names and mappings: an EDS file, SDO traffic, or a DBC file. Empty is the standard."""


class Signal(NamedTuple):
    """A named value in a frame, such as an object mapped to a PDO, or a signal of a DBC file.

    Attributes:
        name: name of the signal. For an object, it is the name in lower case. If the object is a
            member of a record, the name of the member follows after a dot. If the name is unknown,
            index and sub-index are used instead, such as `6041h:00`. For a DBC file, the name is
            that of the signal in the file.
        value: value of the signal.
        unit: unit of the value from the EDS or DBC file, empty if there is none.
        text: value as a text for display, such as the name of a state. It is empty if the value
            itself is displayed.
    """

    name: str
    value: Value
    unit: str = ""
    text: str = ""

    def __str__(self) -> str:
        """Return name and value as text."""
        return f"{self.name}={self.text or str(self.value)}{self.unit}"


class Decoded(NamedTuple):
    """A decoded frame, for display and filters.

    Attributes:
        kind: kind of the frame: nmt, sync, time, emcy, heartbeat, boot-up, guard, sdo, tpdo1..,
            rpdo1.., lss, dbc, error, rrc, rtc-lite, unmapped for a PDO without a description, fd
            for a CAN FD frame, or raw for all others.
        node: node of the object, or None if there is none.
        summary: one line of text, or None if transfers or signals contain all information.
        signals: values in the frame.
        source: source of names, which is `EDS`, `SEEN` or `DBC`, or empty if the standard alone
            defines the frame.
        entry: index and sub-index of the object in an SDO frame.
        transfers: SDO transfers that ended with this frame.
        asks: whether the sender of the frame waits for an answer, as an SDO client does, or an NMT
            master with node guarding.
        size: number of bytes of a PDO according to its mapping, or None if unknown.
        flaw: inconsistency that an SDO frame adds to its transfer.
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
        """The decoded frame as one line of text."""
        if self.summary is not None:
            return self.summary
        return "; ".join(map(str, self.transfers)) or " ".join(map(str, self.signals))
