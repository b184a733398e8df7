"""The life cycle of RTC inside the NMT states (NEDO report, 3.4.43.3, Table 3, Fig. 110).

Where figure and table are silent the decisions K6 to K13 of the project hold.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final

from tickrig.device.canopen.device_rtc.component import Component, Result, ReturnCode
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.canopen.nmt import NmtCommand, NmtState


class RtcState(Enum):
    """State of a component (OMG RTC 1.1, LifeCycleState), and what comes after the end."""

    CREATED = "Created"
    INACTIVE = "Inactive"
    ACTIVE = "Active"
    ERROR = "Error"
    FINALIZED = "Finalized"


STATES: Final = {
    NmtState.INITIALISING: RtcState.CREATED,
    NmtState.PRE_OPERATIONAL: RtcState.INACTIVE,
    NmtState.OPERATIONAL: RtcState.ACTIVE,
    NmtState.STOPPED: RtcState.ERROR,
}
"""Table 3, for a component that was initialized."""

ACTIVITIES: Final = {
    RtcState.INACTIVE: "error_check",
    RtcState.ACTIVE: "on_execute",
    RtcState.ERROR: "on_error",
}
"""What a state does at the rate of the component."""

ALIVE: Final = tuple(ACTIVITIES)
RESETS: Final = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)


class LifeCycle:
    """Runs the callbacks of a component when its node changes its NMT state, and before.

    The NMT state is the state of the component, once that is initialized. Whoever
    changes it, master, error behaviour or the component itself, the callbacks are the
    same; they run at once, after all services have heard of the change.

    Args:
        node: the slave.
        make: makes a component, joined to the dictionary.

    Attributes:
        component: the component as it is; a reset of the node makes a new one.
        latest: name of the callback that ran last, empty before the first.
        executed: how often `on_execute` ran.
    """

    def __init__(self, node: CanopenSlave, make: Callable[[], Component]) -> None:
        self._node, self._make = node, make
        self.create()

    def create(self) -> None:
        """Begin with a new component (M1)."""
        self.component = self._make()
        self._initialized = self._finalized = False
        self.latest, self.executed = "", 0

    @property
    def state(self) -> RtcState:
        """State of the component."""
        if self._finalized:
            return RtcState.FINALIZED
        return STATES[self._node.state] if self._initialized else RtcState.CREATED

    @property
    def activity(self) -> str:
        """Callback that the state runs at the component's rate, empty if it has none."""
        name = ACTIVITIES.get(self.state, "")
        own = name and getattr(type(self.component), name) is not getattr(Component, name)
        return name if own else ""

    def boots(self) -> bool:
        """Run `on_initialize` if that is due; say whether the node boots (M1, K11)."""
        if not self._initialized and not self._finalized:
            self._initialized = self._call("on_initialize")
        return self._initialized and not self._finalized

    def admits(self, command: NmtCommand) -> bool:
        """Run what comes before an NMT command; say whether it is carried out (K8 to K11)."""
        state = self.state
        if state is RtcState.ERROR:
            return self._leaves_error(command)
        if state is RtcState.ACTIVE and command in RESETS:
            self._call("on_deactivated")
        if command is not NmtCommand.RESET_NODE:
            return state in ALIVE
        if state in ALIVE:
            self._call("on_finalize")
        if state is not RtcState.FINALIZED:
            self.create()
        return state is not RtcState.FINALIZED

    def moved(self, old: NmtState, new: NmtState) -> None:
        """Run exit action, effect and entry action of a change that was made (M2 to M7)."""
        match (old, new):
            case (NmtState.OPERATIONAL, NmtState.STOPPED):
                self._call("on_deactivated")
                self._call("on_aborting")
            case (NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL):
                if not self._call("on_deactivated"):
                    self._call("on_aborting")
                    self._node.enter(NmtState.STOPPED)
            case (_, NmtState.OPERATIONAL):
                if not self._call("on_activated"):
                    self._node.enter(NmtState.STOPPED)
            case _:
                return

    def run(self) -> None:
        """Run what the state does; an error leads to Error (M5, M6)."""
        if not self._call(self.activity) and self.state is not RtcState.ERROR:
            self._node.enter(NmtState.STOPPED)

    def finalize(self) -> None:
        """End (M11): the node falls silent until its supply was cut."""
        if self.state not in ALIVE:
            return
        if self.state is RtcState.ACTIVE:
            self._call("on_deactivated")
        self._call("on_finalize")
        self._finalized = True
        self._node.reset_node()

    def _leaves_error(self, command: NmtCommand) -> bool:
        leads_out = command in RESETS
        if self.component.strict_cia301:
            leads_out = command is not NmtCommand.STOP
        return leads_out and self._call("on_reset")

    def _call(self, callback: str) -> bool:
        """Run a callback; False if it failed."""
        self.latest = callback
        self.executed += callback == "on_execute"
        result: Result = getattr(self.component, callback)()
        return result in (None, ReturnCode.RTC_OK)
