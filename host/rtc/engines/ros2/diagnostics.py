"""States of components as a DiagnosticArray of ROS 2."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.ros2.message_types import message_type
from tickrig.host.rtc.engines.ros2.stamps import Stamps
from tickrig.host.rtc.states import LifeCycleState
from tickrig.host.rtc.system.manager import Manager
from tickrig.wire.rtc_types.basic import Time

TYPE: Final = "diagnostic_msgs/msg/DiagnosticArray"

WARN: Final = 1
LEVELS: Final = {LifeCycleState.ACTIVE: 0, LifeCycleState.ERROR: 2}
"""OK and ERROR of DiagnosticStatus; whoever is neither Active nor in Error is WARN."""


class Diagnostics:
    """Tells the states of all components each period; the manager ticks it.

    Args:
        manager: has the components.
        stamps: the time of the machine.
        period_us: how often.
        send: takes each message.
    """

    def __init__(
        self, manager: Manager, stamps: Stamps, period_us: int, send: Callable[[Any], object]
    ) -> None:
        self._manager, self._stamps, self._send = manager, stamps, send
        self._period_us, self.due_us = period_us, manager.now_us + period_us
        self._array, self._status = message_type(TYPE), message_type(_part("DiagnosticStatus"))
        self._value = message_type(_part("KeyValue"))
        self._header = message_type("std_msgs/msg/Header")
        self._time = message_type("builtin_interfaces/msg/Time")

    def tick(self, now_us: int) -> None:
        """Tell them, if it is time to."""
        if now_us < self.due_us:
            return
        self.due_us += self._period_us * (1 + (now_us - self.due_us) // self._period_us)
        stamp = self._time(*self._stamps.to_ros(Time.from_us(now_us)))
        statuses = [self._of(component) for component in self._manager.components]
        self._send(self._array(self._header(stamp, ""), statuses))

    def _of(self, component: RtComponent) -> Any:
        name, spec = component.instance_name, component.spec
        context = component.contexts[0] if component.contexts else None
        state = context.state_of(component) if context else LifeCycleState.CREATED
        rate = f"{context.rate_hz:g}" if context else "0"
        pairs = {"type": spec.type_name, "rate_hz": rate, "version": spec.version}
        values = [self._value(*pair) for pair in pairs.items()]
        level = LEVELS.get(state, WARN)
        return self._status(level, name, state.name.capitalize(), spec.vendor, values)


def _part(name: str) -> str:
    return f"diagnostic_msgs/msg/{name}"
