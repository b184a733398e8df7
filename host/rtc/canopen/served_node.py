"""One node as the server sees it, which is absent, booting, ready or gone."""

from __future__ import annotations

from collections import Counter
from enum import Enum
from typing import Final, Protocol

from tickrig.host.canopen.dialogue import Dialogue, Failure, QueuedScript
from tickrig.host.canopen.errors import SdoTimeout
from tickrig.host.rtc.canopen.boot import boot, probe
from tickrig.host.rtc.canopen.definition import DeviceFile, NodeEntry, SdoEntry
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.operations import NodeOperations, kind_of
from tickrig.host.rtc.canopen.pdo_layout import PdoLayout
from tickrig.host.rtc.canopen.proxy import ProxyRtc
from tickrig.host.rtc.states import LifeCycleState
from tickrig.wire.canopen.nmt import COMMANDED, NMT_COB_ID, NmtCommand, NmtState
from tickrig.wire.canopen.sdo import UploadInitiateResponse, parse_response
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER

# Find out that two nodes have one node-ID, by what they differ in.

_NEARER: Final = 4
"""Ratio of distances to two times above which a heartbeat belongs to the nearer time."""

_STEADY: Final = 10
"""Divisor of the producer time. A heartbeat within this part of it is in time."""

_APART: Final = 100
"""Divisor of the producer time. Times that differ by less than this part are equal."""

CROWDED: Final = 10
"""Number of producer times with two heartbeats each that prove two nodes, or a changed 1017h."""

_CREDIT: Final = 3
"""Number of recent commands kept for a state that a node has not reported yet."""

_IDENTITY: Final = frozenset({0x1000, 0x1018})
"""Objects whose values no node changes."""


class DuplicateNodeDetector:
    """A detector that monitors the frames of a node-ID by the time stamps of the bus.

    Two nodes with one node-ID are detected by frames that a single node cannot send:

    - a boot-up, and heartbeats that continue at the previous times;
    - Operational, or Pre-operational after Stopped, without a command, twice;
    - two answers to a request for the identity, such as the serial number.

    The number of frames alone is no evidence, because a delayed node sends all pending frames at
    once. Two heartbeats in each producer time are only a suspicion.

    Not detected: nodes that send identical frames at identical times.

    Args:
        period_us: producer heartbeat time of the node.

    Attributes:
        sure_us: time from which a booted node is known to be the only one, unless there was
            evidence for a second node before.
        sign: evidence for two nodes, empty if there is none.
        suspicion: suspicion of two nodes, empty if there is none.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us = period_us
        self.sure_us = NEVER
        self._booted_us = 0
        self._commanded = Counter[NmtState]()
        self._state: NmtState | None = None
        self.forget()

    def forget(self) -> None:
        """Restart the detection, because frames may be missing or the producer time was written."""
        self._old_us, self._steady = 0, False
        self._clear()

    def _clear(self) -> None:
        self.sign = self.suspicion = ""
        self._strangers, self._doubt_us = 0, -NEVER
        self._identity: dict[tuple[int, int], bytes | None] = {}
        self._double = _DoubleHeartbeats(self._period_us)

    def command(self, command: int) -> None:
        """Process an NMT command to the node, sent by any master."""
        if (state := COMMANDED.get(command)) is not None:
            self._commanded[state] = min(self._commanded[state] + 1, _CREDIT)

    def answer(self, data: bytes) -> None:
        """Process an SDO response."""
        try:
            answer = parse_response(data)
        except WireError:
            return
        if not isinstance(answer, UploadInitiateResponse) or answer.index not in _IDENTITY:
            return
        first = self._identity.setdefault((answer.index, answer.sub), answer.data)
        if answer.data != first and first and answer.data:
            values = f"{first[::-1].hex().upper()}h and {answer.data[::-1].hex().upper()}h"
            self.sign = f"{answer.index:04X}h:{answer.sub:02X} is {values}"

    def receive(self, at_us: int, state: NmtState, *, listening: bool) -> None:
        """Check a boot-up or heartbeat frame for signs that a second node has the same node-ID.

        Args:
            at_us: time of the frame on the bus in us.
            state: NMT state in the frame.
            listening: whether the server waits, after a boot-up, for frames of a second node. The
                server has sent nothing to the node since the boot-up.
        """
        before, self._state = self._state, state
        if state is NmtState.INITIALISING:
            self._clear()
            self._steady &= at_us - self._old_us <= self._period_us * 5 // 4
            self._booted_us = at_us
            self.sure_us = at_us + self._period_us * 5 // 4
            return
        self._judge_state(at_us, before, state)
        if listening:
            self._judge_time(at_us)
            return
        late_us = abs(at_us - self._old_us - self._period_us)
        self._old_us, self._steady = at_us, _STEADY * late_us <= self._period_us
        if self._double.receive(at_us):
            self.suspicion = f"two heartbeats in each {self._period_us // 1_000} ms"

    def _judge_state(self, at_us: int, before: NmtState | None, state: NmtState) -> None:
        """Check whether a single node can be in this state now."""
        if state is before:
            return
        commanded = self._commanded[state] > 0
        self._commanded[state] -= commanded
        if commanded or _goes_by_itself(before, state):
            return
        if at_us - self._doubt_us < CROWDED * self._period_us:
            self.sign = f"{state.name} in turn with {before.name if before else ''}, uncommanded"
        self._doubt_us = at_us

    def _judge_time(self, at_us: int) -> None:
        """Check whether a heartbeat continues the times from before the boot-up."""
        if not self._steady:  # it was held up: its times say nothing
            return
        old_us, new_us = self._off_us(at_us - self._old_us), self._off_us(at_us - self._booted_us)
        if _APART * new_us >= self._period_us and _NEARER * old_us <= new_us:
            self._strangers += 1
            self.sure_us = max(self.sure_us, at_us + self._period_us * 5 // 4)
        if self._strangers > 1:
            self.sign = "a boot-up, and heartbeats at the times of before"

    def _off_us(self, span_us: int) -> int:
        """Return the distance of a time from the nearest multiple of the period."""
        over_us = span_us % self._period_us
        return min(over_us, self._period_us - over_us)


class _DoubleHeartbeats:
    """A detector for two heartbeats in each of many successive producer times."""

    def __init__(self, period_us: int) -> None:
        self._period_us, self._begin_us = period_us, -1
        self._window = self._count = self._run = 0

    def receive(self, at_us: int) -> bool:
        """Count a heartbeat. Return True if there are too many for a single node."""
        if self._begin_us < 0:
            self._begin_us = at_us - self._period_us // 2
        window = (at_us - self._begin_us) // self._period_us
        if window != self._window:
            on_end = window == self._window + 1 and self._count > 1
            self._run = self._run + 1 if on_end else 0
            self._window, self._count = window, 0
        self._count += 1
        return self._run >= CROWDED


def _goes_by_itself(before: NmtState | None, state: NmtState) -> bool:
    """Return whether a node may enter a state without a command (CiA 301: 1029h, after boot-up)."""
    if before in (None, NmtState.INITIALISING) or state is NmtState.STOPPED:
        return True
    return before is NmtState.OPERATIONAL


_FOREIGN_RESET_US: Final = 1_000_000
"""Time after another master's reset in which a boot-up is caused by that reset."""

_RESETS: Final = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)


class NodePhase(Enum):
    """Phase of the set-up of a node by the server."""

    ABSENT = "absent"
    LISTENING = "listening"  # it booted though it was there: itself, or another of its node-ID
    BOOTING = "booting"
    READY = "ready"
    REFUSED = "refused"
    DUPLICATE = "duplicate"


_READY: Final = NodePhase.READY
_LISTENING: Final = NodePhase.LISTENING
"""Values that are looked up once. A look-up takes 0.1 us for each node in each period."""

_WATCHED: Final = (NodePhase.READY, NodePhase.DUPLICATE)
"""Phases in which the server expects heartbeats."""

_LIVING: Final = (NodePhase.LISTENING, NodePhase.BOOTING, NodePhase.READY)
"""Phases in which the server looks for a second node with the same node-ID."""


class NodeServer(Protocol):
    """Functions of the CANopen server that a node calls."""

    def notify(self, kind: ServerEventType, node: int, text: str = "", /) -> None:
        """Record an event."""

    def send(self, can_id: int, data: bytes, /) -> None:
        """Send a frame."""

    def wake(self, due_us: int, /) -> None:
        """Schedule a tick of the node at `due_us`."""

    def booted(self, node: ServedNode, /) -> None:
        """Create the proxy of a booted node if it has none.

        Then make the PDO links of the node, and the connections of the proxy to other components.
        """

    def gone(self, node: ServedNode, /) -> None:
        """Remove the proxy."""


class ServedNode:
    """A CANopen node that the server detects and sets up. Its proxy follows its NMT state.

    Args:
        entry: entry of the node in the System Definition.
        file: content of the node's EDS.
        writes: values that are written while the node boots.
        remove_us: time without a heartbeat after which the proxy is removed.
        server: server of the node.

    Attributes:
        entry: entry of the node in the System Definition.
        file: content of the node's EDS.
        writes: values that are written while the node boots.
        phase: phase of the set-up of the node.
        received_us: time of the last frame of the node.
        lost: whether the heartbeat of the node is late.
        problem: reason why the node is refused, as text.
        layouts: layouts of the node's PDOs.
        to_start: whether the node will be activated in the start order.
        dialogue: dialogue with the node.
        operations: proxy of the node, and its NMT state.
        due_us: time of the next call of `tick`.
    """

    def __init__(
        self,
        entry: NodeEntry,
        file: DeviceFile,
        writes: tuple[SdoEntry, ...],
        remove_us: int,
        server: NodeServer,
    ) -> None:
        self.entry, self.file, self.writes, self._server = entry, file, writes, server
        self._remove_us, self._consumer_us = remove_us, 3_000 * entry.heartbeat_ms
        self.dialogue = Dialogue(entry.id, self._send)
        self.operations = NodeOperations(entry, self.dialogue, server.notify)
        self.phase, self.problem = NodePhase.ABSENT, ""
        self.layouts: tuple[PdoLayout, ...] = ()
        self._duplicates = DuplicateNodeDetector(1_000 * entry.heartbeat_ms)
        self.received_us, self.due_us = 0, NEVER
        self._watched_us = self._blind_us = 0
        self._foreign_reset_us: int | None = None
        self.lost = self.to_start = self._suspected = False

    @property
    def proxy(self) -> ProxyRtc | None:
        """RT component of the node, or None without a proxy."""
        return self.operations.proxy

    @property
    def nmt_state(self) -> NmtState | None:
        """Last reported NMT state, or None before the first report."""
        return self.operations.nmt_state

    def search(self, now_us: int) -> None:
        """Look for the node on the bus by SDO requests until it answers."""
        self.operations.now_us = now_us
        self.phase, self.lost = NodePhase.ABSENT, False
        self._duplicates.forget()
        job = QueuedScript("probe", probe(), lambda _: self._found(), self._not_booted)
        self.dialogue.start(now_us, job)
        self._plan()

    def boot(self, now_us: int) -> None:
        """Set up the node again, in any state."""
        self.operations.now_us = now_us
        self._boot(NmtCommand.ENTER_PRE_OPERATIONAL)
        self._plan()

    def restart(self, now_us: int) -> None:
        """Reset the node by NMT on request of a user, in any state.

        The proxy is removed. When the node boots again, it is set up. If the node was Active before
        the reset, or was lost while it was Active, it is then also activated.
        """
        operations = self.operations
        operations.now_us = now_us
        was_active = operations.restart.by_hand()
        if self.proxy is not None and self.proxy.state is not LifeCycleState.ERROR:
            was_active = self.proxy.state is LifeCycleState.ACTIVE
        self.to_start |= was_active
        self._server.notify(ServerEventType.RESTARTED, self.entry.id, "by hand")
        self._server.gone(self)
        self.dialogue.clear()
        operations.begin()
        operations.say(NmtCommand.RESET_NODE)
        self.search(now_us)

    def refuse(self, problem: str) -> None:
        """Refuse to set up the node, for a reason, until it boots again."""
        self.phase, self.problem = NodePhase.REFUSED, problem

    def pause(self, now_us: int, span_us: int) -> None:
        """Record that frames may be missing, because none were received for some time."""
        self._watched_us, self._blind_us = now_us, self._blind_us + span_us
        self.dialogue.defer(span_us)
        self._duplicates.forget()
        self._plan()

    def on_error_control(self, now_us: int, at_us: int, data: bytes) -> None:
        """Process a boot-up or heartbeat frame of the node. Frames with other data are ignored.

        Args:
            now_us: present time in us.
            at_us: time of the frame on the bus in us.
            data: data of the frame.
        """
        try:
            (number,) = data
            state = NmtState(number)
        except ValueError:
            return
        operations = self.operations
        changed = state is not operations.nmt_state
        operations.now_us, operations.nmt_state, self.received_us = now_us, state, at_us
        self._blind_us = 0
        self.dialogue.receive_state(now_us, state)
        self._take(state, changed=changed)
        self._plan()

    def receive_sdo(self, now_us: int, data: bytes) -> None:
        """Process an SDO response."""
        self.operations.now_us = now_us
        self._duplicates.answer(data)
        self.dialogue.receive_sdo(now_us, data)
        self._judge()
        self._plan()

    def on_foreign_command(self, at_us: int, command: int) -> None:
        """Process an NMT command of another master."""
        self._duplicates.command(command)
        if command in _RESETS:
            self._foreign_reset_us = at_us

    def run(self, now_us: int, job: QueuedScript) -> None:
        """Run a job that another object makes for this node."""
        self.operations.now_us = now_us
        self.dialogue.start(now_us, job)
        self._plan()

    def tick(self, now_us: int) -> None:
        """Do the work that is due."""
        self.operations.now_us = now_us
        self.dialogue.tick(now_us)
        if self.phase is NodePhase.LISTENING and now_us >= self._duplicates.sure_us:
            self._boot()
        elif self._deadline_us <= now_us:
            self._lose(now_us)
        self._plan()

    def carry_out(self, now_us: int) -> None:
        """Execute the requests of the RT side on the bus."""
        self.operations.now_us = now_us
        operations, restart = self.operations, self.operations.restart
        operations.carry_out(lost=self.lost)
        if self.phase is _READY and not self.lost:
            operations.go_on()
        if restart.to_activate and operations.is_inactive:
            restart.to_activate, self.to_start = False, True
        self._plan()

    @property
    def _deadline_us(self) -> int:
        """Time at which the heartbeat is late, or at which the proxy is removed."""
        if self.phase not in _WATCHED:
            return NEVER
        since_us = max(self.received_us, self._watched_us)
        return since_us + self._consumer_us + (self._remove_us if self.lost else 0)

    def _send(self, can_id: int, data: bytes) -> None:
        if can_id == NMT_COB_ID:
            self._duplicates.command(data[0])
        self._server.send(can_id, data)

    def _plan(self) -> None:
        due_us = min(self.dialogue.due_us, self._deadline_us)
        if self.phase is _LISTENING:
            due_us = min(due_us, self._duplicates.sure_us)
        if due_us != self.due_us:
            self.due_us = due_us
            self._server.wake(due_us)

    def _take(self, state: NmtState, *, changed: bool) -> None:
        """Process a state that was reported just now."""
        self._duplicates.receive(
            self.received_us, state, listening=self.phase is NodePhase.LISTENING
        )
        if self._judge():
            return
        if state is NmtState.INITIALISING:
            self._booted_up()
        elif self.phase is NodePhase.ABSENT:
            self._found()
        elif self.phase is NodePhase.READY:
            self.lost = False
            self.operations.follow(state, changed=changed)

    def _booted_up(self) -> None:
        self._server.notify(ServerEventType.BOOT_UP, self.entry.id)
        reset_us = self._foreign_reset_us
        foreign = reset_us is not None and self.received_us - reset_us < _FOREIGN_RESET_US
        expected = self.lost or self.operations.resetting or foreign
        if self.phase is NodePhase.READY and not expected:
            self.phase = NodePhase.LISTENING
            self.dialogue.clear()
            self.operations.lose()
        else:
            self._boot()

    def _found(self) -> None:
        """Set up the node although its boot-up was missed. A Stopped node does not answer SDO."""
        if self.nmt_state is NmtState.STOPPED:
            self.dialogue.clear()
            self.operations.say(NmtCommand.RESET_NODE)
        else:
            self._boot(NmtCommand.ENTER_PRE_OPERATIONAL)

    def _boot(self, first: NmtCommand | None = None) -> None:
        if not self.operations.resetting:
            self._server.gone(self)
        self.phase, self.problem, self.lost = NodePhase.BOOTING, "", False
        self.operations.begin()
        self._duplicates.forget()
        self.dialogue.clear()
        if first is not None:
            self.operations.say(first)
        script = boot(self.entry, self.file, self.writes)
        job = QueuedScript("boot", script, self._booted, self._not_booted)
        self.dialogue.start(self.operations.now_us, job)

    def _booted(self, layouts: tuple[PdoLayout, ...]) -> None:
        self.phase, self.layouts = NodePhase.READY, layouts
        self.received_us = self.operations.now_us
        self._duplicates.forget()
        self.operations.booted()
        self._server.booted(self)
        if self.operations.restart.pending:
            self.operations.begin_restart(to_start=self.to_start)

    def _not_booted(self, failure: Failure) -> None:
        self.operations.resetting, self.problem = False, str(failure)
        self._server.notify(kind_of(failure), self.entry.id, self.problem)
        if isinstance(failure, SdoTimeout):
            self._server.gone(self)
            self.search(self.operations.now_us)
        else:
            self.phase = NodePhase.REFUSED

    def _judge(self) -> bool:
        """Check for a second node. If there is one, stop both nodes. Report a suspicion once."""
        duplicates = self._duplicates
        if duplicates.sign and self.phase in _LIVING:
            self._refuse_duplicate(duplicates.sign)
            return True
        if duplicates.suspicion and not self._suspected and self.phase in _LIVING:
            self._suspected = True
            self._server.notify(
                ServerEventType.DUPLICATE_SUSPECTED, self.entry.id, duplicates.suspicion
            )
        return False

    def _refuse_duplicate(self, sign: str) -> None:
        self.phase, self.problem = NodePhase.DUPLICATE, f"two nodes have this node-ID: {sign}"
        self._server.notify(
            ServerEventType.DUPLICATE_NODE, self.entry.id, f"both are stopped: {sign}"
        )
        self.dialogue.clear()
        self.operations.say(NmtCommand.STOP)
        self.operations.abort()
        self.operations.restart.forget()

    def _lose(self, now_us: int) -> None:
        if self.lost:
            self._server.gone(self)
            self.dialogue.clear()
            self.search(now_us)
            return
        self.lost = True
        text = f"silent for {(now_us - self.received_us) // 1_000} ms"
        if self._blind_us:
            text += f"; for {self._blind_us // 1_000} ms of them the server did not look"
        self._server.notify(ServerEventType.HEARTBEAT_LOST, self.entry.id, text)
        self.dialogue.clear()
        self.operations.abort()
