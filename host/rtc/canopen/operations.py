"""Synchronization of a proxy's life cycle with the NMT state of its device (ours: K14, K15)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tickrig.host.canopen import errors
from tickrig.host.canopen.dialogue import (
    AwaitState,
    Dialogue,
    Failure,
    NmtRequest,
    Pause,
    QueuedScript,
    Script,
)
from tickrig.host.canopen.sdo_transfer import download_number, upload_number
from tickrig.host.rtc.canopen.definition import NodeEntry, Role
from tickrig.host.rtc.canopen.events import Notify, ServerEventType
from tickrig.host.rtc.canopen.proxy import NOTHING, ProxyRequest, ProxyRtc
from tickrig.host.rtc.states import LifeCycleState
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

# Scripts for the operations on a proxy (ours: section 4.3 of the digest, K14, K21).

_CONFIRM_US: Final = 300_000
"""Minimum time limit for a device to report the requested state."""

_CONTROLWORD: Final = 0x6040
_STATUSWORD: Final = 0x6041
_FAULT_RESET: Final = 0x80
_LOOK_US: Final = 10_000
"""Polling interval of the statusword."""

_STATE_BITS: Final = 0x6F
_ENABLING: Final = ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27))
_DISABLING: Final = ((0x07, 0x23), (0x06, 0x21))
"""Controlwords, and the statusword bits that confirm each controlword (CiA 402-2)."""


def _confirm_us(entry: NodeEntry) -> int:
    """Return the time limit for a node to confirm a command (K14)."""
    return max(3_000 * entry.heartbeat_ms, _CONFIRM_US)


@dataclass(frozen=True, slots=True)
class _LifeCycleScripts:
    """The SDO and NMT requests to a node for each operation on its proxy."""

    activate: Callable[[NodeEntry], Script[None]]
    deactivate: Callable[[NodeEntry], Script[None]]
    reset: Callable[[NodeEntry], Script[None]]


def _to(command: NmtCommand, state: NmtState) -> Callable[[NodeEntry], Script[None]]:
    def move(entry: NodeEntry) -> Script[None]:
        yield NmtRequest(command)
        yield AwaitState(state, _confirm_us(entry))

    return move


_start: Final = _to(NmtCommand.START, NmtState.OPERATIONAL)
_enter_pre_operational: Final = _to(NmtCommand.ENTER_PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL)
_reset_node: Final = _to(NmtCommand.RESET_NODE, NmtState.INITIALISING)


def _enable(entry: NodeEntry) -> Script[None]:
    yield from _start(entry)
    yield from _control(entry, _ENABLING)


def _disable(entry: NodeEntry) -> Script[None]:
    yield from _control(entry, _DISABLING)
    yield from _enter_pre_operational(entry)


def _reset_drive(entry: NodeEntry) -> Script[None]:
    """Reset the fault by SDO, except in Stopped. Then reset the node, whatever the result is."""
    try:
        yield from _enter_pre_operational(entry)
        yield from download_number(_CONTROLWORD, 0, 0, 2)
        yield from download_number(_CONTROLWORD, 0, _FAULT_RESET, 2)
        yield Pause(_LOOK_US)
    except (errors.SdoFailed, errors.StateTimeout):
        pass
    yield from _reset_node(entry)


def _control(entry: NodeEntry, words: tuple[tuple[int, int], ...]) -> Script[None]:
    """Write controlwords.

    Each controlword follows when the statusword has confirmed the previous controlword.
    """
    for controlword, wanted in words:
        yield from download_number(_CONTROLWORD, 0, controlword, 2)
        for _ in range(_confirm_us(entry) // _LOOK_US):
            statusword = yield from upload_number(_STATUSWORD, 0)
            if statusword & _STATE_BITS == wanted:
                break
            yield Pause(_LOOK_US)
        else:
            raise errors.StateTimeout(
                f"statusword {statusword:04X}h after controlword {controlword:04X}h"
            )


_PLAIN: Final = _LifeCycleScripts(_start, _enter_pre_operational, _reset_node)

_LIFE_CYCLES: Final[Mapping[Role, _LifeCycleScripts]] = {
    Role.DEVICE_RTC: _PLAIN,
    Role.DEVICE: _PLAIN,
    Role.DRIVE: _LifeCycleScripts(_enable, _disable, _reset_drive),
}


_WELL_US: Final = 60_000_000
"""Time without a fault after which a node has all its restarts again."""


class _RestartCounter:
    """Counter of the restarts of a node.

    Args:
        most: maximum number of successive restarts, or 0 for no restarts.

    Attributes:
        pending: whether the node was lost, and was not restarted yet.
        to_activate: whether the node was Active, and will be activated again once it is Inactive.
        was_active: whether the node was Active when it was lost.
    """

    def __init__(self, most: int) -> None:
        self._most, self._made, self._last_us = most, 0, -_WELL_US
        self.pending = self.to_activate = self.was_active = False

    def lose(self, now_us: int, *, active: bool) -> None:
        """Record that a node was lost, and that no user requested this."""
        if now_us - self._last_us >= _WELL_US:
            self._made = 0
        self.pending = True
        self.was_active |= active or self.to_activate
        self.to_activate = False

    def forget(self) -> None:
        """Leave the node to the user."""
        self.pending = self.to_activate = self.was_active = False

    def leave(self) -> None:
        """Cancel a pending restart, because a user has acted. A running restart continues."""
        if self.pending:
            self.forget()

    def by_hand(self) -> bool:
        """Cancel automatic restarts, because the user restarts the node.

        Return whether the node was Active when it was lost.
        """
        active = self.was_active or self.to_activate
        self.forget()
        return active

    def take(self, now_us: int) -> str:
        """Count an automatic restart that begins now, and return its number, such as `1 of 3`.

        The result is an empty text if no restart is left.
        """
        if self._made >= self._most:
            self.pending = False
            return ""
        active = self.was_active
        self.forget()
        self._made, self._last_us, self.to_activate = self._made + 1, now_us, active
        return f"{self._made} of {self._most}"


_AUTOMATIC: Final = "'restart: 3' of the node"
"""Key of a System Definition that makes restarts automatic."""

_STATES: Final = {
    NmtState.PRE_OPERATIONAL: LifeCycleState.INACTIVE,
    NmtState.OPERATIONAL: LifeCycleState.ACTIVE,
    NmtState.STOPPED: LifeCycleState.ERROR,
}
"""State of a proxy by the state of its device (NEDO report, table 3)."""


class NodeOperations:
    """Keeps a proxy and its CANopen device in the same state.

    The class executes the requests of the proxy on the bus, and moves the proxy to another state
    when the NMT state of the device changes.

    Args:
        entry: settings of the node.
        dialogue: SDO and NMT dialogue with the node.
        notify: function that is called with events.

    Attributes:
        proxy: RT component that represents the device, or None if there is no proxy.
        nmt_state: last reported NMT state of the device, or None before the first report.
        now_us: present time in us.
        resetting: whether a reset that the proxy requested is not finished.
        restart: counter of the automatic restarts that are left.
    """

    def __init__(self, entry: NodeEntry, dialogue: Dialogue, notify: Notify) -> None:
        self._entry, self._dialogue, self._notify = entry, dialogue, notify
        self._life = _LIFE_CYCLES[entry.role]
        self.proxy: ProxyRtc | None = None
        self.nmt_state: NmtState | None = None
        self.now_us = 0
        self.resetting = self._stopping = False
        self.restart = _RestartCounter(entry.restart)

    @property
    def is_inactive(self) -> bool:
        """Whether there is a proxy that is Inactive."""
        return self.proxy is not None and self.proxy.state is LifeCycleState.INACTIVE

    def carry_out(self, *, lost: bool) -> None:
        """Send the proxy's request to the device, unless the device has already executed it.

        Args:
            lost: whether the heartbeat of the device is late.
        """
        if self.proxy is None or (requested := self.proxy.take_request()) is NOTHING:
            return
        state = None if self._dialogue.moves else self.nmt_state
        match requested:
            case ProxyRequest.ACTIVATE if state is NmtState.OPERATIONAL:
                self._activated(None)
            case ProxyRequest.ACTIVATE:
                self._run("activate", self._life.activate(self._entry), self._activated)
            case ProxyRequest.DEACTIVATE if state is not NmtState.PRE_OPERATIONAL:
                self._dialogue.clear()
                self._run("deactivate", self._life.deactivate(self._entry))
            case ProxyRequest.ABORT if lost or state is not NmtState.STOPPED:
                self._dialogue.clear()
                self._stop()
            case ProxyRequest.RESET if not self.resetting:
                self.resetting = True
                self.restart.leave()
                self._run("reset", self._life.reset(self._entry))

    def follow(self, state: NmtState, *, changed: bool) -> None:
        """Move the proxy to the state that its device reported.

        While a request that changes the NMT state of the device is waiting or running, the proxy
        keeps its state.

        Args:
            state: NMT state that the device reported.
            changed: whether the state differs from the previous report.
        """
        proxy = self.proxy
        if proxy is None or self._dialogue.moves or proxy.requested is not NOTHING:
            return
        if self._stopping:
            self._stopping = state is not NmtState.STOPPED
            if self._stopping:
                self._stop()
        elif _STATES[state] is not proxy.state and not proxy.ready:
            if changed:
                text = f"{state.name} while the proxy is {proxy.state.name}"
                self._notify(ServerEventType.FOREIGN_TRANSITION, self._entry.id, text)
            self._move(proxy, _STATES[state])

    def leave_operational(self) -> Script[None]:
        """Return the script that brings the device to Pre-operational as its role requires."""
        return self._life.deactivate(self._entry)

    def say(self, command: NmtCommand) -> None:
        """Send a command after all running requests."""
        self._run("command", _say(command))

    def begin(self) -> None:
        """Drop a pending stop request, because the device starts again."""
        self._stopping = False

    def booted(self) -> None:
        """Record that the device is set up and Pre-operational. The proxy may then leave Error."""
        self.nmt_state, self.resetting = NmtState.PRE_OPERATIONAL, False
        if self.proxy is not None:
            self._leave_error(self.proxy)

    def abort(self) -> None:
        """Move the proxy to Error. Automatic restarts of its node may recover it."""
        self.resetting = False
        if self.proxy is not None:
            self.lose()
            self.proxy.contexts[0].abort_component(self.proxy)

    def lose(self) -> None:
        """Record that the device was lost or reset, and that no user requested this."""
        active = self.proxy is not None and self.proxy.state is LifeCycleState.ACTIVE
        self.restart.lose(self.now_us, active=active)

    def go_on(self) -> None:
        """Reset a lost node that sends frames again, if an automatic restart is left."""
        proxy, busy = self.proxy, self._dialogue.moves or self.resetting or self._stopping
        if proxy is None or busy or proxy.requested is not NOTHING:
            return
        if self.restart.pending and proxy.state is LifeCycleState.ERROR and self.begin_restart():
            proxy.contexts[0].reset_component(proxy)

    def begin_restart(self, *, to_start: bool = False) -> bool:
        """Use up one automatic restart and report it as an event.

        Return False if no restart is left.

        Args:
            to_start: whether the server will activate the node in any case. If this is False and no
                restart is left, an event tells the user to reset or activate the node.
        """
        if which := self.restart.take(self.now_us):
            self._notify(ServerEventType.RESTARTED, self._entry.id, which)
        elif not to_start and (text := self._left_to_do()):
            self._notify(ServerEventType.NOT_RESTARTED, self._entry.id, text)
        return bool(which)

    def _left_to_do(self) -> str:
        """Report the action that a user must take without a restart.

        Report nothing after a recovery.
        """
        entry, was_active = self._entry, self.restart.was_active
        hint = "no restart is left" if entry.restart else f"{_AUTOMATIC} does so by itself"
        if self.proxy is not None and self.proxy.state is LifeCycleState.ERROR:
            then = " and activate" * was_active
            return f"{entry.name} is in Error: reset{then} it; {hint}"
        if was_active:
            return f"{entry.name} was Active and is Inactive now: activate it; {hint}"
        return ""

    def fail(self, failure: Failure) -> None:
        """Record a failure, and move the proxy to Error."""
        self._notify(kind_of(failure), self._entry.id, str(failure))
        self.abort()

    def _run(
        self, what: str, script: Script[None], done: Callable[[Any], None] | None = None
    ) -> None:
        self._dialogue.start(self.now_us, QueuedScript(what, script, done or _nothing, self.fail))

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

    def _activated(self, _: object) -> None:
        if (proxy := self.proxy) is None:
            return
        proxy.confirmed = True
        if self._entry.role is Role.DRIVE:
            for sink in proxy.sinks:
                sink.preset(_CONTROLWORD, _ENABLING[-1][0])

    def _stop(self) -> None:
        """Stop the device, and repeat this with each heartbeat until the device reports Stopped."""
        self._stopping = True
        self.say(NmtCommand.STOP)


def kind_of(failure: Failure) -> ServerEventType:
    """Return the event type of a failure."""
    match failure:
        case errors.WrongIdentity():
            return ServerEventType.WRONG_IDENTITY
        case errors.SdoAborted():
            return ServerEventType.SDO_ABORTED
        case errors.SdoTimeout():
            return ServerEventType.SDO_TIMEOUT
    return ServerEventType.NOT_CONFIRMED


def _say(command: NmtCommand) -> Script[None]:
    yield NmtRequest(command)


def _nothing(_: object) -> None:
    """Do nothing more."""
