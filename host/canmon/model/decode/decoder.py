"""All that was heard decoded, on any number of buses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final, Protocol

from tickrig.host.canmon.model.decode.bus_decoder import BusDecoder
from tickrig.host.canmon.model.decode.dbc_file import DbcFile
from tickrig.host.canmon.model.decode.decoded import Decoded, Transfer
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, NodeMemory, read_eds_objects
from tickrig.host.canmon.model.decode.services import decode_error
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import ErrorFrame, FdFrame

FD: Final = Decoded("fd", None, "no CANopen service")
"""CANopen is spoken in classic frames (CiA 301, 5.3); CANopen FD is another protocol."""

_NO_EDS: Final[Mapping[int, Path | EdsObjects]] = MappingProxyType({})


class FrameDecoder(Protocol):
    """Decodes frames that neither the standard nor a DBC file describes."""

    def decode(self, record: Record) -> Decoded | None:
        """Return what a frame says; None for a frame of others."""


class Decoder:
    """Decodes what was heard, in order; each bus has its own nodes.

    Args:
        eds: an EDS or DCF, or what was read of one, by node-ID. It counts on every bus.
        dbc: DBC files; the CAN-IDs that they name mean nothing else.
        first: asked before anything else what a frame says.

    Attributes:
        first: these, and behind them the DBC files.

    Raises:
        OSError: a file cannot be read.
        EdsError: an EDS is malformed.
        DbcError: a DBC file is malformed, or cantools is not there.
    """

    def __init__(
        self,
        eds: Mapping[int, Path | EdsObjects] = _NO_EDS,
        dbc: Sequence[Path] = (),
        first: Sequence[FrameDecoder] = (),
    ) -> None:
        self._eds = {
            node: read_eds_objects(item, node) if isinstance(item, Path) else item
            for node, item in eds.items()
        }
        self.first: tuple[FrameDecoder, ...] = (*first, *map(DbcFile, dbc))
        self._buses: dict[str, BusDecoder] = {}

    @property
    def standard(self) -> bool:
        """Whether nothing but the standard, EDS and traffic tell what frames mean."""
        return not self.first

    def take(self, record: Record) -> Decoded:
        """Decode a frame, and learn from it."""
        frame = record.frame
        if isinstance(frame, ErrorFrame):
            return decode_error(frame)
        for decoder in self.first:
            decoded = decoder.decode(record)
            if decoded is not None:
                return decoded
        if isinstance(frame, FdFrame):
            return FD
        if frame.extended:
            return Decoded("raw")
        bus = self._buses.get(record.channel)
        if bus is None:
            bus = self.bus(record.channel)
        return bus.take(record.at_us, frame)

    def pending(self, now_us: int) -> tuple[Transfer, ...]:
        """Return the SDO transfers that run, as they would end now."""
        return tuple(item for bus in self._buses.values() for item in bus.pending(now_us))

    def memory(self, channel: str, node: int) -> NodeMemory:
        """Return what is known of a node."""
        return self.bus(channel).memory(node)

    def bus(self, channel: str) -> BusDecoder:
        """Return what decodes a bus."""
        bus = self._buses.get(channel)
        if bus is None:
            bus = self._buses[channel] = BusDecoder(self._eds)
        return bus
