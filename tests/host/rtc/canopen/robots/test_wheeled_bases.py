"""Bases on wheels: what their drives are told, and the pose that is made of what they say."""

from __future__ import annotations

from math import inf, nan, pi
from typing import Any

import pytest

from tickrig.host.rtc import (
    ExecutionContext,
    InPort,
    Manager,
    ModuleSpec,
    OutPort,
    RtComponent,
    connect,
)
from tickrig.host.rtc.canopen.robots import WHEELS, Beego, FourX, Joystick, WheeledBase
from tickrig.host.rtc.ports.data_port import DataPort
from tickrig.host.rtc.system.system import restore
from tickrig.host.rtc.system.system_file import parse_toml
from tickrig.wire.rtc_types.rtc import (
    Time,
    TimedLong,
    TimedPose2D,
    TimedShort,
    TimedVelocity2D,
    Velocity2D,
)

PERIOD_US = 10_000


class Drives(RtComponent):
    """The other end of every port of a base."""

    spec = ModuleSpec("Drives")

    def __init__(self, base: RtComponent) -> None:
        super().__init__("Drives0")
        for port in base.ports.values():
            assert isinstance(port, DataPort)
            turned = OutPort[Any] if isinstance(port, InPort) else InPort[Any]
            self.add_port(turned(port.name, port.data_type))

    def write(self, name: str, value: object) -> None:
        out = self.ports[name]
        assert isinstance(out, OutPort)
        out.write(value)

    def latest(self, name: str) -> Any:
        port, latest = self.ports[name], None
        assert isinstance(port, InPort)
        while port.is_new:
            latest = port.read()
        return latest


class Bench:
    """A base in a manager, in virtual time."""

    def __init__(self, base: WheeledBase) -> None:
        self.base, self.drives, self.manager = base, Drives(base), Manager()
        self.manager.add(base, rate_hz=100.0)
        self.manager.add(self.drives)
        for name in base.ports:
            self.manager.connect(f"{base.instance_name}.{name}", f"Drives0.{name}")
        self.now_us = 0
        self.manager.activate(base.instance_name)
        self.run(1)

    def run(self, periods: int) -> None:
        for _ in range(periods):
            self.now_us += PERIOD_US
            self.manager.run_to(self.now_us)

    def drive(self, vx: float, va: float = 0.0, vy: float = 0.0) -> None:
        self.drives.write("velocity", TimedVelocity2D(data=Velocity2D(vx, vy, va)))
        self.run(1)

    def told(self, *names: str) -> list[int]:
        return [self.drives.latest(name).data for name in names]


SPEEDS = ("left_speed", "right_speed")
REFERENCES = tuple(f"{wheel}_reference" for wheel in WHEELS)


def test_beego_tells_its_drives_the_speeds_of_their_motors() -> None:
    bench = Bench(Beego("Beego0"))
    bench.drive(0.5)
    rpm = round(0.5 / 0.078 * 51 * 60 / (2 * pi))
    assert bench.told(*SPEEDS) == [rpm, rpm]
    bench.drive(0.0, 1.0)
    rpm = round(0.165 / 0.078 * 51 * 60 / (2 * pi))
    assert bench.told(*SPEEDS) == [-rpm, rpm]


def test_fourx_turns_the_wheels_of_a_side_alike() -> None:
    bench = Bench(FourX("Fourx0"))
    bench.drive(0.2, 0.5)  # left 0.1 m/s, right 0.3 m/s; 0.6283 m/s is full scale
    assert bench.told(*REFERENCES) == [5215, 5215, 15645, 15645]


def test_a_speed_beyond_the_scale_slows_both_sides_down_alike() -> None:
    bench = Bench(FourX("Fourx0"))
    bench.drive(2.0, 5.0)  # left 1 m/s, right 3 m/s
    assert bench.told(*REFERENCES) == [10922, 10922, 32767, 32767]


@pytest.mark.parametrize("wrong", [(0.1, 0.0, 0.01), (nan, 0.0, 0.0), (0.0, inf, 0.0)])
def test_a_velocity_that_it_cannot_drive_is_refused(
    wrong: tuple[float, float, float], caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench(FourX("Fourx0"))
    bench.drive(0.1)
    before = bench.told(*REFERENCES)
    bench.drive(*wrong)
    assert bench.told(*REFERENCES) == before
    assert bench.base.refused == 1
    assert "Fourx0: cannot drive Velocity2D" in caplog.text


def test_without_a_velocity_for_half_a_second_the_wheels_stop() -> None:
    bench = Bench(FourX("Fourx0"))
    bench.drive(0.1)
    bench.run(50)
    assert bench.told(*REFERENCES)[0] > 0
    bench.run(1)
    assert bench.told(*REFERENCES) == [0, 0, 0, 0]


def test_the_wheels_stop_when_it_is_deactivated() -> None:
    bench = Bench(Beego("Beego0"))
    bench.drive(0.1)
    bench.manager.deactivate("Beego0")
    bench.run(1)
    assert bench.told(*SPEEDS) == [0, 0]


def test_the_pose_of_beego_is_that_of_its_counts_also_beyond_their_end() -> None:
    bench, turn = Bench(Beego("Beego0")), 51 * 2_000
    high = 2**31 - 1 - turn // 2
    for at in (high, high + turn - 2**32):
        bench.drives.write("left_position", TimedLong(Time(), at))
        bench.drives.write("right_position", TimedLong(Time(), at))
        bench.run(1)
    pose = bench.drives.latest("pose")
    assert isinstance(pose, TimedPose2D)
    assert pose.data.position.x == pytest.approx(2 * pi * 0.078)
    assert (bench.base.pose.y, bench.base.pose.heading) == (0.0, 0.0)


def test_where_a_drive_reports_first_does_not_matter() -> None:
    bench = Bench(Beego("Beego0"))
    bench.drives.write("left_position", TimedLong(Time(), 123_456))
    bench.run(5)
    assert bench.base.pose.x == 0.0


def test_the_pose_of_fourx_is_added_up_from_measured_speeds() -> None:
    bench = Bench(FourX("Fourx0"))
    for wheel in WHEELS:
        bench.drives.write(f"{wheel}_speed", TimedShort(Time(), 32_767 // 2))
    bench.run(100)
    assert bench.base.pose.x == pytest.approx(pi * 0.1, rel=1e-4)
    bench.drives.write("fl_speed", TimedShort(Time(), 0))
    bench.drives.write("rl_speed", TimedShort(Time(), 0))
    bench.run(10)
    assert bench.base.pose.heading == pytest.approx(pi * 0.1 / 0.4 * 0.1, rel=1e-3)


def test_each_activation_begins_at_zero() -> None:
    bench = Bench(FourX("Fourx0"))
    bench.drives.write("fl_speed", TimedShort(Time(), 1_000))
    bench.run(10)
    bench.manager.deactivate("Fourx0")
    bench.run(1)
    bench.manager.activate("Fourx0")
    bench.run(3)
    assert bench.base.pose == (0.0, 0.0, 0.0)


def test_a_joystick_asks_for_a_velocity_in_each_period() -> None:
    manager, stick = Manager(), Joystick("Joystick0")
    manager.add(stick, rate_hz=20.0)
    sink = InPort("in", TimedVelocity2D)
    owner = manager.add(Sink("Sink0", sink))
    manager.connect("Joystick0.velocity", f"{owner.instance_name}.in")
    manager.activate("Joystick0")
    stick.tilt(50, -250)
    manager.run_to(200_000)
    heard = [sink.read() for _ in range(3) if sink.is_new]
    assert [(v.tm.nsec // 1_000_000, v.data) for v in heard if v] == [
        (ms, Velocity2D(0.25, 0.0, -1.0)) for ms in (50, 100, 150)
    ]


class Sink(RtComponent):
    spec = ModuleSpec("Sink")

    def __init__(self, instance_name: str, port: InPort[TimedVelocity2D]) -> None:
        super().__init__(instance_name)
        self.add_port(port)


def test_a_stick_is_held_as_it_is_typed() -> None:
    stick = Joystick("Joystick0")
    drives = Drives(stick)
    connect(stick.velocity, drives.ports["velocity"])
    for line, expected in (("50", (0.25, 0.0)), ("100 -50", (0.5, -0.5)), ("0", (0.0, 0.0))):
        stick.typed(line)
        stick.on_execute(ExecutionContext())
        data = drives.latest("velocity").data
        assert (data.vx, data.va) == expected


@pytest.mark.parametrize("line", ["", "go", "1 2 3", "101", "0 -101", "nan", "0 inf"])
def test_a_line_that_is_no_stick_is_refused_and_changes_nothing(line: str) -> None:
    stick = Joystick("Joystick0")
    stick.typed("100")
    with pytest.raises(ValueError, match=r"is not FORWARD \[LEFT\], each -100\.\.100 %"):
        stick.typed(line)
    drives = Drives(stick)
    connect(stick.velocity, drives.ports["velocity"])
    stick.on_execute(ExecutionContext())
    assert drives.latest("velocity").data == Velocity2D(0.5, 0.0, 0.0)


SYSTEM = """
[[component]]
type = "Joystick"
name = "Joystick0"
rate_hz = 100.0
active = true

[[component]]
type = "{base}"
name = "Base0"
rate_hz = 100.0
active = true

[[connection]]
ports = ["Joystick0.velocity", "Base0.velocity"]
"""


def component(manager: Manager, name: str) -> RtComponent:
    return next(each for each in manager.components if each.instance_name == name)


@pytest.mark.parametrize("base", ["Beego", "FourX"])
def test_robots_of_a_system_file_drive_as_a_stick_is_typed(base: str) -> None:
    manager = Manager()
    restore(manager, parse_toml(SYSTEM.format(base=base)))
    robot = component(manager, "Base0")
    assert isinstance(robot, WheeledBase)
    drives = manager.add(Drives(robot), rate_hz=100.0)
    out = next(name for name in robot.ports if name.startswith(("left_speed", "fl_reference")))
    manager.connect(f"Base0.{out}", f"Drives0.{out}")
    stick = component(manager, "Joystick0")
    assert isinstance(stick, Joystick)
    stick.typed("50")
    manager.run_for(100_000)
    assert drives.latest(out).data > 0
