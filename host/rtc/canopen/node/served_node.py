"""One node as the server sees it: absent, booting, ready, gone."""

from __future__ import annotations

from enum import Enum
from typing import Final, Protocol

from tickrig.host.canopen.dialogue import Dialogue, Failure, QueuedScript
from tickrig.host.canopen.errors import SdoTimeout
from tickrig.host.rtc.canopen.definition.definition import NodeEntry, SdoEntry
from tickrig.host.rtc.canopen.definition.device_file import DeviceFile
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.node.boot import boot, probe
from tickrig.host.rtc.canopen.node.duplicate_detector import DuplicateNodeDetector
from tickrig.host.rtc.canopen.node.operations import NodeOperations, kind_of
from tickrig.host.rtc.canopen.proxy.pdo_layout import PdoLayout
from tickrig.host.rtc.canopen.proxy.proxy import ProxyRtc
from tickrig.host.rtc.states import LifeCycleState
from tickrig.wire.canopen.nmt import NMT_COB_ID, NmtCommand, NmtState
from tickrig.wire.instant import NEVER

FOREIGN_RESET_US: Final = 1_000_000
"""A boot-up so soon after another master's reset is its doing."""

RESETS: Final = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)


class NodePhase(Enum):
    """How far a node has come."""

    ABSENT = "absent"
    LISTENING = "listening"  # it booted though it was there: itself, or another of its node-ID
    BOOTING = "booting"
    READY = "ready"
    REFUSED = "refused"
    DUPLICATE = "duplicate"


READY: Final = NodePhase.READY
LISTENING: Final = NodePhase.LISTENING
"""Looked up once: it takes 0.1 us, and each node asks in each period."""

WATCHED: Final = (NodePhase.READY, NodePhase.DUPLICATE)
"""Phases in which heartbeats are awaited."""

LIVING: Final = (NodePhase.LISTENING, NodePhase.BOOTING, NodePhase.READY)
"""Phases in which a twin is looked for."""


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
    """A node: sees it come and go, sets it up, keeps its proxy and it together.

    Args:
        entry: what the System Definition says of it.
        file: what its EDS says.
        writes: values that are written while it boots.
        remove_us: after how long without heartbeat its proxy is removed.
        server: the server.

    Attributes:
        entry, file, writes: as given.
        phase: how far it has come.
        received_us: when it was heard last.
        lost: its heartbeat is late.
        problem: why it is refused, for people.
        layouts: its PDOs.
        to_start: it is to be activated in its turn.
        dialogue: what is said with it.
        operations: its proxy, and its NMT state.
        due_us: when `tick` has something to do.
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
        """Reset the node, from whatever it is in, as somebody asks for it by hand.

        Its proxy is removed; it is set up when it boots, and activated again if it was Active,
        or lost while it was.
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
        """Take note that nobody looked for so long: it may have spoken all the same."""
        self._watched_us, self._blind_us = now_us, self._blind_us + span_us
        self.dialogue.defer(span_us)
        self._duplicates.forget()
        self._plan()

    def on_error_control(self, now_us: int, at_us: int, data: bytes) -> None:
        """Take a boot-up or heartbeat of a time on the bus; anything else is passed over."""
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
        if command in RESETS:
            self._foreign_reset_us = at_us

    def run(self, now_us: int, job: QueuedScript) -> None:
        """Run a job of somebody else."""
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
        """Say on the bus what the RT side asked for."""
        self.operations.now_us = now_us
        operations, restart = self.operations, self.operations.restart
        operations.carry_out(lost=self.lost)
        if self.phase is READY and not self.lost:
            operations.go_on()
        if restart.to_activate and operations.is_inactive:
            restart.to_activate, self.to_start = False, True
        self._plan()

    @property
    def _deadline_us(self) -> int:
        """When its heartbeat is late, or its proxy is to be removed."""
        if self.phase not in WATCHED:
            return NEVER
        since_us = max(self.received_us, self._watched_us)
        return since_us + self._consumer_us + (self._remove_us if self.lost else 0)

    def _send(self, can_id: int, data: bytes) -> None:
        if can_id == NMT_COB_ID:
            self._duplicates.command(data[0])
        self._server.send(can_id, data)

    def _plan(self) -> None:
        due_us = min(self.dialogue.due_us, self._deadline_us)
        if self.phase is LISTENING:
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
        foreign = reset_us is not None and self.received_us - reset_us < FOREIGN_RESET_US
        expected = self.lost or self.operations.resetting or foreign
        if self.phase is NodePhase.READY and not expected:
            self.phase = NodePhase.LISTENING
            self.dialogue.clear()
            self.operations.lose()
        else:
            self._boot()

    def _found(self) -> None:
        """Set it up though its boot-up was not heard; a Stopped one answers no SDO."""
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
        """See whether it has a twin: then both are stopped; a suspicion is told once."""
        duplicates = self._duplicates
        if duplicates.sign and self.phase in LIVING:
            self._refuse_duplicate(duplicates.sign)
            return True
        if duplicates.suspicion and not self._suspected and self.phase in LIVING:
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
