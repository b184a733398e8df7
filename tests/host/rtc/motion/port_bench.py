"""A component alone: what a test feeds its InPorts, and what its OutPorts write."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from tickrig.host.rtc import ExecutionContext, InPort, Manager, OutPort, RtComponent
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.ports import read_all, to_pose, to_pose_2d
from tickrig.host.rtc.ports.connect import connect
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.idl import Struct

R = TypeVar("R", bound=RtComponent)
PERIOD_US = 20_000
WIDE = {"dataport.buffer.length": "64"}


class PortBench(Generic[R]):
    """A component in an execution context of 50 Hz, Active from the first period on."""

    def __init__(self, component: R, **settings: str) -> None:
        self.component = component
        for name, text in settings.items():
            component.configuration.set(name, text)
        self.manager, self.context = Manager(), ExecutionContext(50.0)
        self.manager.add(component, context=self.context)
        self.context.start()
        self._feeds: dict[str, OutPort[Any]] = {}
        self._ends: dict[str, InPort[Any]] = {}
        for name, port in component.ports.items():
            if isinstance(port, InPort):
                self._feeds[name] = OutPort(f"to_{name}", port.data_type)
                connect(self._feeds[name], port, WIDE)
            elif isinstance(port, OutPort):
                self._ends[name] = InPort(f"from_{name}", port.data_type)
                connect(port, self._ends[name], WIDE)
        self.activate()

    def activate(self) -> None:
        self.manager.activate(self.component.instance_name)
        self.period()

    def deactivate(self) -> None:
        self.manager.deactivate(self.component.instance_name)
        self.period()

    @property
    def state(self) -> str:
        return self.manager.state_of(self.component.instance_name).name

    def feed(self, name: str, *values: Struct) -> None:
        for value in values:
            self._feeds[name].write(value)

    def period(self, count: int = 1) -> None:
        self.manager.run_for(count * PERIOD_US)

    def taken(self, name: str) -> list[Any]:
        """Return what an OutPort wrote since the last call."""
        return list(read_all(self._ends[name]))

    def after(self, name: str, feed: str, *values: Struct) -> list[Any]:
        """Return what an OutPort writes in a period with these values at an InPort."""
        self.taken(name)
        self.feed(feed, *values)
        self.period()
        return self.taken(name)


def at(x: float, y: float = 0.0, heading: float = 0.0, *ids: int) -> iis.TimedPose2D:
    """Return a pose as a port carries it."""
    return iis.TimedPose2D(id=ids, data=to_pose_2d(Pose(x, y, heading)))


def way(*poses: Pose) -> iis.TimedPath2DSeq:
    """Return a list of poses as a port carries it."""
    return iis.TimedPath2DSeq(pose=tuple(map(to_pose_2d, poses)))


def poses_of(path: iis.TimedPath2DSeq) -> list[Pose]:
    """Return a list of poses that a port carried."""
    return [pose for data in path.pose if (pose := to_pose(data)) is not None]
