"""The state of all nodes, as rows, as text and as JSON, and a card of each node.

The module also describes the known identity of a node, and the known contents of its PDOs.

>>> from tickrig.host.canmon.model.decode.node_memory import EdsObjects, NodeMemory
>>> values = {(0x1000, 0): 0x20192, (0x1018, 1): 0x13F, (0x1018, 3): 0x10002, (0x1A00, 0): 1}
>>> values[0x1A00, 1] = 0x60410010
>>> eds = EdsObjects({}, {at: value.to_bytes(4, "little") for at, value in values.items()})
>>> row = NodeStatus("can0", 5, NodeMemory(eds))
>>> told_identity(row)
'EDS: CiA 402 drive, vendor 0000013Fh, revision 1.2'
>>> [(pdo.kind, hex(pdo.can_id), pdo.text) for pdo in pdo_contents(row)]
[('tpdo1', '0x185', 'statusword (eds)')]
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded, Transfer, TransferOutcome, write_entry
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import (
    DEVICE_TYPE,
    HEARTBEAT_TIME,
    LATE,
    PAIR_US,
    Heartbeats,
    NodeMemory,
    drive_state,
    two_beats,
)
from tickrig.host.canmon.model.decode.pdos import (
    DUMMIES,
    MPDO,
    UNMAPPED,
    can_id_of,
    mapped_objects,
    pdos_of,
)
from tickrig.host.canmon.model.decode.services import nmt_state_name
from tickrig.host.canmon.model.frames import Record, Stamp, ident_of, sender_of, stamp_text
from tickrig.host.text.page_text import json_text
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.emcy import describe
from tickrig.wire.canopen.nmt import COMMANDED, NmtState
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS

# All nodes at a glance: states, heartbeats, boot-ups, EMCYs, SDO errors, drives.

_EMCY_KEPT: Final = 16
_BEATS_KEPT: Final = 12
_DEVICE_NAME: Final = (0x1008, 0)
_FROM_EDS: Final = " (EDS)"


class _EmcyRecord(NamedTuple):
    """An EMCY with its time."""

    at_us: int
    code: int
    text: str


@dataclass(slots=True)
class NodeStatus:
    """One row of the node board.

    Args:
        channel: name of the node's bus.
        node: node-ID of the node.
        memory: known objects of the node.

    Attributes:
        state: last reported NMT state, or None before the first report.
        commanded: state that the NMT master has commanded since, or None after the node has
            reported its state.
        boots: number of boot-up messages.
        unrequested_boots: number of boot-ups without an NMT command that follow an earlier frame of
            the node.
        late: gaps between heartbeats that were longer than `LATE` periods, and such gaps before a
            boot-up without an NMT command.
        emcys: latest EMCY messages. The oldest is first.
        emcy_count: number of all EMCY messages.
        error_code: error code of the latest EMCY, or 0 if it cleared an error.
        sdo_errors: number of transfers that were aborted, unanswered or incomplete.
        sdo_error: last of these transfers, in words.
        drive_state: state of CiA 402, empty before the first statusword.
        name: device name that the node reported.
        present: whether the node has sent a frame that is known to be its own.
        pdos: latest frame of each PDO of the node, by kind.
        heartbeats: heartbeats of the node, and their period.
        doubled: whether two nodes have this node-ID, according to heartbeats and boot-ups. The row
            then mixes both nodes, and the gaps do not give a period.
    """

    channel: str
    node: int
    memory: NodeMemory
    state: int | None = None
    commanded: int | None = None
    boots: int = 0
    unrequested_boots: int = 0
    late: int = 0
    emcys: deque[_EmcyRecord] = field(default_factory=lambda: deque(maxlen=_EMCY_KEPT))
    emcy_count: int = 0
    error_code: int = 0
    sdo_errors: int = 0
    sdo_error: str = ""
    drive_state: str = ""
    name: str = ""
    present: bool = False
    pdos: dict[str, Decoded] = field(default_factory=dict)
    doubled: bool = False
    _reset_requested: bool = False
    heartbeats: Heartbeats = field(init=False)
    _beats_us: deque[int] = field(default_factory=lambda: deque(maxlen=_BEATS_KEPT))
    _each_us: int = 0  # the period of each of two nodes
    _alike: int = 0  # gaps in a row that are as long as the one before
    _booted_us: int | None = None

    def __post_init__(self) -> None:
        """Prepare for the first heartbeat."""
        self.heartbeats = Heartbeats(self.memory)

    @property
    def known_name(self) -> str:
        """Name that the node reported, or else the name in its EDS file."""
        return self.name or self.memory.eds.name

    def age_us(self, now_us: int) -> int | None:
        """Return the time since the last reported state."""
        last_us = self.heartbeats.last_us
        return None if last_us is None else now_us - last_us

    def is_late(self, now_us: int) -> bool:
        """Return whether a heartbeat is missing."""
        if self._each_us:
            return now_us - self._beats_us[-1] > LATE * self._each_us
        return self.heartbeats.is_late(now_us)

    @property
    def state_text(self) -> str:
        """The NMT state of the node as text, such as `operational`, or `?` if it is unknown.

        If the master has since commanded another state, that state follows after an arrow.
        """
        told = "?" if self.state is None else nmt_state_name(self.state)
        if self.commanded in (None, self.state):
            return told
        return f"{told} -> {nmt_state_name(self.commanded or 0)}"

    def command(self, specifier: int) -> None:
        """Process an NMT command to the node."""
        self.commanded = COMMANDED.get(specifier, NmtState.INITIALISING)
        self._reset_requested = self.commanded is NmtState.INITIALISING

    def boot(self, at_us: int) -> None:
        """Process a boot-up. The node is then pre-operational (CiA 301, boot-up)."""
        self.boots += 1
        if self._booted_us is not None and not self._reset_requested:
            self.doubled |= 0 <= at_us - self._booted_us <= PAIR_US
        self._booted_us = at_us
        self.late += not self._reset_requested and self.is_late(at_us)
        self._beats_us.clear()
        self._each_us = self._alike = 0
        self.unrequested_boots += self.present and not self._reset_requested
        self._reset_requested, self.drive_state, self.error_code = False, "", 0
        self.heartbeats.boot(at_us)
        self._report(NmtState.PRE_OPERATIONAL)

    def heartbeat(self, at_us: int, state: int) -> None:
        """Process a heartbeat, or the answer to a guarding request."""
        self.late += self.is_late(at_us)
        self.heartbeats.take(at_us)
        self._count_heartbeat(at_us)
        self._report(state)

    def _count_heartbeat(self, at_us: int) -> None:
        """Detect a second heartbeat beside the first, and its end."""
        self._beats_us.append(at_us)
        gaps = [b - a for a, b in pairwise(list(self._beats_us)[-3:])]
        alike = len(gaps) < 2 or abs(gaps[1] - gaps[0]) <= 0.2 * max(map(abs, gaps))
        self._alike = self._alike + 1 if alike else 0
        if alike and not self._each_us:  # nearly always
            return
        found = None if self._alike >= _BEATS_KEPT else two_beats(list(self._beats_us))
        self._each_us = 0 if found is None else found.period_us
        self.doubled = found is not None

    def _report(self, state: int) -> None:
        self.state, self.commanded, self.present = state, None, True

    def emcy(self, at_us: int, decoded: Decoded) -> None:
        """Process an EMCY."""
        self.present = True
        if not decoded.signals:
            return
        code = decoded.signals[0].value
        assert isinstance(code, int)
        self.emcy_count += 1
        self.error_code = code
        self.emcys.append(_EmcyRecord(at_us, code, decoded.text))

    def transfer(self, at_us: int, transfer: Transfer) -> None:
        """Process an SDO transfer that ended."""
        self.present = self.present or transfer.outcome.answered
        if transfer.outcome is not TransferOutcome.DONE:
            self.sdo_errors += 1
            self.sdo_error = str(transfer)
        elif transfer.entry == HEARTBEAT_TIME:
            self.heartbeats.learn(at_us, transfer)
        elif transfer.entry == _DEVICE_NAME and isinstance(transfer.value, str):
            self.name = transfer.value


STATUSWORD_NAME: Final = "statusword"
_ERROR_CONTROL: Final = ("heartbeat", "guard")


class NodeBoard:
    """The status of all nodes, updated with each decoded frame, as in `canmon nodes`.

    A node is added when it first reports its NMT state, sends an EMCY, or answers an SDO request.
    It is also added with its first PDO, if the PDO is known to belong to the node, or if its CAN-ID
    has the meaning of the pre-defined connection set. A node with an EDS file is added at the
    beginning.

    Args:
        decoder: decoder of the frames, from which the known objects of the nodes are taken.
        expected: names of the nodes with an EDS file, by node-ID. They are added to the first bus
            with a frame.
    """

    def __init__(self, decoder: Decoder, expected: Mapping[int, str] | None = None) -> None:
        self._decoder = decoder
        self._expected = dict(expected or {})
        self._nodes: dict[tuple[str, int], NodeStatus] = {}
        self.now_us = 0

    def rows(self) -> list[NodeStatus]:
        """Return the nodes by bus and node-ID."""
        return [self._nodes[key] for key in sorted(self._nodes)]

    def row(self, channel: str, node: int) -> NodeStatus | None:
        """Return a node, or None if the node is not on the board."""
        return self._nodes.get((channel, node))

    def take(self, record: Record, decoded: Decoded) -> None:
        """Process a decoded frame."""
        self.now_us = max(self.now_us, record.at_us)
        if self._expected:
            self._expect(record.channel)
        kind, node = decoded.kind, decoded.node
        if kind == "nmt":
            self._command(record.channel, decoded)
        elif node is None:
            return
        elif kind.startswith("tpdo"):
            self._process_data(record.channel, node, decoded)
        elif kind.startswith("rpdo"):
            if (status := self._nodes.get((record.channel, node))) is not None:
                status.pdos[kind] = decoded
        elif kind == UNMAPPED:
            if isinstance(record.frame, CanFrame) and sender_of(ident_of(record.frame)):
                self._status(record.channel, node).present = True
        elif kind == "sdo":
            self._transfers(record, node, decoded)
        elif kind == "emcy":
            self._status(record.channel, node).emcy(record.at_us, decoded)
        elif kind == "boot-up":
            self._status(record.channel, node).boot(record.at_us)
        elif kind in _ERROR_CONTROL and decoded.signals:
            state = decoded.signals[0].value
            assert isinstance(state, int)
            self._status(record.channel, node).heartbeat(record.at_us, state)

    def _status(self, channel: str, node: int) -> NodeStatus:
        status = self._nodes.get((channel, node))
        if status is None:
            memory = self._decoder.memory(channel, node)
            status = self._nodes[channel, node] = NodeStatus(channel, node, memory)
        return status

    def _expect(self, channel: str) -> None:
        for node, name in self._expected.items():
            self._status(channel, node).name = name
        self._expected.clear()

    def _command(self, channel: str, decoded: Decoded) -> None:
        if not decoded.signals:
            return
        specifier = decoded.signals[0].value
        assert isinstance(specifier, int)
        for (bus, node), status in self._nodes.items():
            if bus == channel and decoded.node in (None, node):
                status.command(specifier)

    def _process_data(self, channel: str, node: int, decoded: Decoded) -> None:
        status = self._status(channel, node)
        status.present, status.pdos[decoded.kind] = True, decoded
        for signal in decoded.signals:
            if signal.name == STATUSWORD_NAME and isinstance(signal.value, int):
                status.drive_state = drive_state(signal.value)

    def _transfers(self, record: Record, node: int, decoded: Decoded) -> None:
        channel = record.channel
        for transfer in decoded.transfers:
            answered = transfer.outcome.answered
            if answered or (channel, node) in self._nodes:
                self._status(channel, node).transfer(record.at_us, transfer)
            if transfer.name == STATUSWORD_NAME and isinstance(transfer.value, int):
                self._status(channel, node).drive_state = drive_state(transfer.value)


# The node board as lines of text, and as JSON.

_VERSION: Final = 1
_GAP: Final = "  "
_BAR_CELLS: Final = 5
FROM_TWO_NODES: Final = "from two nodes"
"""Text in place of a heartbeat period if two nodes have one node-ID."""
_HEADS: Final = ("NODE", "NAME", "NMT STATE", "HEARTBEAT", "BOOT-UPS", "DRIVE", "EMCY", "SDO ERROR")


def render_board(board: NodeBoard, now_us: int, width: int, height: int) -> list[str]:
    """Return the node board as lines of text: a table of the nodes, and the latest EMCYs below.

    Args:
        board: board with the status of the nodes.
        now_us: current time in microseconds, used for the age of entries.
        width: number of columns of the terminal.
        height: largest number of lines to return.
    """
    rows = board.rows()
    several = len({row.channel for row in rows}) > 1
    cells = [_HEADS, *(_cells(row, now_us, with_bus=several) for row in rows)]
    used = [column for column in range(len(_HEADS)) if any(line[column] for line in cells[1:])]
    widths = {column: max(len(line[column]) for line in cells) for column in used}
    lines = [_GAP.join(line[column].ljust(widths[column]) for column in used) for line in cells]
    if not rows:
        lines = ["no node has sent a frame"]
    lines += emcy_history(rows)
    return [_cut(line.rstrip(), width) for line in lines[:height]]


def board_json(board: NodeBoard, now_us: int) -> list[str]:
    """Return one JSON object per node."""
    return [json_text(_fields(row, now_us)) for row in board.rows()]


def _cells(row: NodeStatus, now_us: int, *, with_bus: bool) -> tuple[str, ...]:
    boots = str(row.boots or "")
    boots += f" ({row.unrequested_boots} unasked)" if row.unrequested_boots else ""
    return (
        f"{row.channel} {row.node}" if with_bus else str(row.node),
        name_text(row),
        row.state_text,
        _heartbeat(row, now_us),
        boots,
        row.drive_state,
        _emcy(row),
        f"{row.sdo_error} [{row.sdo_errors}]" if row.sdo_errors else "",
    )


def _heartbeat(row: NodeStatus, now_us: int) -> str:
    """Return age, period, and the elapsed part of one and a half periods as text."""
    age_us, period_us = row.age_us(now_us), row.heartbeats.period_us
    if age_us is None:
        return "never seen" if period_us else ""
    if row.doubled:
        return FROM_TWO_NODES + " LATE" * row.is_late(now_us)
    if period_us is None:
        return f"{age_us // 1_000} ms ago"
    share = min(_BAR_CELLS, age_us * _BAR_CELLS * 2 // (3 * period_us))
    bar = "#" * share + "." * (_BAR_CELLS - share)
    about = "~" if row.heartbeats.learnt else ""
    words = [f"{bar} {age_us // 1_000}/{about}{period_us // 1_000} ms"]
    words += ["LATE"] if row.is_late(now_us) else []
    words += [f"late so far: {row.late}"] if row.late else []
    return " ".join(words)


def _emcy(row: NodeStatus) -> str:
    if not row.emcy_count:
        return ""
    now = f"{row.error_code:04X}h {describe(row.error_code)}" if row.error_code else "gone"
    return f"{now} [{row.emcy_count}]"


def emcy_history(
    rows: Sequence[NodeStatus], stamp: Stamp = Stamp.ABSOLUTE, origin_us: int = 0
) -> list[str]:
    """Return the EMCYs of all nodes as lines of text, from the latest to the oldest.

    An empty line and a header come first. If there are no EMCYs, the list is empty.

    Args:
        rows: status of each node, with its EMCYs.
        stamp: format in which times are written.
        origin_us: time of the first frame in microseconds.
    """
    found = sorted((emcy.at_us, row.node, emcy.text) for row in rows for emcy in row.emcys)
    before = [origin_us, *(at_us for at_us, _, _ in found)]
    lines = [
        f"{stamp_text(stamp, at_us, origin_us, before_us)}  node {node}  {text}"
        for (at_us, node, text), before_us in zip(found, before, strict=False)
    ][::-1]
    return ["", "EMCY, latest first", *lines] if lines else []


def _cut(line: str, width: int) -> str:
    return line if len(line) <= width else line[: width - 1] + "…"


def _fields(row: NodeStatus, now_us: int) -> dict[str, object]:
    age_us, period_us = row.age_us(now_us), row.heartbeats.period_us
    return {
        "v": _VERSION,
        "ev": "node",
        "t": now_us / 1e6,
        "ch": row.channel,
        "node": row.node,
        "name": row.known_name,
        "state": row.state_text,
        "heartbeat_ms": None if period_us is None or row.doubled else period_us / 1_000,
        "learnt": row.heartbeats.learnt,
        "doubled": row.doubled,
        "age_ms": None if age_us is None else age_us / 1_000,
        "late": row.is_late(now_us),
        "late_count": row.late,
        "boots": row.boots,
        "unasked_boots": row.unrequested_boots,
        "drive": row.drive_state,
        "error_code": row.error_code,
        "emcy": [{"t": e.at_us / 1e6, "code": e.code, "text": e.text} for e in row.emcys],
        "sdo_errors": row.sdo_errors,
        "sdo_error": row.sdo_error,
    }


_IDENTITY: Final = 0x1018
_PROFILES: Final = {401: "I/O", 402: "drive", 405: "PLC", 406: "encoder", 410: "inclinometer"}


class _PdoContent(NamedTuple):
    """The content of a PDO that has a CAN-ID.

    Attributes:
        kind: kind as in `Decoded`.
        can_id: CAN-ID of the PDO.
        receives: whether the node receives the PDO.
        names: names of the objects in the PDO, empty if the mapping is unknown.
        text: names with their source, and with their latest values if the PDO was sent.
    """

    kind: str
    can_id: int
    receives: bool
    names: tuple[str, ...]
    text: str


def pdo_contents(row: NodeStatus) -> list[_PdoContent]:
    """Return the known PDOs of a node with their CAN-IDs and mapped objects, for display.

    PDOs that the node sends precede PDOs that it receives.

    Args:
        row: status of the node.
    """
    memory, found = row.memory, list[_PdoContent]()
    for pdo in sorted(pdos_of(row.node, memory.indices)):
        can_id, count = can_id_of(pdo, memory), memory.number(pdo.mapping, 0)
        if can_id is None or count == 0:
            continue
        source = memory.source(pdo.mapping) or memory.source(pdo.parameter)
        names: tuple[str, ...] = ()
        if count is None:
            text = "mapping unknown"
        elif count in MPDO:
            text = f"multiplexed: each frame names its object ({source})"
        else:
            names = _names(memory, pdo.mapping, min(count, MAX_MAPPED_OBJECTS))
            heard = row.pdos.get(pdo.kind)
            text = f"{heard.text if heard else ', '.join(names)} ({source})"
        found.append(_PdoContent(pdo.kind, can_id, pdo.receives, names, text))
    return found


def _names(memory: NodeMemory, mapping: int, count: int) -> tuple[str, ...]:
    """Return the names of the mapped objects, without gaps that carry no object."""
    mapped = mapped_objects(memory, mapping, count)
    entries = [(item.index, item.sub) for item in mapped if item.index not in DUMMIES]
    return tuple(memory.describe(*entry).name or write_entry(entry) for entry in entries)


def maker_text(row: NodeStatus) -> str:
    """Return the vendor and product code of a node as a short text.

    The text has the name of the vendor from an EDS file, or otherwise the number of the vendor. If
    the values come only from the EDS file, a mark is added.

    Args:
        row: status of the node.
    """
    vendor, product = row.memory.number(_IDENTITY, 1), row.memory.number(_IDENTITY, 2)
    words = [row.memory.eds.vendor or ("" if not vendor else f"{vendor:08X}h")]
    words += [f"{product:08X}h"] if product else []
    text = " ".join(filter(None, words))
    read = row.memory.was_received((_IDENTITY, 1)) or row.memory.was_received((_IDENTITY, 2))
    return text + _FROM_EDS * bool(text and not read)


def name_text(row: NodeStatus) -> str:
    """Return the device name of a node as text.

    If the node has not sent its name, the name comes from an EDS file, and a mark is added.

    Args:
        row: status of the node.
    """
    name, told = row.known_name, row.memory.was_received(_DEVICE_NAME)
    return name + _FROM_EDS * bool(name and not told)


def told_identity(row: NodeStatus) -> str:
    """Return the identity of a node as text.

    The values that the node has sent come first, and further values from an EDS file follow. The
    serial number in an EDS file is left out, because it is not the number of the real device.

    Args:
        row: status of the node.
    """
    memory = row.memory

    def read(index: int, sub: int) -> int | None:
        return memory.number(index, sub) if memory.was_received((index, sub)) else None

    def other(index: int, sub: int) -> int | None:
        serial = (index, sub) == (_IDENTITY, 4)
        known = serial or memory.was_received((index, sub))
        return None if known else memory.number(index, sub)

    filed = _identity(other, memory.eds.vendor)
    return "; ".join(filter(None, [_identity(read, ""), f"EDS: {filed}" * bool(filed)]))


def _identity(number: Callable[[int, int], int | None], vendor_name: str) -> str:
    vendor, product, revision, serial = (number(_IDENTITY, sub) for sub in range(1, 5))
    maker = " ".join(filter(None, [vendor_name, _hex(vendor)]))
    device_type = number(*DEVICE_TYPE)
    words = ["" if device_type is None else profile_text(device_type)]
    words += [f"vendor {maker}"] * bool(maker)
    words += [f"product {_hex(product)}"] * (product is not None)
    if revision is not None:
        words.append(f"revision {revision >> 16}.{revision & 0xFFFF}")
    words += [f"serial {serial}"] * bool(serial)
    return ", ".join(filter(None, words))


def _hex(number: int | None) -> str:
    return "" if number is None else f"{number:08X}h"


def profile_text(device_type: int) -> str:
    """Return the profile of a device type (1000h) in words.

    >>> profile_text(0x20192), profile_text(0x0), profile_text(0xFFFF0191)
    ('CiA 402 drive', 'no profile', 'CiA 401 I/O')
    """
    profile = device_type & 0xFFFF
    name = _PROFILES.get(profile, "")
    return f"CiA {profile} {name}".rstrip() if profile else "no profile"
