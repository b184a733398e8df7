"""A scanning range finder on a serial line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from typing import ClassVar, Final

from tickrig.device.body import Pose
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.twin import Copyable
from tickrig.device.urg.scip_server import ScipServer
from tickrig.device.urg.world import Post, UrgParameters, World
from tickrig.wire import scip as status
from tickrig.wire.lines import LineSplitter
from tickrig.wire.uart import UartSetting

# Physical inputs and outputs of a sensor: place, an obstacle and faults.

_FAR_M: Final = 10_000


def _place(name: str, text: str) -> InputSignal:
    return InputSignal(name, text, low=-_FAR_M, high=_FAR_M, unit="m", real=True)


INPUTS: Final = (
    _place("x_m", "place of the sensor"),
    _place("y_m", "place of the sensor, to the left of x"),
    InputSignal("heading_rad", "where it looks", low=-1e6, high=1e6, unit="rad", real=True),
    _place("post_x_m", "place of a person in front of the sensor"),
    _place("post_y_m", "place of the person, to the left of x"),
    InputSignal(
        "post_radius_m", "width of the person; 0 if there is none", high=_FAR_M, unit="m", real=True
    ),
    InputSignal("laser_broken", "the laser gives no light", SignalType.FAULT),
    InputSignal("motor_jammed", "something holds the mirror", SignalType.FAULT),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

_GROUPS: Final = {
    "pose": ("x_m", "y_m", "heading_rad"),
    "post": ("post_x_m", "post_y_m", "post_radius_m"),
}

OUTPUTS: Final = (
    OutputSignal("laser", "1 while the laser is on"),
    OutputSignal("speed_rpm", "turns of the mirror, 0 while it stands", "1/min"),
    OutputSignal("ahead_m", "true distance straight ahead, -1 if nothing is there", "m"),
    OutputSignal("scans", "scans that were measured since power-up"),
    OutputSignal("served", "commands that were answered since power-up"),
)


_TICK_US: Final = 1_000


class Urg(Copyable):
    """A URG-04LX on USB or RS-232C; a `UartDevice`.

    In each tick the sensor processes physical inputs, the end of a scan, and commands, in this
    order. A scan is taken from the pose of the sensor at the end of the scan. Its time stamp is the
    time at its start.

    On RS-232C the reply to SS still has the old bit rate; everything after the reply has the new
    one. RS and a power cut restore the first bit rate.

    Not emulated: warming up, current, the LED. See `View` for missing optics and `ScipServer` for
    missing parts of the protocol.

    Args:
        parameters: parameters of the sensor.
        world: surroundings of the sensor.

    Attributes:
        type_name: name of the device type, for traces.
        inputs: physical inputs; see `INPUTS`.
        world: surroundings of the sensor. Changes apply from the next scan.
    """

    type_name: ClassVar[str] = "urg"

    def __init__(self, parameters: UrgParameters | None = None, world: World | None = None) -> None:
        self.parameters, self.world = parameters or UrgParameters(), world or World()
        self.inputs = QuantityBank(INPUTS, _GROUPS, self._input_set)
        self._server, self._lines = ScipServer(self.parameters), LineSplitter()
        self._on, self._restarted, self._switched = True, False, True
        self._obeyed: tuple[float, ...] = ()

    @property
    def tick_us(self) -> int:
        """Resolution of the sensor's time."""
        return _TICK_US

    @property
    def due_us(self) -> int:
        """The time of the next event without input."""
        if self._restarted or self._switched:
            return 0
        return self._server.due_us

    @property
    def uart(self) -> UartSetting | None:
        """The setting of the RS-232C line, or None on USB."""
        if self.parameters.rs232_baud is None:
            return None
        return UartSetting(self._server.settings.rate)

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """The outputs that `read` accepts."""
        return _OUTPUTS

    @property
    def pose(self) -> Pose:
        """Pose of the sensor."""
        return Pose(*(self.inputs[name] for name in _GROUPS["pose"]))

    @property
    def surroundings(self) -> World:
        """The world with the person in it."""
        x_m, y_m, radius_m = (self.inputs[name] for name in _GROUPS["post"])
        return self.world.with_posts(Post(x_m, y_m, radius_m)) if radius_m else self.world

    @property
    def _switches(self) -> tuple[float, ...]:
        """Return the inputs that act at once; poses are read when a scan ends."""
        inputs = self.inputs
        return inputs["power_cut"], inputs["laser_broken"], inputs["motor_jammed"]

    def reset(self) -> None:
        """Restore the state after power-up."""
        self._restarted = True

    def read(self, name: str, /) -> int | float:
        """Return the value that a physical output had after the latest tick.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        return _READ[name](self)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Run one tick of the sensor: receive commands from the host, answer, and send scans.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: bytes that have arrived since the latest tick.

        Returns:
            The bytes that the sensor sends in this tick.
        """
        if self._restarted:
            self._power_up(now_us)
        sent = self._inputs_changed(now_us) if self.inputs.changed else b""
        if not self._on:
            return b""
        server = self._server
        # The scan first: for a command of the same tick it is the latest scan.
        if server.due_us <= now_us:
            sent += server.end_scan(self.pose, self.surroundings)
        # SCIP lets a host end a line by LF, CR or both. The empty line between CR and LF is not a
        # command.
        for line in self._lines.push(rx.replace(b"\r", b"\n")):
            if line:
                sent += server.obey(now_us, line)
        return sent

    def _power_up(self, now_us: int) -> None:
        self._restarted = False
        self._lines.clear()
        self._server.power_up(now_us)

    def _input_set(self) -> None:
        # Only power and faults act at once. A rig may set the pose each millisecond, which must not
        # make each tick due: the pose counts only when a scan ends.
        self._switched = self._switches != self._obeyed

    def _inputs_changed(self, now_us: int) -> bytes:
        inputs, server = self.inputs, self._server
        inputs.changed = self._switched = False
        self._obeyed = self._switches
        on = not inputs["power_cut"]
        if on != self._on:
            self._on = on
            self._power_up(now_us)
        code = ""
        if inputs["laser_broken"]:
            code = status.LASER_TROUBLE
        elif inputs["motor_jammed"]:
            code = status.MOTOR_TROUBLE
        if code == server.trouble:
            return b""
        return server.fail(code)

    @property
    def _ahead_m(self) -> float:
        pose = self.pose
        ahead_m = self.surroundings.distance_m(pose.x_m, pose.y_m, pose.heading_rad)
        return -1.0 if ahead_m == inf else ahead_m

    @property
    def _speed_rpm(self) -> int:
        turning = self._on and not self.inputs["motor_jammed"]
        return self._server.rotation.present_rpm if turning else 0


_OUTPUTS: Final = {output.name: output for output in OUTPUTS}

_READ: Final[Mapping[str, Callable[[Urg], float]]] = {
    "laser": lambda urg: urg._server.laser,
    "speed_rpm": lambda urg: urg._speed_rpm,
    "ahead_m": lambda urg: urg._ahead_m,
    "scans": lambda urg: urg._server.scans,
    "served": lambda urg: urg._server.served,
}
