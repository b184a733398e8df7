"""Odometry, which converts wheel angles into a pose."""

from __future__ import annotations

import re
from pathlib import Path
from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose, Wheels, moved, wrap
from tickrig.host.rtc.motion.ports import plausible, read_all, to_pose_2d
from tickrig.host.rtc.states import RtcRefused
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import TimedDoubleSeq

_CONF_LINE: Final = re.compile(r"conf\.([^.\s:=]+)\.([^\s:=]+)\s*[:=]\s*(.*)")


class Odometry(RtComponent):
    """Component that estimates the pose of a cart (middle of the drive axle) from wheel angles.

    The motion is integrated on exact arcs. The port LocalizedPosition exists only because the RH3
    specification (Reference Hardware 3) defines it. The component does not use this port. A message
    is ignored if an angle is not a number, or if the message has too few angles for the configured
    wheel IDs.

    Attributes:
        pose: estimated pose of the cart.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("Odometry", "Pose from wheel angles")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.left_id = bind("leftWheelID", 0, "x>=0")
        self.right_id = bind("rightWheelID", 1, "x>=0")
        self.left_radius = bind("radiusOfLeftWheel", 0.0995, "x>0", unit="m")
        self.right_radius = bind("radiusOfRightWheel", 0.0995, "x>0", unit="m")
        self.axle = bind("lengthOfAxle", 0.464, "x>0", unit="m")
        self._geometry = (self.left_radius, self.right_radius, self.axle)
        bind("radiusOfBodyArea", 0.45, unit="m")
        self.initial = (
            bind("initialPose_x", 0.0, unit="m"),
            bind("initialPose_y", 0.0, unit="m"),
            bind("initialPose_theta", 0.0, unit="rad"),
        )
        self.angles = self.add_port(InPort("CurrentWheelAngle", TimedDoubleSeq))
        self.add_port(InPort("LocalizedPosition", iis.TimedPose2D))
        self.position = self.add_port(OutPort("OdometryPosition", iis.TimedPose2D))
        self.pose = Pose()
        self._before: tuple[float, float] | None = None

    def load(self, path: Path) -> None:
        """Set parameters in the configuration sets to the values of a file such as Odometry.conf.

        Raises:
            OSError: the file cannot be read.
            RtcRefused: a line, a parameter or a value is invalid.
        """
        for set_id, values in read_conf(path).items():
            held = self.configuration.sets.get(set_id, {})
            self.configuration.add_set(set_id, {**held, **values})

    def calibrate(self, wheels: Wheels) -> None:
        """Set the wheel radii and the axle length in the active configuration set.

        Raises:
            RtcRefused: a length is not above 0.
        """
        for parameter, value in zip(self._geometry, wheels, strict=True):
            self.configuration.set(parameter.name, repr(value))

    @property
    def wheels(self) -> Wheels:
        """Radii and axle that apply."""
        return Wheels(*(parameter.value for parameter in self._geometry))

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin at the initial pose."""
        x, y, theta = (parameter.value for parameter in self.initial)
        self.pose, self._before = Pose(x, y, wrap(theta)), None
        self.angles.clear()
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Forget the last wheel angles."""
        self._before = None
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Update the pose by the rotation of the wheels since the last angles."""
        for sample in read_all(self.angles):
            self._add(sample)
        return ReturnCode.RTC_OK

    def _add(self, sample: TimedDoubleSeq) -> None:
        left_id, right_id = self.left_id.value, self.right_id.value
        if max(left_id, right_id) >= len(sample.data):
            return
        angles = sample.data[left_id], sample.data[right_id]
        if not plausible(*angles):
            return
        before, self._before = self._before or angles, angles
        left = (angles[0] - before[0]) * self.left_radius.value
        right = (angles[1] - before[1]) * self.right_radius.value
        self.pose = moved(self.pose, left, right, self.axle.value)
        self.position.write(iis.TimedPose2D(sample.tm, data=to_pose_2d(self.pose)))


def read_conf(path: Path) -> dict[str, dict[str, str]]:
    """Read configuration sets from a file with lines like `conf.default.lengthOfAxle: 0.464`.

    Other lines are settings of OpenRTM and are ignored.

    Returns:
        The values as text, by the name of their parameter, for each configuration set.

    Raises:
        OSError: the file cannot be read.
        RtcRefused: a line begins with `conf.` but has another form. The message has the line.
    """
    sets: dict[str, dict[str, str]] = {}
    for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
        text = line.partition("#")[0].strip()
        if not text.startswith("conf."):
            continue
        if (match := _CONF_LINE.fullmatch(text)) is None:
            raise RtcRefused(f"{path}:{number}: {text!r} is not conf.SET.NAME: VALUE")
        sets.setdefault(match[1], {})[match[2]] = match[3]
    return sets
