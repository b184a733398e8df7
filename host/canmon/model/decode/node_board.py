"""All nodes at a glance: states, heartbeats, boot-ups, EMCYs, SDO errors, drives."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import HEARTBEAT_TIME, Heartbeats, NodeMemory
from tickrig.host.canmon.model.decode.object_text import drive_state
from tickrig.host.canmon.model.decode.pdos import UNMAPPED
from tickrig.host.canmon.model.decode.sdo.transfer import Outcome, Transfer
from tickrig.host.canmon.model.decode.services import nmt_state_name
from tickrig.host.canmon.model.frames.ident import ident_of, sender_of
from tickrig.host.canmon.model.frames.record import Record
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

EMCY_KEPT: Final = 16
DEVICE_NAME: Final = (0x1008, 0)

_TARGETS: Final = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
    NmtCommand.RESET_NODE: NmtState.INITIALISING,
    NmtCommand.RESET_COMMUNICATION: NmtState.INITIALISING,
}


class EmcyRecord(NamedTuple):
    """An EMCY and when it came."""

    at_us: int
    code: int
    text: str


@dataclass(slots=True)
class NodeStatus:
    """One row of the node board.

    Args:
        channel: its bus.
        node: its node-ID.
        memory: what is known of its objects.

    Attributes:
        state: NMT state as it told it, None while it told none.
        commanded: where the NMT master sent it since, None once it has told its state.
        boots: boot-up messages.
        unrequested_boots: those that no NMT command had asked for, of a node that was heard before.
        late: gaps between heartbeats that were longer than `LATE` periods.
        emcys: the latest, oldest first.
        emcy_count: all.
        error_code: of the latest EMCY, 0 if that took an error back.
        sdo_errors: transfers that were aborted, unanswered or broken off.
        sdo_error: the last of them, for people.
        drive_state: of CiA 402, empty while no statusword was heard.
        name: the device name it told.
        present: it has sent anything that is known to be its own.
        pdos: the latest of each of its PDOs, by kind.
    """

    channel: str
    node: int
    memory: NodeMemory
    state: int | None = None
    commanded: int | None = None
    boots: int = 0
    unrequested_boots: int = 0
    late: int = 0
    emcys: deque[EmcyRecord] = field(default_factory=lambda: deque(maxlen=EMCY_KEPT))
    emcy_count: int = 0
    error_code: int = 0
    sdo_errors: int = 0
    sdo_error: str = ""
    drive_state: str = ""
    name: str = ""
    present: bool = False
    pdos: dict[str, Decoded] = field(default_factory=dict)
    _reset_requested: bool = False
    _heartbeats: Heartbeats = field(init=False)

    def __post_init__(self) -> None:
        """Wait for its first heartbeat."""
        self._heartbeats = Heartbeats(self.memory)

    @property
    def period_us(self) -> int | None:
        """The heartbeat period, as `Heartbeats` knows it; None for none."""
        return self._heartbeats.period_us

    @property
    def learnt(self) -> bool:
        """Whether the period is learnt from the gaps."""
        return bool(self._heartbeats.gaps) and not self._heartbeats.by_sdo

    @property
    def reported_us(self) -> int | None:
        """When it last told its state."""
        return self._heartbeats.last_us

    def age_us(self, now_us: int) -> int | None:
        """Return how long ago it told its state."""
        return None if self.reported_us is None else now_us - self.reported_us

    def is_late(self, now_us: int) -> bool:
        """Say whether a heartbeat is missing."""
        return self._heartbeats.is_late(now_us)

    @property
    def state_text(self) -> str:
        """The NMT state for people; where the master sent it meanwhile behind an arrow."""
        told = "?" if self.state is None else nmt_state_name(self.state)
        if self.commanded in (None, self.state):
            return told
        return f"{told} -> {nmt_state_name(self.commanded or 0)}"

    def command(self, specifier: int) -> None:
        """Take an NMT command to this node."""
        target = _TARGETS[NmtCommand(specifier)]
        self.commanded = target
        self._reset_requested = target is NmtState.INITIALISING

    def boot(self, at_us: int) -> None:
        """Take its boot-up: it is pre-operational then (CiA 301, boot-up)."""
        self.boots += 1
        self.unrequested_boots += self.present and not self._reset_requested
        self._reset_requested, self.drive_state, self.error_code = False, "", 0
        self._heartbeats.boot(at_us)
        self._report(NmtState.PRE_OPERATIONAL)

    def heartbeat(self, at_us: int, state: int) -> None:
        """Take a heartbeat, or the answer to a guarding request."""
        self.late += self.is_late(at_us)
        self._heartbeats.take(at_us)
        self._report(state)

    def _report(self, state: int) -> None:
        self.state, self.commanded, self.present = state, None, True

    def emcy(self, at_us: int, decoded: Decoded) -> None:
        """Take an EMCY."""
        self.present = True
        if not decoded.signals:
            return
        code = decoded.signals[0].value
        assert isinstance(code, int)
        self.emcy_count += 1
        self.error_code = code
        self.emcys.append(EmcyRecord(at_us, code, decoded.text))

    def transfer(self, at_us: int, transfer: Transfer) -> None:
        """Take an SDO transfer that ended."""
        self.present = self.present or transfer.outcome.answered
        if transfer.outcome is not Outcome.DONE:
            self.sdo_errors += 1
            self.sdo_error = str(transfer)
        elif transfer.entry == HEARTBEAT_TIME:
            self._heartbeats.learn(at_us, transfer)
        elif transfer.entry == DEVICE_NAME and isinstance(transfer.value, str):
            self.name = transfer.value


STATUSWORD: Final = "statusword"
ERROR_CONTROL: Final = ("heartbeat", "guard")


class NodeBoard:
    """Keeps the status of every node that was heard.

    A node is on the board once it has told its state, sent an EMCY, answered an SDO request
    or sent a PDO that is known to be its own or has a CAN-ID of the pre-defined connection set
    that nobody gave another meaning; and from the beginning where it has an EDS.

    Args:
        decoder: decodes what is taken here, too.
        expected: nodes with an EDS, on the first bus that is heard.
    """

    def __init__(self, decoder: Decoder, expected: Mapping[int, str] | None = None) -> None:
        self._decoder = decoder
        self._expected = dict(expected or {})
        self._nodes: dict[tuple[str, int], NodeStatus] = {}
        self.now_us = 0

    def rows(self) -> list[NodeStatus]:
        """Return the nodes by bus and node-ID."""
        return [self._nodes[key] for key in sorted(self._nodes)]

    def take(self, record: Record, decoded: Decoded) -> None:
        """Take a decoded frame."""
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
        elif kind in ERROR_CONTROL and decoded.signals:
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
            if signal.name == STATUSWORD and isinstance(signal.value, int):
                status.drive_state = drive_state(signal.value)

    def _transfers(self, record: Record, node: int, decoded: Decoded) -> None:
        channel = record.channel
        for transfer in decoded.transfers:
            answered = transfer.outcome.answered
            if answered or (channel, node) in self._nodes:
                self._status(channel, node).transfer(record.at_us, transfer)
            if transfer.name == STATUSWORD and isinstance(transfer.value, int):
                self._status(channel, node).drive_state = drive_state(transfer.value)
