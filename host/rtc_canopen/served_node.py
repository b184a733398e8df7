"""One node as the server sees it: absent, booting, ready, gone."""

from __future__ import annotations

from enum import Enum
from typing import Any, Final, Protocol

from tickrig.host.link import NEVER
from tickrig.host.rtc.states import LifeCycleState
from tickrig.host.rtc_canopen.boot import boot, probe
from tickrig.host.rtc_canopen.definition import NodeEntry, Role, SdoEntry
from tickrig.host.rtc_canopen.device_file import DeviceFile
from tickrig.host.rtc_canopen.dialogue import Dialogue, Failure, Job
from tickrig.host.rtc_canopen.errors import SdoAborted, SdoTimeout, WrongIdentity
from tickrig.host.rtc_canopen.events import EventKind
from tickrig.host.rtc_canopen.life_cycle import CONTROLWORD, ENABLING, LIFE_CYCLES
from tickrig.host.rtc_canopen.pdo_layout import PdoLayout
from tickrig.host.rtc_canopen.proxy import Asked, ProxyRtc
from tickrig.host.rtc_canopen.script import Command, Script
from tickrig.host.rtc_canopen.twin_watch import TwinWatch
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

FOREIGN_RESET_US: Final = 1_000_000
"""A boot-up so soon after another master's reset is its doing."""

STATES: Final = {
    NmtState.PRE_OPERATIONAL: LifeCycleState.INACTIVE,
    NmtState.OPERATIONAL: LifeCycleState.ACTIVE,
    NmtState.STOPPED: LifeCycleState.ERROR,
}
"""The state of a proxy by that of its device (NEDO report, table 3)."""


class Phase(Enum):
    """How far a node has come."""

    ABSENT = "absent"
    LISTENING = "listening"  # it booted though it was there: itself, or another of its node-ID
    BOOTING = "booting"
    READY = "ready"
    REFUSED = "refused"
    DUPLICATE = "duplicate"


class House(Protocol):
    """What a node needs of its server."""

    def note(self, kind: EventKind, node: int, text: str = "", /) -> None:
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
    """A node: sees it come and go, sets it up, says what is asked of its proxy.

    Args:
        entry: what the System Definition says of it.
        file: what its EDS says.
        writes: values that are written while it boots.
        remove_us: after how long without heartbeat its proxy is removed.
        house: the server.

    Attributes:
        phase: how far it has come.
        nmt_state: what it reported last, None before.
        heard_us: when it reported.
        lost: its heartbeat is late.
        problem: why it is refused, for people.
        layouts: its PDOs.
        proxy: its RT component, None without.
        to_start: it is to be activated in its turn.
        due_us: when `tick` has something to do.
    """

    def __init__(
        self,
        entry: NodeEntry,
        file: DeviceFile,
        writes: tuple[SdoEntry, ...],
        remove_us: int,
        house: House,
    ) -> None:
        self.entry, self._file, self._writes, self._house = entry, file, writes, house
        self._remove_us, self._consumer_us = remove_us, 3_000 * entry.heartbeat_ms
        self._life = LIFE_CYCLES[entry.role]
        self.dialogue = Dialogue(entry.id, house.send)
        self.phase, self.problem = Phase.ABSENT, ""
        self.nmt_state: NmtState | None = None
        self.layouts: tuple[PdoLayout, ...] = ()
        self.proxy: ProxyRtc | None = None
        self._twins = TwinWatch(1_000 * entry.heartbeat_ms)
        self.heard_us = self._now_us = 0
        self._foreign_reset_us = -FOREIGN_RESET_US
        self.lost = self.to_start = self._resetting = self._stopping = False
        self.due_us = NEVER

    def look(self, now_us: int) -> None:
        """Look for it on the bus."""
        self._now_us = now_us
        self.phase, self.lost = Phase.ABSENT, False
        self._run("probe", probe(), lambda _: self._found())
        self._plan()

    def boot(self, now_us: int) -> None:
        """Set it up, from whatever it is in."""
        self._now_us = now_us
        self._boot((NmtCommand.ENTER_PRE_OPERATIONAL,))
        self._plan()

    def hear_error_control(self, now_us: int, data: bytes) -> None:
        """Take a boot-up or heartbeat; anything else is passed over."""
        try:
            (number,) = data
            state = NmtState(number)
        except ValueError:
            return
        self._now_us, before = now_us, self.nmt_state
        self.nmt_state, self.heard_us = state, now_us
        twin = self._twins.hear(now_us, state, listening=self.phase is Phase.LISTENING)
        self.dialogue.hear_state(now_us, state)
        if state is NmtState.INITIALISING:
            self._booted_up()
        elif twin and self.phase in (Phase.READY, Phase.LISTENING):
            self._refuse_twin()
        elif self.phase is Phase.ABSENT:
            self._found()
        elif self.phase is Phase.READY:
            self.lost = False
            self._follow(state, changed=state is not before)
        self._plan()

    def hear_sdo(self, now_us: int, data: bytes) -> None:
        """Take an SDO response."""
        self._now_us = now_us
        self.dialogue.hear_sdo(now_us, data)
        self._plan()

    def hear_foreign(self, now_us: int, command: int) -> None:
        """Take an NMT command of another master."""
        if command in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION):
            self._foreign_reset_us = now_us

    def run(self, now_us: int, job: Job) -> None:
        """Run a job of somebody else."""
        self._now_us = now_us
        self.dialogue.start(now_us, job)
        self._plan()

    def tick(self, now_us: int) -> None:
        """Do what is due."""
        self._now_us = now_us
        self.dialogue.tick(now_us)
        if self.phase is Phase.LISTENING and now_us >= self._twins.sure_us:
            self._boot()
        elif self._deadline_us <= now_us:
            self._lose()
        self._plan()

    def carry_out(self, now_us: int) -> None:
        """Say on the bus what the RT side asked for, unless the device is there already."""
        if self.proxy is None or (asked := self.proxy.take_asked()) is Asked.NOTHING:
            return
        self._now_us = now_us
        idle = self.dialogue.job is None
        match asked:
            case Asked.ACTIVATE:
                self._activate(there=idle and self.nmt_state is NmtState.OPERATIONAL)
            case Asked.DEACTIVATE if not (idle and self.nmt_state is NmtState.PRE_OPERATIONAL):
                self.dialogue.clear()
                self._run("deactivate", self._life.deactivate(self.entry))
            case Asked.ABORT if not (idle and self.nmt_state is NmtState.STOPPED) or self.lost:
                self.dialogue.clear()
                self._stop()
            case Asked.RESET if not self._resetting:
                self._resetting = True
                self._run("reset", self._life.reset(self.entry))
        self._plan()

    def fail(self, now_us: int) -> None:
        """Let the proxy go to Error: nothing is known of the device any more."""
        self._now_us = now_us
        self._abort_proxy()

    @property
    def _deadline_us(self) -> int:
        """When its heartbeat is late, or its proxy is to be removed."""
        if self.phase not in (Phase.READY, Phase.DUPLICATE):
            return NEVER
        return self.heard_us + self._consumer_us + (self._remove_us if self.lost else 0)

    def _plan(self) -> None:
        due_us = min(self.dialogue.due_us, self._deadline_us)
        if self.phase is Phase.LISTENING:
            due_us = min(due_us, self._twins.sure_us)
        self.due_us = due_us
        self._house.wake(due_us)

    def _run(self, what: str, script: Script[Any], done: Any = None) -> None:
        self.dialogue.start(self._now_us, Job(what, script, done or _nothing, self._not_confirmed))

    def _booted_up(self) -> None:
        self._house.note(EventKind.BOOT_UP, self.entry.id)
        foreign = self._now_us - self._foreign_reset_us < FOREIGN_RESET_US
        if self.phase is Phase.READY and not (self.lost or self._resetting or foreign):
            self.phase = Phase.LISTENING
            self.dialogue.clear()
        else:
            self._boot()

    def _found(self) -> None:
        """Set it up though its boot-up was not heard; a Stopped one answers no SDO."""
        if self.nmt_state is NmtState.STOPPED:
            self.dialogue.clear()
            self._run("reset", _say(NmtCommand.RESET_NODE))
        else:
            self._boot((NmtCommand.ENTER_PRE_OPERATIONAL,))

    def _boot(self, first: tuple[NmtCommand, ...] = ()) -> None:
        if self.proxy is not None and not self._resetting:
            self._house.gone(self)
        self.phase, self.problem, self.lost, self._stopping = Phase.BOOTING, "", False, False
        self.dialogue.clear()
        for command in first:
            self._run("command", _say(command))
        script = boot(self.entry, self._file, self._writes)
        self.dialogue.start(self._now_us, Job("boot", script, self._booted, self._not_booted))

    def _booted(self, layouts: tuple[PdoLayout, ...]) -> None:
        self.phase, self.layouts, self.heard_us = Phase.READY, layouts, self._now_us
        self.nmt_state = NmtState.PRE_OPERATIONAL
        self._resetting = False
        self._twins.forget()
        if self.proxy is not None:
            self._leave_error(self.proxy)
        self._house.booted(self)

    def _not_booted(self, failure: Failure) -> None:
        self._resetting, self.problem = False, str(failure)
        self._house.note(_kind(failure), self.entry.id, self.problem)
        if isinstance(failure, SdoTimeout):
            self._house.gone(self)
            self.look(self._now_us)
        else:
            self.phase = Phase.REFUSED

    def _refuse_twin(self) -> None:
        self.phase, self.problem = Phase.DUPLICATE, "two nodes have this node-ID"
        self._house.note(EventKind.DUPLICATE_NODE, self.entry.id, "both are stopped")
        self.dialogue.clear()
        self._run("stop", _say(NmtCommand.STOP))
        self._abort_proxy()

    def _lose(self) -> None:
        if self.lost:
            self._house.gone(self)
            self.dialogue.clear()
            self.look(self._now_us)
            return
        self.lost = True
        self._house.note(
            EventKind.HEARTBEAT_LOST, self.entry.id, f"{self._consumer_us // 1_000} ms"
        )
        self.dialogue.clear()
        self._resetting = False
        self._abort_proxy()

    def _follow(self, state: NmtState, *, changed: bool) -> None:
        """Move the proxy to where the device says it is, unless that is about to change."""
        proxy = self.proxy
        if proxy is None or self.dialogue.job is not None or proxy.asked is not Asked.NOTHING:
            return
        if self._stopping:
            self._stopping = state is not NmtState.STOPPED
            if self._stopping:
                self._stop()
        elif STATES[state] is not proxy.state and not proxy.ready:
            if changed:
                text = f"{state.name} while the proxy is {proxy.state.name}"
                self._house.note(EventKind.FOREIGN_TRANSITION, self.entry.id, text)
            self._move(proxy, STATES[state])

    def _move(self, proxy: ProxyRtc, wanted: LifeCycleState) -> None:
        context = proxy.contexts[0]
        if wanted is LifeCycleState.ERROR:
            context.abort_component(proxy)
        elif proxy.state is LifeCycleState.ERROR:
            self._leave_error(proxy)
        elif wanted is LifeCycleState.ACTIVE:
            context.activate_component(proxy)
        else:
            context.deactivate_component(proxy)

    def _leave_error(self, proxy: ProxyRtc) -> None:
        proxy.ready = True
        proxy.contexts[0].reset_component(proxy)

    def _abort_proxy(self) -> None:
        if self.proxy is not None:
            self.proxy.contexts[0].abort_component(self.proxy)

    def _activate(self, *, there: bool) -> None:
        if there:
            self._activated(None)
        else:
            self._run("activate", self._life.activate(self.entry), self._activated)

    def _activated(self, _: None) -> None:
        if (proxy := self.proxy) is None:
            return
        proxy.confirmed = True
        if self.entry.role is Role.DRIVE:
            for sink in proxy.sinks:
                sink.preset(CONTROLWORD, ENABLING[-1][0])

    def _not_confirmed(self, failure: Failure) -> None:
        self._resetting = False
        kind = _kind(failure)
        self._house.note(kind, self.entry.id, str(failure))
        self._abort_proxy()

    def _stop(self) -> None:
        """Stop it, and again with each heartbeat until it says that it is."""
        self._stopping = True
        self._run("stop", _say(NmtCommand.STOP))


def _say(command: NmtCommand) -> Script[None]:
    yield Command(command)


def _nothing(_: object) -> None:
    """Do nothing more."""


def _kind(failure: Failure) -> EventKind:
    match failure:
        case WrongIdentity():
            return EventKind.WRONG_IDENTITY
        case SdoAborted():
            return EventKind.SDO_ABORTED
        case SdoTimeout():
            return EventKind.SDO_TIMEOUT
    return EventKind.NOT_CONFIRMED
