"""The services of CANopen nodes in a log, which are NMT, error control, EMCY and SDO."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal, NamedTuple

from tickrig.host.canmon.model.check.bus_frames import BusFrames, Hit
from tickrig.host.canmon.model.decode import decoded
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import PAIR_US, STATUSWORD, drive_state
from tickrig.host.canmon.model.decode.sdo import WRONG_TOGGLE
from tickrig.host.canmon.model.decode.services import nmt_state_name
from tickrig.host.canmon.model.frames import ERROR, REMOTE, Record, ms_text
from tickrig.host.text.values import counted
from tickrig.wire.can import STANDARD_MAX, ErrorFrame, describe_error_frame
from tickrig.wire.canopen import nmt, sdo_frame
from tickrig.wire.canopen.emcy import describe

EMCY_IDS: Final = range(0x081, 0x100)
PDO_IDS: Final = range(0x181, 0x580)
RESPONSE_IDS: Final = range(0x581, 0x600)
REQUEST_IDS: Final = range(0x601, 0x680)
ERROR_CONTROL_IDS: Final = range(0x701, 0x780)
SYNC_ID: Final = 0x080
TIME_ID: Final = 0x100
LSS_IDS: Final = (0x7E4, 0x7E5)
NODE_MASK: Final = 0x7F
FAULT: Final = 0x08
"""The fault bit of a CiA 402 statusword."""
_TOGGLE: Final = 0x80
_STATES: Final = frozenset(map(int, nmt.NmtState))
_COMMANDS: Final = frozenset(map(int, nmt.NmtCommand))
_ANSWER_US: Final = 50_000
"""Longest time from a remote frame to the error control frame that answers it."""
_PATIENCE_US: Final = 1_000_000
"""Time in which an SDO request at the end of a log may still be answered."""
_OBEYS_US: Final = 1_000_000
"""Time within which a node follows an NMT command."""
_PDO_PARAMETERS: Final = range(0x1400, 0x1C00)
_SYNC_PARAMETERS: Final = range(0x1005, 0x1008)
_HEARTBEAT_TIME: Final = 0x1017
IDENTITY: Final = 0x1018
_TOGGLE_ABORT: Final = 0x0503_0000
_SENT: Final = (0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700)
"""Frames that a node sends by the pre-defined connection set, as COB-IDs without the node-ID."""

RULES: Final = {
    "no-error-frames": "error frames",
    "no-emcy": "an error that a node reports (EMCY)",
    "no-reboot": "a boot-up without an NMT reset of a node that sent frames before",
    "nmt-stop": "an NMT stop",
    "nmt-state": "an NMT state without a command",
    "guard-toggle": "a guarding answer with a wrong toggle bit",
    "remote-heartbeat": "a remote frame to a node that sends heartbeats",
    "doubled-node": "two nodes with one node-ID",
    "no-sdo-abort": "aborted SDO transfers",
    "sdo-unanswered": "SDO requests without an answer",
    "sdo-toggle": "an SDO segment with a wrong toggle bit",
}
"""Descriptions of the rules that this module judges, by name."""


class Cut(NamedTuple):
    """An event after which frames may have another rhythm, such as an NMT command or a boot-up.

    The rhythm is measured separately before and after the event.

    Attributes:
        at_us: time of the event in microseconds.
        node: node-ID of the node whose frames may change, or 0 for all nodes.
    """

    at_us: int
    node: int


class BeatEvent(NamedTuple):
    """An event after which the heartbeats of a node begin again.

    Attributes:
        at_us: time of the event in microseconds.
        row: index of the event's frame in `BusFrames`.
        kind: `order` is an NMT reset or a write to 1017h, `excuse` is a boot-up after an NMT reset,
            and `boot` is a boot-up without an NMT reset. If heartbeats are missing before `order`
            or `boot`, this is a fault. If they are missing before `excuse`, this is no fault,
            because the node was reset.
    """

    at_us: int
    row: int
    kind: Literal["boot", "order", "excuse"]


@dataclass(slots=True)
class NodeEvents:
    """Events of one node in a log, such as its heartbeats, guarding answers and boot-ups.

    Rows are indices in `BusFrames`.

    Attributes:
        heartbeats: rows of heartbeats, which are error control frames that no remote frame
            requested.
        answers: rows of error control frames that a remote frame requested (node guarding).
        requested: rows of the remote frames that request the state of the node.
        boots: rows of boot-ups.
        beat_events: boot-ups, NMT resets, and writes to 1017h, in the order of their rows.
        toggled: whether any error control frame had the toggle bit set.
        state: NMT state that the node reported last, or None before its first report.
        identity: values that were read from 1018h, by sub-index, each with the row of its first
            answer.
    """

    heartbeats: list[int] = field(default_factory=list)
    answers: list[int] = field(default_factory=list)
    requested: list[int] = field(default_factory=list)
    boots: list[int] = field(default_factory=list)
    beat_events: list[BeatEvent] = field(default_factory=list)
    toggled: bool = False
    state: int | None = None
    command: tuple[int, int, int] | None = None  # when, the state that it wants, its row
    told_since: int = 0
    reset: bool = False
    fault: bool = False
    emcy: set[str] = field(default_factory=set)
    identity: dict[int, tuple[bytes | None, int]] = field(default_factory=dict)
    requests: int = 0
    latest_request: bytes = b""
    latest_answer: tuple[int, bytes, int] | None = None


def is_canopen(bus: BusFrames, rows: Mapping[int, Sequence[int]]) -> bool:
    """Return whether the frames of a bus appear to be CANopen.

    The CAN-IDs alone do not show it, because other protocols use the same CAN-IDs. Therefore the
    length and content of the frames of each CAN-ID are compared with CANopen. CAN-IDs that fit are
    weighed against CAN-IDs that do not.

    Args:
        bus: frames of the bus.
        rows: indices of the frames in `bus`, as one list for each CAN-ID. The key is the CAN-ID
            with its flags, as in `bus.ident`.
    """
    good: Counter[str] = Counter()
    bad = 0
    for ident, found in rows.items():
        if ident > STANDARD_MAX:
            continue
        few = found[:64]
        sizes = Counter(bus.dlc[row] for row in few)
        first = {bus.payload[row] & 0xFF for row in few}
        if ident in ERROR_CONTROL_IDS:
            fits = sizes[1] * 4 >= len(few) * 3 and {one & ~_TOGGLE for one in first} <= _STATES
            service = "error control"
        elif ident == nmt.NMT_COB_ID:
            service, fits = "nmt", sizes[2] * 2 >= len(few) and bool(first & _COMMANDS)
        elif ident == SYNC_ID:
            service, fits = "sync", (sizes[0] + sizes[1]) * 2 > len(few)
        elif ident in PDO_IDS:
            service, fits = "pdo", True
        elif ident in RESPONSE_IDS or ident in REQUEST_IDS:
            service, fits = "", sizes[sdo_frame.FRAME_BYTES] * 2 >= len(few)
        else:
            service, fits = "", not (ident < SYNC_ID or TIME_ID < ident < PDO_IDS.start)
        if ident in REQUEST_IDS:
            good["sdo"] += _answers(bus, few, rows.get(ident - 0x80, ())[:64])
        good[service] += fits
        bad += not fits
    strong = good["error control"] + good["sdo"]
    if strong:
        return bad <= 2 * strong + good["nmt"] + good["sync"] + good["pdo"]
    if good["nmt"]:
        return bad <= 1
    return bool(good["sync"] and good["pdo"]) and not bad


def _answers(bus: BusFrames, requests: Sequence[int], responses: Sequence[int]) -> bool:
    """Return whether a response names the object of a request."""
    objects = {bus.payload[row] >> 8 & 0xFF_FFFF for row in requests}
    return any(
        bus.payload[row] >> 8 & 0xFF_FFFF in objects and bus.dlc[row] == sdo_frame.FRAME_BYTES
        for row in responses
    )


class BusEvents:
    """Analysis of the NMT, error control, EMCY and SDO frames of a bus, one frame after the other.

    The analysis collects the events of each node, and violations of rules.

    Args:
        bus: frames of the bus.
        times: corrected times of these frames in microseconds.
        decoder: decoder that combines SDO frames to transfers, and learns from the transferred
            values.
        rows: indices of the frames in `bus`, as one list for each CAN-ID. The key is the CAN-ID
            with its flags, as in `bus.ident`.

    Attributes:
        nodes: events of each node, by node-ID.
        hits: violations found so far.
        cuts: events after which a node may send its frames with another period.
        commanded: whether the log contains any NMT command.
    """

    SILENT: ClassVar[str] = ", silent for "
    """Beginning of the part of a text that says how long a node was silent before its boot-up."""

    def __init__(
        self,
        bus: BusFrames,
        times: Sequence[int],
        decoder: Decoder,
        rows: Mapping[int, Sequence[int]],
    ) -> None:
        self._bus, self._times, self._decoder = bus, times, decoder
        self.nodes: defaultdict[int, NodeEvents] = defaultdict(NodeEvents)
        self.hits: list[Hit] = []
        self.cuts: list[Cut] = []
        self.commanded = any(ident == nmt.NMT_COB_ID for ident in rows)
        self._first, self._rows = first_rows(rows), rows
        self._reset: set[int] = set()  # of nodes without events before an NMT reset of all nodes
        self._requests: dict[tuple[int, int], int] = {}
        self._silent: list[tuple[int, str, int]] = []
        self._wrong_toggles: dict[int, int] = {}  # first row in the transfer of a node
        self._latest_sdo: dict[int, int] = {}
        self._row = 0
        self._untimed = times[0] == times[-1]

    def take(self, row: int) -> None:
        """Process a service frame."""
        self._row = row
        frame, at_us = self._bus.frame(row), int(self._times[row])
        if isinstance(frame, ErrorFrame):
            self._hit("no-error-frames", None, None, describe_error_frame(frame))
            return
        said = self._decoder.take(Record(at_us, self._bus.name, frame))
        can_id, data, node = frame.can_id, frame.data, frame.can_id & NODE_MASK
        if can_id == nmt.NMT_COB_ID:
            if len(data) == 2 and data[0] in _COMMANDS and not frame.remote:
                self._command(at_us, data[0], data[1])
        elif can_id in ERROR_CONTROL_IDS:
            self._error_control(at_us, node, data, remote=frame.remote)
        elif can_id in EMCY_IDS and not frame.remote and len(data) >= 2:
            code = int.from_bytes(data[:2], "little")
            if code:
                self.nodes[node].emcy.add(f"{code:04X}h")
                self._hit("no-emcy", node, can_id, f"EMCY {code:04X}h {describe(code)}")
        elif can_id in REQUEST_IDS and not frame.remote:
            one = self.nodes[node]
            one.requests += 1
            one.latest_request = data
            self._requests[node, at_us] = row
        elif can_id in RESPONSE_IDS and not frame.remote:
            self._answer(at_us, node, data)
        if said.kind == "sdo":
            # A new request ends a transfer whose wrong frame came before it.
            if said.flaw == WRONG_TOGGLE:
                self._wrong_toggles.setdefault(node, row)
            for transfer in said.transfers:
                self._transfer(at_us, transfer)
            self._latest_sdo[node] = row

    def end(self, end_us: int) -> None:
        """Report findings that are known only after the last frame."""
        for transfer in self._decoder.pending(end_us):
            if transfer.duration_us > _PATIENCE_US or WRONG_TOGGLE in transfer.flaws:
                self._transfer(end_us, transfer)
        self._judge_silent()
        for node, one in sorted(self.nodes.items()):
            if len(one.heartbeats) >= 2 and not one.toggled:
                one.heartbeats = sorted([*one.heartbeats, *one.answers])
                for row in one.requested:
                    self._row = row
                    said = "a remote frame asks a node that sends heartbeats for its state"
                    self._control_hit("remote-heartbeat", node, said, REMOTE)
            elif one.toggled:
                self._guarding(node, one)

    def _hit(self, rule: str, node: int | None, ident: int | None, text: str) -> None:
        self.hits.append(Hit(rule, node, ident, text, (self._row,)))

    def _control_hit(self, rule: str, node: int, text: str, flag: int = 0) -> None:
        self._hit(rule, node, nmt.ERROR_CONTROL_COB_ID + node | flag, text)

    # NMT and error control

    def _command(self, at_us: int, command: int, target: int) -> None:
        nodes = list(self.nodes) if target == nmt.ALL_NODES else [target]
        if command in nmt.RESETS and target == nmt.ALL_NODES:
            self._reset |= self._first.keys() - self.nodes.keys()
        self.cuts.append(Cut(at_us, target))
        if command == nmt.NmtCommand.STOP:
            whom = "all nodes" if target == nmt.ALL_NODES else f"node {target}"
            self._hit("nmt-stop", target or None, nmt.NMT_COB_ID, f"NMT stops {whom}")
        for node in nodes:
            one = self.nodes[node]
            if command in nmt.RESETS:
                one.reset, one.command = True, None
                one.beat_events.append(BeatEvent(at_us, self._row, "order"))
            else:
                one.command, one.told_since = (at_us, nmt.COMMANDED[command], self._row), 0

    def _error_control(self, at_us: int, node: int, data: bytes, *, remote: bool) -> None:
        one = self.nodes[node]
        if remote:
            one.requested.append(self._row)
            return
        if not data:
            return
        answers = bool(one.requested) and (
            at_us - self._times[one.requested[-1]] <= _ANSWER_US
            and (not one.answers or one.answers[-1] < one.requested[-1])
        )
        if data[0] == nmt.NmtState.INITIALISING and not (answers and one.toggled):
            self._boot(at_us, node, one)
            return
        (one.answers if answers else one.heartbeats).append(self._row)
        one.toggled |= bool(data[0] & _TOGGLE)
        self._state(at_us, node, one, data[0] & ~_TOGGLE)

    def _boot(self, at_us: int, node: int, one: NodeEvents) -> None:
        heard = self._first.get(node, self._row) < self._row
        expected = one.reset or node in self._reset
        self._reset.discard(node)
        one.beat_events.append(BeatEvent(at_us, self._row, "excuse" if expected else "boot"))
        since_us = at_us - int(self._times[one.boots[-1]]) if one.boots else None
        if heard and not expected:
            if not self._untimed and since_us is not None and since_us <= PAIR_US:
                said = f"two boot-ups within {ms_text(since_us)} ms: two nodes have this node-ID"
                self._control_hit("doubled-node", node, said)
            else:
                silent_us = 0 if self._untimed else at_us - self._last_frame_us(node)
                silent = f"{self.SILENT}{ms_text(silent_us)} ms before" if silent_us > 0 else ""
                self._control_hit("no-reboot", node, f"boots again without an NMT reset{silent}")
        one.boots.append(self._row)
        one.reset, one.state, one.command = False, int(nmt.NmtState.INITIALISING), None
        self.cuts.append(Cut(at_us, node))

    def _last_frame_us(self, node: int) -> int:
        """Return the time of the last frame of a node before the current one."""
        sent = [found for base in _SENT if (found := self._rows.get(base + node)) is not None]
        before = [bisect_left(found, self._row) for found in sent]
        rows = [int(found[at - 1]) for found, at in zip(sent, before, strict=True) if at]
        return int(self._times[max(rows, default=self._row)])

    def _state(self, at_us: int, node: int, one: NodeEvents, state: int) -> None:
        before, one.state = one.state, state
        command = one.command
        one.told_since += 1
        if state not in _STATES:
            self._control_hit("nmt-state", node, f"{state:02X}h is no NMT state")
        elif before is None or before == nmt.NmtState.INITIALISING:
            return  # many nodes start themselves (1F80h)
        elif state != before:
            wanted = None if command is None else command[1]
            # A recorder that omits its own frames records no NMT command.
            unseen = state == nmt.NmtState.OPERATIONAL and not self.commanded
            self.cuts.append(Cut(at_us, node))
            if state != wanted and not one.reset and not unseen:
                names = nmt_state_name(before), nmt_state_name(state)
                said = f"{names[0]} to {names[1]} without a command"
                self._control_hit("nmt-state", node, said)
        elif (
            command is not None
            and state != command[1]
            and at_us - command[0] > _OBEYS_US
            and one.told_since > 2
        ):
            names = nmt_state_name(state), nmt_state_name(command[1])
            said = f"still {names[0]} {ms_text(at_us - command[0])} ms after the command to be"
            self._control_hit("nmt-state", node, f"{said} {names[1]}")
            one.command = None

    def _guarding(self, node: int, one: NodeEvents) -> None:
        """Compare the toggle bits of successive answers."""
        before: int | None = None
        boots = iter([*one.boots, len(self._bus)])
        boot = next(boots)
        for row in one.answers:
            while boot < row:
                before, boot = None, next(boots)
            toggle = self._bus.payload[row] & _TOGGLE
            if toggle == before:
                self._row = row
                said = "the toggle bit is the same as in the answer before"
                self._control_hit("guard-toggle", node, said)
            before = toggle

    # SDO

    def _answer(self, at_us: int, node: int, data: bytes) -> None:
        """Report an answer that arrives twice."""
        one = self.nodes[node]
        latest, one.latest_answer = one.latest_answer, (at_us, data, one.requests)
        blocks = one.latest_request[:1] >= b"\xa0"
        if latest is None or not one.requests or blocks or data[:1] == b"\x80":
            return
        if (
            not self._untimed
            and latest[2] == one.requests
            and data[:4] == latest[1][:4]
            and at_us - latest[0] <= PAIR_US
        ):
            said = "two answers to one SDO request: two nodes have this node-ID"
            self._hit("doubled-node", node, sdo_frame.RESPONSE_COB_ID + node, said)

    def _transfer(self, at_us: int, transfer: decoded.Transfer) -> None:
        """Judge a completed SDO transfer."""
        node = transfer.node
        ident = sdo_frame.REQUEST_COB_ID + node
        row = self._requests.get((node, transfer.at_us), self._row)
        entry = transfer.entry
        name = decoded.write_entry(entry) + (f" {transfer.name}" if transfer.name else "")
        what = f"{transfer.direction} {name}"
        outcome = transfer.outcome
        if outcome is decoded.TransferOutcome.ABORTED:
            rule = "sdo-toggle" if transfer.abort_code == _TOGGLE_ABORT else "no-sdo-abort"
            by = "client" if transfer.by_client else "server"
            reason = sdo_frame.describe_abort(transfer.abort_code)
            self._hit(rule, node, ident, f"{by} aborts {what}, {reason}")
        elif outcome is decoded.TransferOutcome.UNANSWERED:
            self._silent.append((node, f"{what} is not answered", row))
        elif (
            outcome is decoded.TransferOutcome.BROKEN
            and not transfer.partial
            and WRONG_TOGGLE not in transfer.flaws
        ):
            row = self._latest_sdo.get(node, row)
            self._silent.append((node, f"{what} is broken off", row))
        elif transfer.retries and transfer.mode is decoded.TransferMode.EXPEDITED:
            again = f"asked again {counted(transfer.retries, 'time')}"
            self._silent.append((node, f"{what} is not answered, {again}", row))
        if entry == STATUSWORD and transfer.direction is decoded.TransferDirection.UPLOAD:
            self._statusword(node, ident, transfer.data or b"")
        if entry is not None and entry[0] == IDENTITY and transfer.data is not None:
            known = self.nodes[node].identity
            if known.get(entry[1], (None, 0))[0] != transfer.data:
                known[entry[1]] = transfer.data, self._row
        if WRONG_TOGGLE in transfer.flaws:
            row = self._wrong_toggles.get(node, self._row)
            self.hits.append(Hit("sdo-toggle", node, ident, f"{what}: {WRONG_TOGGLE}", (row,)))
        self._wrong_toggles.pop(node, None)
        if (
            entry is not None
            and transfer.direction is decoded.TransferDirection.DOWNLOAD
            and outcome is decoded.TransferOutcome.DONE
        ):
            if entry[0] in _PDO_PARAMETERS or entry[0] == _HEARTBEAT_TIME:
                self.cuts.append(Cut(at_us, node))
                if entry[0] == _HEARTBEAT_TIME:
                    self.nodes[node].beat_events.append(BeatEvent(at_us, self._row, "order"))
            elif entry[0] in _SYNC_PARAMETERS:
                self.cuts.append(Cut(at_us, 0))

    def _statusword(self, node: int, ident: int, data: bytes) -> None:
        """Judge a statusword that was read."""
        one, value = self.nodes[node], int.from_bytes(data[:2], "little")
        fault = bool(value & FAULT)
        if fault and not one.fault:
            text = f"the drive is in fault: statusword {value:04X}h {drive_state(value)}"
            self._hit("drive-fault", node, ident, text)
        one.fault = fault

    def _judge_silent(self) -> None:
        """Report unanswered requests. Requests to nodes without any frame are one finding."""
        absent: dict[int, int] = {}
        for node, text, row in self._silent:
            if node in self._first:
                self._row = row
                self._hit("sdo-unanswered", node, sdo_frame.REQUEST_COB_ID + node, text)
            else:
                absent.setdefault(node, row)
        if absent:
            nodes = ", ".join(map(str, sorted(absent)))
            text = f"SDO requests to nodes that send nothing: {nodes}"
            self.hits.append(Hit("sdo-unanswered", None, None, text, tuple(absent.values())))


def first_rows(rows: Mapping[int, Sequence[int]]) -> dict[int, int]:
    """Return the row of the first frame of each node."""
    first: dict[int, int] = {}
    for ident, found in rows.items():
        node = ident & NODE_MASK
        # An EMCY comes before the boot-up of some nodes.
        if node and ident <= STANDARD_MAX and _sends(ident) and ident not in EMCY_IDS:
            first[node] = min(int(found[0]), first.get(node, int(found[0])))
    return first


def _sends(ident: int) -> bool:
    """Return whether a node sends frames with an identifier of the pre-defined connection set."""
    tpdo = ident in PDO_IDS and (ident >> 7) % 2 == 1
    return tpdo or any(ident in ids for ids in (EMCY_IDS, RESPONSE_IDS, ERROR_CONTROL_IDS))


def is_event(ident: int) -> bool:
    """Return whether each frame of an identifier is processed individually."""
    can_id = ident & ~REMOTE
    services = (EMCY_IDS, RESPONSE_IDS, REQUEST_IDS, ERROR_CONTROL_IDS)
    is_service = can_id == nmt.NMT_COB_ID or any(can_id in ids for ids in services)
    return is_service or bool(ident & ERROR and not ident >> 30)
