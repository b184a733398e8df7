"""PositionInput: goals and paths that a person enters."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import ClassVar, Final

from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.ports import plausible, read_newest, to_pose_2d
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.basic import Time, TimedState
from tickrig.wire.rtc_types.rh2 import NavigationState

START_POINT: Final = 100
INTERMEDIATE_POINT: Final = 101
END_POINT: Final = 102
"""`id[0]` of the points of a path; a goal has none."""


class PositionInput(RtComponent):
    """Sends one command after the other; the next when the last one has finished.

    The original waits at its console in on_execute; here nothing waits: `goal`, `path`
    and `end` are called by whoever has the console. Its configuration is declared and
    unused, as there.

    Attributes:
        finished: how many commands have finished.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("PositionInput", "Goals and paths from the console")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        for name, default, unit in (
            ("01_x", 3.4, "m"),
            ("01_y", 7.7, "m"),
            ("01_th", -1.57, "rad"),
        ):
            bind(name, default, unit=unit)
        self.status = self.add_port(InPort("status", TimedState))
        self.position = self.add_port(OutPort("position", iis.TimedPose2D))
        self._commands: deque[tuple[iis.TimedPose2D, ...]] = deque()
        self._running = self._ending = False
        self.finished = 0

    @property
    def idle(self) -> bool:
        """Whether no command waits or runs."""
        return not (self._commands or self._running)

    def goal(self, pose: Pose) -> None:
        """Enter a goal; it waits for those before it.

        Raises:
            ValueError: a number that is none.
        """
        self._commands.append((_point(pose),))

    def path(self, poses: Sequence[Pose]) -> None:
        """Enter a path of two points or more.

        Raises:
            ValueError: fewer points, or a number that is none.
        """
        self._commands.append(_points(poses))

    def replace(self, *poses: Pose) -> None:
        """Enter a goal, or a path of several points, in the place of what runs and waits.

        Raises:
            ValueError: no point, or a number that is none; what runs goes on.
        """
        command = (_point(*poses),) if len(poses) == 1 else _points(poses)
        self._commands.clear()
        self._running = False
        self._commands.append(command)

    def end(self) -> None:
        """Go into Error when all has finished, as the original does after its last command."""
        self._ending = True

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Send the next command, or look whether the last one has finished."""
        status = read_newest(self.status)
        if self._running and status is not None and status.data == NavigationState.FINISH:
            self._running = False
            self.finished += 1
        if self._commands and not self._running:
            self._running = True
            now = Time.from_us(ec.now_us)
            for point in self._commands.popleft():
                self.position.write(iis.TimedPose2D(now, point.id, point.data))
        if self._ending and self.idle:
            return ReturnCode.RTC_ERROR
        return ReturnCode.RTC_OK


def _points(poses: Sequence[Pose]) -> tuple[iis.TimedPose2D, ...]:
    if len(poses) < 2:
        raise ValueError(f"a path has 2 points or more, got {len(poses)}")
    inner = [INTERMEDIATE_POINT] * (len(poses) - 2)
    ids = (START_POINT, *inner, END_POINT)
    return tuple(_point(pose, ident) for ident, pose in zip(ids, poses, strict=True))


def _point(pose: Pose, *ids: int) -> iis.TimedPose2D:
    if not plausible(*pose):
        raise ValueError(f"a pose has three numbers, got {tuple(pose)}")
    return iis.TimedPose2D(id=ids, data=to_pose_2d(pose))
