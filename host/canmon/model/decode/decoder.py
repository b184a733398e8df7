"""Decoding of all frames, on any number of buses."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import IntEnum
from functools import partial
from operator import itemgetter
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Protocol

from tickrig.host.canmon.model.decode import node_memory, services
from tickrig.host.canmon.model.decode.dbc_file import DbcFile
from tickrig.host.canmon.model.decode.decoded import (
    Decoded,
    Signal,
    Transfer,
    TransferOutcome,
    write_entry,
)
from tickrig.host.canmon.model.decode.eds_folder import EdsFiles, node_identity
from tickrig.host.canmon.model.decode.node_memory import ObjectText
from tickrig.host.canmon.model.decode.pdos import (
    PDO_OBJECTS,
    NodePdo,
    PdoDecoder,
    PdoTable,
    pdos_of,
)
from tickrig.host.canmon.model.decode.services import decode_error
from tickrig.host.canmon.model.frames import Record, sender_of
from tickrig.wire.can import CanFrame, ErrorFrame, FdFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.lss import LSS_MASTER_COB_ID, LSS_SLAVE_COB_ID
from tickrig.wire.canopen.nmt import CAN_ID_MASK, EXTENDED, INVALID, NMT_COB_ID
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.sdo import SdoChannel, SdoStep


# One bus decoded: what each CAN-ID means, by the standard and by what was seen.


# Theory of operation
# ===================
#
# Three sources define the meaning of a CAN-ID, in ascending precedence: the pre-defined connection
# set, an EDS of the node, and SDO traffic. The decoder never queries a node; it learns, and may
# learn in the middle of a log that it was wrong so far. Nothing is decoded again: a frame is
# decoded with what was known when it came.
#
# `_routes` is a cache: by CAN-ID the function that decodes its frames. `_route` fills it,
# in this order:
#
# 1. `_configured`    COB-IDs of SYNC, TIME, EMCY and additional SDO servers that were configured
# 2. NMT, SYNC, TIME, LSS
# 3. `PdoTable`       PDOs with known CAN-ID and content; the producer takes precedence over
#    consumers
# 4. 080h, 580h, 600h, 700h + node-ID, by the pre-defined connection set
# 5. 181h to 57Fh with a node-ID: a PDO without a description (`unmapped`); all others are `raw`
#
# Whatever may change an answer of `_route` must take the CAN-ID out of the cache and add to
# `changes`: `_refresh` does it for PDOs, `_configure` for the others. `changes` is how
# `ColumnNodes` detects that it has to continue frame by frame.
#
# What is learnt, and its effects:
#
# - a transfer that ended well (`_learn`): values of the communication area go into
#   `NodeMemory`; 1400h to 1BFFh define the PDO again, COB-ID objects are learnt, and whether a node
#   is a drive changes the names of its objects, so all its known PDOs are defined again;
# - a boot-up: the node has its power-on values again, unless it stored others (1010h);
# - a guarding request (700h + node-ID, RTR): the next frame on this CAN-ID is an answer
#   with a toggle bit and no heartbeat. Without a request, a set bit 7 identifies it;
# - vendor, product or revision of 1018h: `EdsFiles` may have a file for the node. Its objects and
#   PDOs count from then on; values from traffic take precedence, as always.
#
# `effect` must stay true to all of this: it tells a block-wise reader which frames it may skip. A
# new way to learn from a frame needs its line there, or `canmon nodes` of a log shows something
# else than the same log frame by frame (test_column_nodes.py compares the two).
#
# SDO channels are one for each server and request CAN-ID (sdo.py); imports of rare decoders
# stand in functions because `canmon check` of three lines has to start quickly
# (tests/test_start_up.py).

Route = Callable[[int, CanFrame], Decoded]
"""Function that decodes the frames of a CAN-ID, each with its time."""

_SYNC_ID: Final = 0x080
_TIME_ID: Final = 0x100
_PDO_IDS: Final = range(0x181, 0x580)
_SDO_IDS: Final = range(0x581, 0x680)
_NODE_MASK: Final = 0x7F
COB_ID_SYNC, COB_ID_TIME, COB_ID_EMCY = 0x1005, 0x1012, 0x1014
_SDO_SERVERS: Final = range(0x1201, 0x1280)
_IDENTITY: Final = 0x1018
TEACHING: Final = frozenset(
    {
        *(node_memory.DEVICE_TYPE[0], node_memory.HEARTBEAT_TIME[0], node_memory.STORE, _IDENTITY),
        *(COB_ID_SYNC, COB_ID_TIME, COB_ID_EMCY, *_SDO_SERVERS, *PDO_OBJECTS),
    }
)
"""Objects whose value can change what other frames mean, as 6041h can if it was never seen."""
_PRE_DEFINED: Final[dict[int, Route]] = {
    NMT_COB_ID: services.decode_nmt,
    _SYNC_ID: services.decode_sync,
    _TIME_ID: services.decode_time,
    LSS_MASTER_COB_ID: services.decode_lss,
    LSS_SLAVE_COB_ID: services.decode_lss,
}


class Effect(IntEnum):
    """Which frames of a CAN-ID can change what is known about nodes."""

    NONE = 0
    LATEST = 1
    """The latest frame of each length, until a frame of `EACH` or a boot-up comes: a TPDO."""
    ALONE = 2
    """Each frame, but without effect on PDOs, except for boot-ups: error control, EMCY."""
    EACH = 3


class BusDecoder:
    """Decoder for the frames of one bus, which learns from the frames how to decode later ones.

    At first, the CAN-IDs have the meanings of the pre-defined connection set. An EDS file or SDO
    traffic may change them, for example by a new COB-ID or PDO mapping (1005h, 1012h, 1014h,
    1201h.., 1400h.. to 1A00h..).

    Args:
        eds: objects and values from EDS files, by node-ID.
        files: EDS files that are chosen by the identity of further nodes, or None for none.
        channel: name of the bus, used in messages about chosen files.

    Attributes:
        changes: counter that grows whenever the meaning of a CAN-ID may have changed.
        renamed: counter that grows whenever the description of an object may have changed.
        sdo_moved: whether a CAN-ID that the pre-defined connection set uses for SDO has another
            meaning.
        guarded: node-IDs of nodes that were sent a guarding request, and have not answered yet.
    """

    def __init__(
        self,
        eds: Mapping[int, node_memory.EdsObjects],
        files: EdsFiles | None = None,
        channel: str = "",
    ) -> None:
        self._eds, self.changes, self.renamed, self.sdo_moved = eds, 0, 0, False
        self._files, self._channel = files, channel
        self._memories: dict[int, node_memory.NodeMemory] = {}
        self._channels: dict[tuple[int, int], SdoChannel] = {}
        self.guarded: set[int] = set()
        self._pdos = PdoTable()
        self._configured: dict[int, Route] = {}
        self._routes: dict[int, Route] = {}
        for node, objects in eds.items():
            self._refresh(pdos_of(node, (index for index, _ in objects.values)))
            for index in (COB_ID_SYNC, COB_ID_TIME, COB_ID_EMCY, *_SDO_SERVERS):
                self._learn_cob_ids(node, index)

    def take(self, at_us: int, frame: CanFrame) -> Decoded:
        """Decode a frame with an 11-bit identifier."""
        route = self._routes.get(frame.can_id) or self._routed(frame.can_id)
        return route(at_us, frame)

    def effect(self, can_id: int) -> Effect:
        """Return which frames with a CAN-ID can change the knowledge about nodes."""
        route = self._routed(can_id)
        if isinstance(route, partial):
            if route.func is _unmapped:
                return Effect.NONE if sender_of(can_id) is None else Effect.LATEST
            alone = route.func in (self._error_control, _emcy)
            return Effect.ALONE if alone else Effect.EACH
        layout = getattr(route, "__self__", None)
        # A TPDO shows at most its latest values; an RPDO changes nothing that is known of
        # its node.
        if isinstance(layout, PdoDecoder):
            return Effect.LATEST if layout.kind.startswith("tpdo") else Effect.NONE
        return Effect.NONE if layout is None and route is not services.decode_nmt else Effect.EACH

    def lasting(self, can_id: int) -> Route | None:
        """Return the function that decodes a CAN-ID, if its frames can be decoded independently.

        The result is None for error control, SDO and multiplexed PDOs, because their meaning
        depends on earlier frames. The function is valid until the counter `BusDecoder.changes`
        grows.

        Args:
            can_id: CAN-ID with 11 bits.
        """
        route = self._routed(can_id)
        told = route.func if isinstance(route, partial) else route
        by_frame = told in (_unmapped, _emcy, _raw, *_PRE_DEFINED.values())
        return route if by_frame or self.layout(can_id) is not None else None

    def layout(self, can_id: int) -> PdoDecoder | None:
        """Return the PDO decoder of a CAN-ID.

        The result is None if the CAN-ID belongs to no PDO, or to a multiplexed PDO.
        """
        layout = getattr(self._routed(can_id), "__self__", None)
        return layout if isinstance(layout, PdoDecoder) else None

    @property
    def version(self) -> int:
        """A number that grows with each possible change of what frames and objects mean."""
        return self.changes + self.renamed

    def sdo(self, can_id: int) -> tuple[SdoChannel, bool] | None:
        """Return the SDO channel of a CAN-ID, and whether the client sends its frames.

        The result is a pair of the channel and a bool. The bool is True if the client sends the
        frames with this CAN-ID, or False if the server sends them. If frames with this CAN-ID are
        not SDO frames, the result is None. A result is valid until the counter `BusDecoder.changes`
        grows.

        Args:
            can_id: CAN-ID with 11 bits.
        """
        route = self._routed(can_id)
        if not isinstance(route, partial) or route.func != self._sdo:
            return None
        take = route.args[1]
        return take.__self__, take.__name__ == "request"

    def error_control(self, can_id: int) -> int | None:
        """Return the node whose heartbeats have a CAN-ID, or None; valid until `changes` grows."""
        route = self._routed(can_id)
        if not isinstance(route, partial) or route.func != self._error_control:
            return None
        return int(route.args[0])

    def answers_guarding(self, node: int) -> bool:
        """Return whether a node answers node guarding requests.

        If a node has a producer heartbeat time (1017h), the result is False, because the node then
        sends heartbeats instead (CiA 301, error control).

        Args:
            node: node-ID of the node.
        """
        return not self.memory(node).number(*node_memory.HEARTBEAT_TIME)

    def guard(self, node: int, *, requested: bool) -> None:
        """Store whether the latest error control frame of a node was a guarding request.

        If it was a request, the next error control frame is decoded as the answer of the node.

        Args:
            node: node-ID of the node.
            requested: whether the latest frame was a guarding request.
        """
        if requested:
            self.guarded.add(node)
        else:
            self.guarded.discard(node)

    def pending(self, now_us: int) -> tuple[Transfer, ...]:
        """Return the running SDO transfers."""
        found = (channel.pending(now_us) for channel in self._channels.values())
        return tuple(self.named(transfer) for transfer in found if transfer)

    def memory(self, node: int) -> node_memory.NodeMemory:
        """Return what is known about a node."""
        memory = self._memories.get(node)
        if memory is None:
            memory = self._memories[node] = node_memory.NodeMemory(self._eds.get(node))
        return memory

    def _routed(self, can_id: int) -> Route:
        route = self._routes.get(can_id)
        if route is None:
            route = self._routes[can_id] = self._route(can_id)
        return route

    def _route(self, can_id: int) -> Route:
        told = self._configured.get(can_id) or _PRE_DEFINED.get(can_id)
        if told is not None:
            return told
        layout = self._pdos.layout(can_id)
        if layout is not None:
            return layout.decode
        node = can_id & _NODE_MASK
        return self._node_route(node, can_id) if node else _raw

    def _node_route(self, node: int, can_id: int) -> Route:
        """Return the meaning that the pre-defined connection set gives a CAN-ID with a node-ID."""
        match can_id - node:
            case 0x080:
                return partial(_emcy, node)
            case 0x580 | 0x600:
                return self._sdo_route(node, can_id, REQUEST_COB_ID + node)
            case 0x700:
                return partial(self._error_control, node)
            case _:
                return partial(_unmapped, node) if can_id in _PDO_IDS else _raw

    def _sdo_route(self, node: int, can_id: int, request_id: int) -> Route:
        from tickrig.host.canmon.model.decode.sdo import SdoChannel  # noqa: PLC0415 - not on every bus

        channel = self._channels.setdefault((node, request_id), SdoChannel(node))
        take = channel.request if can_id == request_id else channel.response
        return partial(self._sdo, node, take)

    def _error_control(self, node: int, at_us: int, frame: CanFrame) -> Decoded:
        guarded = node in self.guarded and self.answers_guarding(node)
        decoded = services.decode_error_control(node, frame, guarded=guarded)
        self.guard(node, requested=frame.remote)
        if decoded.kind == "boot-up" and self.memory(node).boot():
            self.renamed += 1
            indices = self.memory(node).indices
            self._refresh({*self._pdos.known(node), *pdos_of(node, indices)})
        return decoded

    def _sdo(
        self, node: int, take: Callable[[int, bytes], SdoStep], at_us: int, frame: CanFrame
    ) -> Decoded:
        if frame.remote:
            return Decoded("sdo", node, "remote frame")
        return self.sdo_step(node, take(at_us, frame.data))

    def sdo_step(self, node: int, step: SdoStep) -> Decoded:
        """Return the meaning of an SDO frame.

        If a transfer ended with the frame, the decoder may learn from the transferred value, for
        example a COB-ID.

        Args:
            node: node-ID of the SDO server.
            step: result of `SdoChannel` for the frame, such as its text and the transfers that
                ended with it.
        """
        if not step.ended:
            return Decoded(
                *("sdo", node, step.text, (), "", step.entry), asks=step.asks, flaw=step.flaw
            )
        for transfer in step.ended:
            self._learn(transfer)
        ended = tuple(self.named(transfer) for transfer in step.ended)
        last = ended[-1]
        signals, source = _signals(last), last.source
        said = Decoded("sdo", node, None, signals, source, step.entry, ended, step.asks)
        return said._replace(flaw=step.flaw) if step.flaw else said

    def named(self, transfer: Transfer) -> Transfer:
        """Return a transfer with name and value of its object."""
        entry, data, sized = transfer.entry, transfer.data, transfer.sized
        text = ObjectText() if entry is None else self.memory(transfer.node).describe(*entry)
        if data is None:
            return transfer.described(text.name, None, "", "", text.unit, text.source)
        value, written = text.read(data, sized=sized)
        length = _odd_length(text.kind, data, sized=sized)
        return transfer.described(text.name, value, written, length, text.unit, text.source)

    def _learn(self, transfer: Transfer) -> None:
        """Learn from a transferred value."""
        memory = self.memory(transfer.node)
        was_drive, entry = memory.is_drive, transfer.entry
        if not memory.learn(transfer) or entry is None:
            return
        if entry[0] in PDO_OBJECTS:
            self._refresh(pdos_of(transfer.node, (entry[0],)))
        self.renamed += memory.is_drive != was_drive
        if memory.is_drive != was_drive or entry == node_memory.DEVICE_TYPE:
            self._refresh(self._pdos.known(transfer.node))
        self._learn_cob_ids(transfer.node, entry[0])
        if entry[0] == _IDENTITY and self._files is not None:
            self._find_eds(self._files, transfer.node)

    def _find_eds(self, files: EdsFiles, node: int) -> None:
        """Search the file of a node by the values of 1018h that the node has sent."""
        memory = self.memory(node)
        entries = ((_IDENTITY, sub) for sub in (1, 2, 3))
        identity = node_identity(
            [memory.number(*one) if memory.was_received(one) else None for one in entries]
        )
        found = None if identity is None else files.find(self._channel, node, identity)
        if found is None:
            return
        memory.eds = found
        self.renamed += 1
        self._refresh({*self._pdos.known(node), *pdos_of(node, memory.indices)})
        for index in (COB_ID_SYNC, COB_ID_TIME, COB_ID_EMCY, *_SDO_SERVERS):
            self._learn_cob_ids(node, index)

    def _refresh(self, pdos: Iterable[NodePdo]) -> None:
        """Update the layout of some PDOs."""
        for pdo in pdos:
            self.changes += 1
            for can_id in self._pdos.update(pdo, self.memory(pdo.node)):
                self._forget(can_id)

    def _learn_cob_ids(self, node: int, index: int) -> None:
        """Learn a CAN-ID that differs from the pre-defined connection set."""
        if index in _SDO_SERVERS:
            request, response = (self._configured_id(node, index, sub) for sub in (1, 2))
            if request is not None and response is not None:
                self._configure(request, self._sdo_route(node, request, request))
                self._configure(response, self._sdo_route(node, response, request))
            return
        can_id = self._configured_id(node, index, 0)
        if can_id is None:
            return
        match index:
            case 0x1005:
                self._configure(can_id, services.decode_sync)
            case 0x1012:
                self._configure(can_id, services.decode_time)
            case 0x1014:
                self._configure(can_id, partial(_emcy, node))

    def _configured_id(self, node: int, index: int, sub: int) -> int | None:
        cob_id = self.memory(node).number(index, sub)
        # 1005h and 1012h: bits 31 and 30 say who consumes and produces, not that the object
        # is off.
        flags = EXTENDED if index in (COB_ID_SYNC, COB_ID_TIME) else EXTENDED | INVALID
        return None if cob_id is None or cob_id & flags else cob_id & CAN_ID_MASK

    def _configure(self, can_id: int, route: Route) -> None:
        self.changes += 1
        self._configured[can_id] = route
        self._forget(can_id)

    def _forget(self, can_id: int) -> None:
        self._routes.pop(can_id, None)
        self.sdo_moved |= can_id in _SDO_IDS


def _odd_length(kind: DataType | None, data: bytes, *, sized: bool) -> str:
    """Report a number of bytes that was not indicated, or that does not fit the data type."""
    if not sized:
        return "" if kind is not None and kind.size == len(data) else "size not indicated"
    if kind is None or not kind.size or kind.size == len(data):
        return ""
    return f"{len(data)} B where {kind.name} has {kind.size}"


def _signals(transfer: Transfer) -> tuple[Signal, ...]:
    told = (
        transfer.outcome is TransferOutcome.DONE
        and not transfer.flaws
        and transfer.entry is not None
    )
    if not told or transfer.value is None:
        return ()
    name = transfer.name or write_entry(transfer.entry)
    return (Signal(name, transfer.value, transfer.unit, transfer.text),)


def _emcy(node: int, at_us: int, frame: CanFrame) -> Decoded:
    return services.decode_emcy(node, frame)


def _unmapped(node: int, at_us: int, frame: CanFrame) -> Decoded:
    return Decoded("unmapped", node, "RTR" if frame.remote else "mapping unknown")


def _raw(at_us: int, frame: CanFrame) -> Decoded:
    return Decoded("raw")


def data_that_counts(route: Route) -> int:
    """Return a mask of the data bits that affect the meaning of the frames of a CAN-ID.

    Frames with equal values of these bits have the same meaning, so only one of them must be
    decoded. If the mask is 0, neither the data nor the number of data bytes affects the meaning.

    Args:
        route: function that decodes the frames of the CAN-ID.

    Returns:
        The mask, for data that are read as a little-endian number.
    """
    told = route.func if isinstance(route, partial) else route
    if told in (_unmapped, _raw):
        return 0
    return 0xFF if told is services.decode_sync else (1 << 64) - 1


FD: Final = Decoded("fd", None, "no CANopen service")
"""Meaning of a CAN FD frame. CANopen uses classic frames (CiA 301, 5.3). CANopen FD differs."""

_NO_EDS: Final[Mapping[int, Path | node_memory.EdsObjects]] = MappingProxyType({})


class FrameDecoder(Protocol):
    """Decoder of frames that neither the standard nor a DBC file describes."""

    def decode(self, record: Record) -> Decoded | None:
        """Return the meaning of a frame, or None for a frame of another protocol."""


class Decoder:
    """Decoder for the frames of any number of buses, which must come in the order of their times.

    It learns from the frames how to decode later ones. Each bus has its own nodes.

    Args:
        eds: EDS or DCF files by node-ID, each as a path or as its content. They apply to every bus.
            If it is an `EdsFiles` object with a folder, the files of further nodes are chosen by
            the identity in the traffic.
        dbc: paths of DBC files, which take precedence for the CAN-IDs that they describe.
        first: decoders that are tried before all others, such as those of installed packages.

    Attributes:
        first: decoders that are tried before all others, followed by those of the DBC files.

    Raises:
        OSError: a file cannot be read.
        EdsError: an EDS is malformed.
        DbcError: a DBC file is malformed, or the package cantools is not installed.
    """

    def __init__(
        self,
        eds: Mapping[int, Path | node_memory.EdsObjects] = _NO_EDS,
        dbc: Sequence[Path] = (),
        first: Sequence[FrameDecoder] = (),
    ) -> None:
        self._eds = {
            node: node_memory.read_eds_objects(item, node) if isinstance(item, Path) else item
            for node, item in eds.items()
        }
        self._files = eds if isinstance(eds, EdsFiles) and eds.folder is not None else None
        self.first: tuple[FrameDecoder, ...] = (*first, *map(DbcFile, dbc))
        self._buses: dict[str, BusDecoder] = {}

    @property
    def standard(self) -> bool:
        """Whether only the standard, EDS files and traffic define the meaning of frames."""
        return not self.first

    def take(self, record: Record) -> Decoded:
        """Decode a frame, and learn from the frame."""
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

    def take_excerpts(
        self, excerpts: Mapping[int, tuple[int, Sequence[Record]]]
    ) -> dict[int, tuple[int, list[tuple[Record, Decoded]]]]:
        """Decode excerpts of a log. A frame that several of them contain is decoded once.

        Args:
            excerpts: excerpts by any key. Each is the number of its first frame in the log, and
                its frames.
        """
        taken: dict[int, Decoded] = {}
        for first, records in sorted(excerpts.values(), key=itemgetter(0)):
            for number, record in enumerate(records, first):
                if number not in taken:
                    taken[number] = self.take(record)
        return {
            key: (first, [(one, taken[number]) for number, one in enumerate(records, first)])
            for key, (first, records) in excerpts.items()
        }

    def pending(self, now_us: int) -> tuple[Transfer, ...]:
        """Return the running SDO transfers, as if they ended now."""
        return tuple(item for bus in self._buses.values() for item in bus.pending(now_us))

    def memory(self, channel: str, node: int) -> node_memory.NodeMemory:
        """Return what is known about a node."""
        return self.bus(channel).memory(node)

    def bus(self, channel: str) -> BusDecoder:
        """Return the decoder of a bus."""
        bus = self._buses.get(channel)
        if bus is None:
            bus = self._buses[channel] = BusDecoder(self._eds, self._files, channel)
        return bus
