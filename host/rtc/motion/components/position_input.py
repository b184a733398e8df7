"""PositionInput, at which a user enters goals and paths."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion import ports
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.path_file import describe_pose, parse_points, read_path
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Time, TimedState

START_POINT: Final = 100
INTERMEDIATE_POINT: Final = 101
END_POINT: Final = 102
"""Values of `id[0]` in the points of a path. A goal has none."""

_DEFINED_PATH: Final = (Pose(1.0), Pose(1.0, 1.0), Pose(0.0, 1.0), Pose())
"""Default of `PositionInput.defined_path`, which is a square of 1 m, back to the origin."""

USAGE: Final = "goal X Y DEG; path FILE; path X Y, X Y DEG; path; end"
"""Text of the possible inputs, in metres and degrees. A file has radians."""


class PositionInput(RtComponent):
    """A component that sends the user's goals and paths, one command after the other.

    Each command waits until the previous command has finished.

    The original waits at its console in on_execute. This component does not block. The owner of the
    console calls `typed` with each line, and a program calls `goal`, `path` and `end`. The
    configuration is declared and unused, as in the original.

    Attributes:
        finished: number of finished commands.
        defined_path: path of the command `path` without a file or points.
        prompt: function that is called with the possible inputs whenever the component needs a
            command. The console prints them.
        report: function that is called with each command that the component sends, and with FINISH.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("PositionInput", "Goals and paths from the console")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        bind("01_x", 3.4, unit="m")
        bind("01_y", 7.7, unit="m")
        bind("01_th", -1.57, unit="rad")
        self.status = self.add_port(InPort("status", TimedState))
        self.position = self.add_port(OutPort("position", iis.TimedPose2D))
        self._commands: deque[tuple[iis.TimedPose2D, ...]] = deque()
        self._running = self._ending = self._prompted = False
        self.finished = 0
        self.defined_path: Sequence[Pose] = _DEFINED_PATH
        self.prompt: Callable[[str], None] | None = None
        self.report: Callable[[str], None] | None = None

    @property
    def idle(self) -> bool:
        """Whether no command is waiting or running."""
        return not (self._commands or self._running)

    def goal(self, pose: Pose) -> None:
        """Enter a goal, to which the cart drives after the earlier commands have finished.

        Raises:
            ValueError: a number is invalid.
        """
        self._commands.append((_point(pose),))

    def path(self, poses: Sequence[Pose]) -> None:
        """Enter a path of two points or more, which the cart follows after the earlier commands.

        Raises:
            ValueError: there are fewer than two points, or a number is invalid.
        """
        self._commands.append(_points(poses))

    def replace(self, *poses: Pose) -> None:
        """Enter a goal (one pose) or a path (several) in place of all running and waiting commands.

        Raises:
            ValueError: there is no pose, or a number is invalid. The earlier commands then remain.
        """
        command = (_point(*poses),) if len(poses) == 1 else _points(poses)
        self._commands.clear()
        self._running = False
        self._commands.append(command)

    def typed(self, line: str) -> None:
        """Enter a command that the user typed, such as `goal 1 0 90`; see `USAGE`.

        The command is executed after the earlier commands.

        Raises:
            ValueError: the command is unknown, a pose or path is invalid, a file cannot be read, or
                `end` was typed before. No command is added in this case.
        """
        self.require_open()
        word, _, rest = line.strip().partition(" ")
        match word, rest.strip():
            case "goal", text if text:
                (pose,) = _exactly(1, parse_points(text), line)
                self.goal(pose)
            case "path", "":
                self.path(self.defined_path)
            case "path", text:
                self.path(parse_points(text) if "," in text else read_path(Path(text).expanduser()))
            case "end", "":
                self.end()
            case _:
                raise ValueError(f"{line!r} is not a command: {USAGE}")

    def require_open(self) -> None:
        """Raise ValueError if `end` was called, and the component was not reset after that."""
        if self._ending:
            raise ValueError(f"{self.instance_name} has ended; reset it, then activate it")

    def end(self) -> None:
        """Make the component move to Error once all commands have finished."""
        self._ending = True

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Prompt again for a command."""
        self._prompted = False
        return ReturnCode.RTC_OK

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        """Accept commands again after `end`."""
        self._ending = False
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Send the next command, or check whether the last command has finished."""
        status = ports.read_newest(self.status)
        if self._running and status is not None and status.data == ports.NavigationState.FINISH:
            self._running = self._prompted = False
            self.finished += 1
            self._say("FINISH")
        if self._commands and not self._running:
            self._running = True
            self._send(self._commands.popleft(), ec)
        if self.idle and self._ending:
            self._say("the end")
            return ReturnCode.RTC_ERROR
        if self.idle and self.prompt is not None and not self._prompted:
            self._prompted = True
            self.prompt(USAGE)
        return ReturnCode.RTC_OK

    def _send(self, points: Sequence[iis.TimedPose2D], ec: ExecutionContext) -> None:
        now = Time.from_us(ec.now_us)
        for point in points:
            self.position.write(iis.TimedPose2D(now, point.id, point.data))
        last = ports.to_pose(points[-1].data) or Pose()
        what = "goal" if len(points) == 1 else f"path of {len(points)} points to"
        self._say(f"{what} {describe_pose(last)}")

    def _say(self, text: str) -> None:
        if self.report is not None:
            self.report(text)


def _exactly(count: int, points: Sequence[Pose], line: str) -> Sequence[Pose]:
    if len(points) != count:
        raise ValueError(f"{line!r} is not a command: {USAGE}")
    return points


def _points(poses: Sequence[Pose]) -> tuple[iis.TimedPose2D, ...]:
    if len(poses) < 2:
        raise ValueError(f"a path has 2 points or more, got {len(poses)}")
    inner = [INTERMEDIATE_POINT] * (len(poses) - 2)
    ids = (START_POINT, *inner, END_POINT)
    return tuple(_point(pose, ident) for ident, pose in zip(ids, poses, strict=True))


def _point(pose: Pose, *ids: int) -> iis.TimedPose2D:
    if not ports.plausible(*pose):
        raise ValueError(f"a pose has three numbers, got {tuple(pose)}")
    return iis.TimedPose2D(id=ids, data=ports.to_pose_2d(pose))
