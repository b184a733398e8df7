"""One node as the server sees it: absent, booting, ready, gone."""

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
"""So many times nearer to one time than to the other is a heartbeat that belongs to it."""

_STEADY: Final = 10
"""A heartbeat is in time within the producer time divided by this number."""

_APART: Final = 100
"""Times that differ by less than the producer time divided by this number are equal."""

CROWDED: Final = 10
"""Two heartbeats in each of this many producer times mean two nodes, or a changed 1017h."""

_CREDIT: Final = 3
"""Number of recent commands kept for a state that a node has not reported yet."""

_IDENTITY: Final = frozenset({0x1000, 0x1018})
"""Objects whose values no node changes."""


class DuplicateNodeDetector:
    """Monitors the frames of a node-ID, by the time stamps of the bus.

    Two nodes with one node-ID are detected by frames that a single node cannot send:

    - a boot-up, and heartbeats that continue at the previous times;
    - Operational, or Pre-operational after Stopped, without a command, twice;
    - two answers to a request for the identity, such as the serial number.

    The number of frames alone is no evidence, because a delayed node sends all pending frames at
    once. Two heartbeats in each producer time are only a suspicion.

    Not detected: nodes that send identical frames at identical times.

    Args:
        period_us: producer heartbeat time.

    Attributes:
        sure_us: the time from which a booted node is known to be the only one, unless there was
            evidence for a second node before.
        sign: the evidence for two nodes; empty if there is none.
        suspicion: the suspicion of two nodes; empty if there is none.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us = period_us
        self.sure_us = NEVER
        self._booted_us = 0
        self._commanded = Counter[NmtState]()
        self._state: NmtState | None = None
        self.forget()

    def forget(self) -> None:
        """Restart the detection: frames may have been missed, or the producer time was written."""
        self._old_us, self._steady = 0, False
        self._clear()

    def _clear(self) -> None:
        self.sign = self.suspicion = ""
        self._strangers, self._doubt_us = 0, -NEVER
        self._identity: dict[tuple[int, int], bytes | None] = {}
        self._double = _DoubleHeartbeats(self._period_us)

    def command(self, command: int) -> None:
        """Process an NMT command of any master to the node."""
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
        """Process a boot-up or heartbeat.

        Args:
            at_us: when the frame was on the bus.
            state: the state in the frame.
            listening: whether nothing was sent to the node since it booted.
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
        """See whether a node alone can be there now."""
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
        """See whether a heartbeat is one of before the boot-up."""
        if not self._steady:  # it was held up: its times say nothing
            return
        old_us, new_us = self._off_us(at_us - self._old_us), self._off_us(at_us - self._booted_us)
        if _APART * new_us >= self._period_us and _NEARER * old_us <= new_us:
            self._strangers += 1
            self.sure_us = max(self.sure_us, at_us + self._period_us * 5 // 4)
        if self._strangers > 1:
            self.sign = "a boot-up, and heartbeats at the times of before"

    def _off_us(self, span_us: int) -> int:
        """Return by how much a time is not one of whole periods."""
        over_us = span_us % self._period_us
        return min(over_us, self._period_us - over_us)


class _DoubleHeartbeats:
    """Says when two heartbeats came in each of many producer times on end."""

    def __init__(self, period_us: int) -> None:
        self._period_us, self._begin_us = period_us, -1
        self._window = self._count = self._run = 0

    def receive(self, at_us: int) -> bool:
        """Take a heartbeat; True if there are too many."""
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
    """Return whether a node may enter a state by itself (CiA 301: 1029h, after its boot-up)."""
    if before in (None, NmtState.INITIALISING) or state is NmtState.STOPPED:
        return True
    return before is NmtState.OPERATIONAL


_FOREIGN_RESET_US: Final = 1_000_000
"""A boot-up so soon after another master's reset is its doing."""

_RESETS: Final = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)


class NodePhase(Enum):
    """How far a node has come."""

    ABSENT = "absent"
    LISTENING = "listening"  # it booted though it was there: itself, or another of its node-ID
    BOOTING = "booting"
    READY = "ready"
    REFUSED = "refused"
    DUPLICATE = "duplicate"


_READY: Final = NodePhase.READY
_LISTENING: Final = NodePhase.LISTENING
"""Looked up once: it takes 0.1 us, and each node asks in each period."""

_WATCHED: Final = (NodePhase.READY, NodePhase.DUPLICATE)
"""Phases in which heartbeats are awaited."""

_LIVING: Final = (NodePhase.LISTENING, NodePhase.BOOTING, NodePhase.READY)
"""Phases in which the server looks for a twin."""


class NodeServer(Protocol):
    """What a node needs of its server."""

    def notify(self, kind: ServerEventType, node: int, text: str = "", /) -> None:
        """Take an event."""

    def send(self, can_id: int, data: bytes, /) -> None:
        """Send a frame."""

    def wake(self, due_us: int, /) -> None:
        """Let the node be ticked at a time."""

    def booted(self, node: ServedNode, /) -> None:
        """Make the proxy if there is none, links and connections."""

    def gone(self, node: ServedNode, /) -> None:
        """Remove the proxy."""


class ServedNode:
    """A node: detects when it boots or is lost, sets it up, keeps it and its proxy in step.

    Args:
        entry: its entry in the System Definition.
        file: the content of its EDS.
        writes: values that are written while it boots.
        remove_us: time without a heartbeat after which its proxy is removed.
        server: the server.

    Attributes:
        entry, file, writes: as given.
        phase: the phase of its set-up.
        received_us: time of its last frame.
        lost: whether its heartbeat is late.
        problem: the reason why it is refused, as text.
        layouts: its PDOs.
        to_start: whether it is to be activated in the start order.
        dialogue: the dialogue with the node.
        operations: its proxy, and its NMT state.
        due_us: when to call `tick` next.
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
        """Its RT component, None without."""
        return self.operations.proxy

    @property
    def nmt_state(self) -> NmtState | None:
        """What it reported last, None before."""
        return self.operations.nmt_state

    def search(self, now_us: int) -> None:
        """Look for it on the bus."""
        self.operations.now_us = now_us
        self.phase, self.lost = NodePhase.ABSENT, False
        self._duplicates.forget()
        job = QueuedScript("probe", probe(), lambda _: self._found(), self._not_booted)
        self.dialogue.start(now_us, job)
        self._plan()

    def boot(self, now_us: int) -> None:
        """Set it up, from whatever it is in."""
        self.operations.now_us = now_us
        self._boot(NmtCommand.ENTER_PRE_OPERATIONAL)
        self._plan()

    def restart(self, now_us: int) -> None:
        """Reset the node from any state, on request of a user.

        Its proxy is removed. The node is set up when it boots. It is activated again if it was
        Active, or was lost while it was Active.
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
        """Leave it as it is until it boots again."""
        self.phase, self.problem = NodePhase.REFUSED, problem

    def pause(self, now_us: int, span_us: int) -> None:
        """Record that no frames were received for some time: the node may have sent some."""
        self._watched_us, self._blind_us = now_us, self._blind_us + span_us
        self.dialogue.defer(span_us)
        self._duplicates.forget()
        self._plan()

    def on_error_control(self, now_us: int, at_us: int, data: bytes) -> None:
        """Process a boot-up or heartbeat with its time on the bus; ignore other frames."""
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
        """Take an SDO response."""
        self.operations.now_us = now_us
        self._duplicates.answer(data)
        self.dialogue.receive_sdo(now_us, data)
        self._judge()
        self._plan()

    def on_foreign_command(self, at_us: int, command: int) -> None:
        """Take an NMT command of another master."""
        self._duplicates.command(command)
        if command in _RESETS:
            self._foreign_reset_us = at_us

    def run(self, now_us: int, job: QueuedScript) -> None:
        """Run a job of another object."""
        self.operations.now_us = now_us
        self.dialogue.start(now_us, job)
        self._plan()

    def tick(self, now_us: int) -> None:
        """Do what is due."""
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
        """When its heartbeat is late, or its proxy is to be removed."""
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
        """See to a state that was reported just now."""
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
        """Set it up although its boot-up was not received; a Stopped node does not answer SDO."""
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
        self.phase, self.layouts, self.received_us = (
            NodePhase.READY,
            layouts,
            self.operations.now_us,
        )
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
        """Check for a twin: then stop both; report a suspicion once."""
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
