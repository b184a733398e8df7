"""What a frame says, once it is decoded."""

from __future__ import annotations

from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.sdo.transfer import Transfer
from tickrig.wire.canopen.datatypes import Value

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

    @property
    def text(self) -> str:
        """One line for people."""
        if self.summary is not None:
            return self.summary
        return "; ".join(map(str, self.transfers)) or " ".join(map(str, self.signals))
