"""The life cycle of RTC inside the NMT states (NEDO report, 3.4.43.3, Fig. 110)."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.device_rtc.component import CanopenComponent
from tickrig.device.canopen.device_rtc.transitions import (
    ACTIVITIES,
    ADMITTED,
    ENDING,
    ENTERED,
    STATES,
    STRICT_ERROR,
    RtcState,
)
from tickrig.device.component import CallbackRunner
from tickrig.wire.canopen.nmt import NmtCommand, NmtState


class CanopenLifeCycle(CallbackRunner[CanopenComponent]):
    """Runs the callbacks of a component when its node changes its NMT state, and before.

    The NMT state is the state of the component, once that is initialized. Whoever
    changes it, master, error behaviour or the component itself, the callbacks are the
    same; they run at once, after all services have heard of the change.

    Args:
        node: the slave.
        make: makes a component, joined to the dictionary.

    Attributes:
        component: the component as it is; a reset of the node makes a new one.
    """

    def __init__(self, node: CanopenSlave, make: Callable[[], CanopenComponent]) -> None:
        self._node, self._make = node, make
        self.create()

    def create(self) -> None:
        """Begin with a new component (M1)."""
        super().__init__(self._make())
        self._initialized = self._finalized = False

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
        own = name and getattr(type(self.component), name) is not getattr(CanopenComponent, name)
        return name if own else ""

    def boots(self) -> bool:
        """Run `on_initialize` if that is due; say whether the node boots (M1, K11)."""
        if not self._initialized and not self._finalized:
            self._initialized = self.call("on_initialize")
        return self._initialized and not self._finalized

    def admits(self, command: NmtCommand) -> bool:
        """Run what comes before an NMT command; say whether it is carried out."""
        state = self.state
        table = ADMITTED[state]
        if state is RtcState.ERROR and self.component.strict_cia301:
            table = STRICT_ERROR
        if command not in table:
            return False
        well = self._call_all(table[command])
        if state is RtcState.ERROR:
            return well
        if command is NmtCommand.RESET_NODE:
            self.create()
        return True

    def moved(self, old: NmtState, new: NmtState) -> None:
        """Run the callbacks of a change that was made; an error leads to Error."""
        well = self._call_all(ENTERED.get((old, new), ()))
        if well or new is NmtState.STOPPED:
            return
        if old is NmtState.OPERATIONAL:
            self.call("on_aborting")
        self._node.enter(NmtState.STOPPED)

    def run(self) -> None:
        """Run what the state does; an error leads to Error (M5, M6)."""
        if not self.call(self.activity) and self.state is not RtcState.ERROR:
            self._node.enter(NmtState.STOPPED)

    def finalize(self) -> None:
        """End (M11): the node falls silent until its supply was cut."""
        if self.state in ENDING:
            self._call_all(ENDING[self.state])
            self._finalized = True
            self._node.reset_node()

    def _call_all(self, callbacks: tuple[str, ...]) -> bool:
        """Run callbacks, all of them; False if one failed."""
        results = [self.call(name) for name in callbacks]
        return all(results)
