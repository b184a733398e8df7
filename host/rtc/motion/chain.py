"""The motion chain of six components, which are joined as in the functional specification."""

from __future__ import annotations

from typing import Final

from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import ExecutionContext, LifeCycleState, Manager
from tickrig.host.rtc.motion.components.navigation import Navigation
from tickrig.host.rtc.motion.components.odometry import Odometry
from tickrig.host.rtc.motion.components.omni_to_2wd import OmniTo2WD
from tickrig.host.rtc.motion.components.path_follower import PathFollower
from tickrig.host.rtc.motion.components.position_input import PositionInput
from tickrig.host.rtc.motion.components.ref_hard import Opener, RefHardRh3

RATE_HZ: Final = 50.0
"""Rate in Hz, which is 1 / control_cycle."""

CONNECTIONS: Final = (
    ("RefHardRh3.OutWheelAngle", "Odometry.CurrentWheelAngle"),
    ("Odometry.OdometryPosition", "OmniTo2WD.current_position"),
    ("Odometry.OdometryPosition", "Navigation.position"),
    ("Odometry.OdometryPosition", "PathFollower.position"),
    ("PositionInput.position", "OmniTo2WD.goal"),
    ("OmniTo2WD.min_path", "Navigation.min_path"),
    ("Navigation.path", "PathFollower.target_path"),
    ("PathFollower.velocity", "RefHardRh3.InTargetVelocity"),
    ("Navigation.status", "OmniTo2WD.status"),
    ("OmniTo2WD.status_out", "PositionInput.status"),
)
"""Connections of the components (RH3 functional specification, wiring)."""

_WIDE: Final = {"dataport.buffer.length": "64"}


class MotionChain:
    """The six components that drive a cart to goals, connected and in one execution context.

    The components run in the order of the data flow, because another order would delay data by
    whole periods.

    Args:
        manager: manager that runs the components.
        open_link: function that opens the serial line to the base of the cart.
        number: number at the end of each instance name, as in OpenRTM. Each cart has its own
            number.
        rate_hz: rate of the execution context.

    Attributes:
        manager: manager that runs the components.
        position_input: component at which goals are entered.
        odometry: component that estimates the pose of the cart.
        components: all six components in the order of execution.
        context: execution context of the components.
    """

    def __init__(
        self,
        manager: Manager,
        open_link: Opener = SerialLink,
        number: int = 0,
        rate_hz: float = RATE_HZ,
    ) -> None:
        self.manager, self._number = manager, number
        self.ref_hard = RefHardRh3(f"RefHardRh3{number}", open_link)
        self.odometry = Odometry(f"Odometry{number}")
        self.position_input = PositionInput(f"PositionInput{number}")
        self.omni_to_2wd = OmniTo2WD(f"OmniTo2WD{number}")
        self.navigation = Navigation(f"Navigation{number}")
        self.path_follower = PathFollower(f"PathFollower{number}")
        self.components = (
            self.ref_hard,
            self.odometry,
            self.position_input,
            self.omni_to_2wd,
            self.navigation,
            self.path_follower,
        )
        self.context = ExecutionContext(rate_hz)
        for component in self.components:
            manager.add(component, context=self.context)
        self.context.start()
        for first, second in CONNECTIONS:
            manager.connect(self._named(first), self._named(second), _WIDE)

    @property
    def in_error(self) -> tuple[str, ...]:
        """Names of the components in Error."""
        state_of, error = self.context.state_of, LifeCycleState.ERROR
        return tuple(c.instance_name for c in self.components if state_of(c) is error)

    def use(self, set_id: str) -> None:
        """Activate a configuration set, given by its ID, in all components that have it."""
        for component in self.components:
            if set_id in component.configuration.sets:
                component.configuration.activate(set_id)

    def activate(self) -> None:
        """Request that all six components move to Active."""
        self.manager.activate(*(component.instance_name for component in self.components))

    def deactivate(self) -> None:
        """Request that all Active components move to Inactive.

        A component that is about to move to Error is not affected.
        """
        for component in self.components:
            self.context.deactivate_component(component)

    def _named(self, port: str) -> str:
        component, _, name = port.partition(".")
        return f"{component}{self._number}.{name}"
