"""What 100 ports at 100 Hz cost as topics of ROS 2, in real time, on loopback.

This process is the system: 100 components in one execution context. A process of its own reads or
writes all topics. The processor is that of the system, with all threads of Cyclone DDS, for each
second of its own time: a system that is late makes up for it.
"""

from __future__ import annotations

import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any, ClassVar, Final

import cyclonedds  # noqa: F401 - without it this suite is left out

from tickrig.host.cli.engine_options import EngineOptions, Ros2Options
from tickrig.host.control.clock import ServingClock
from tickrig.host.rtc import (
    ExecutionContext,
    InPort,
    Manager,
    ModuleSpec,
    OutPort,
    ReturnCode,
    RtComponent,
)
from tickrig.host.rtc.engines.engines_joined import engines_joined
from tickrig.host.rtc.system.schedule import RealTime
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Point2D, Pose2D, Time, TimedLong

PORTS: Final = 100
RATE_HZ: Final = 100.0
DOMAIN: Final = 97
SETTLE_S: Final = 2.0

PEER: Final = """
import sys, time
sys.path.insert(0, sys.argv[1])
from tickrig.host.rtc.engines.ros2.participant import DdsParticipant
from tickrig.host.rtc.engines.ros2.message_types import message_type
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry
kind, does, seconds = sys.argv[2], sys.argv[3], float(sys.argv[4])
participant, count = DdsParticipant({domain}), 0
entries = [TopicEntry("", f"C{{n}}/port", kind) for n in range({ports})]
end_s = time.monotonic() + seconds
if does == "read":
    from cyclonedds.core import Listener
    readers = [participant.reader(entry, Listener()) for entry in entries]
    while time.monotonic() < end_s:
        for reader in readers:
            count += len(reader.take(100))
        time.sleep(0.02)
else:
    vector = message_type("geometry_msgs/msg/Vector3")(0.1, 0.0, 0.2)
    message = message_type(kind)(vector, vector)
    writers = [participant.writer(entry) for entry in entries]
    due_s = time.monotonic()
    while time.monotonic() < end_s:
        for writer in writers:
            writer.write(message)
            count += 1
        due_s += 1 / {rate}
        time.sleep(max(0.0, due_s - time.monotonic()))
print(count)
"""


class Number(RtComponent):
    """Writes a number each period."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Number")
    data_type: ClassVar[type[Struct]] = TimedLong

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.out = self.add_port(OutPort[Any]("port", self.data_type))

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write one."""
        self.out.write(self.value(Time.from_us(ec.now_us)))
        return ReturnCode.RTC_OK

    def value(self, tm: Time) -> Struct:
        """Return what is written."""
        return TimedLong(tm, 5)


class Pose(Number):
    """Writes a pose each period."""

    data_type = iis.TimedPose2D

    def value(self, tm: Time) -> Struct:
        """Return what is written."""
        return iis.TimedPose2D(tm, data=Pose2D(Point2D(1.0, 2.0), 0.5))


class Cart(RtComponent):
    """Reads the newest velocity each period."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Cart")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.velocity = self.add_port(InPort("port", iis.TimedVelocity2D))
        self.count = 0

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Read all that have come."""
        while self.velocity.is_new:
            self.velocity.read()
            self.count += 1
        return ReturnCode.RTC_OK


ROWS: Final[tuple[tuple[str, type[RtComponent], str, str], ...]] = (
    ("numbers out, no engine", Number, "", ""),
    ("Int32 out, without a reader", Number, "std_msgs/msg/Int32", ""),
    ("Int32 out", Number, "std_msgs/msg/Int32", "read"),
    ("Odometry out", Pose, "nav_msgs/msg/Odometry", "read"),
    ("Twist in", Cart, "geometry_msgs/msg/Twist", "write"),
)


def run(seconds: float) -> None:
    """Measure each row for some seconds."""
    print(f"\n{PORTS} ports at {RATE_HZ:g} Hz | share of a core | messages passed | late ticks")
    for name, kind, message, does in ROWS:
        measure(name, kind, message, does, seconds)


def measure(name: str, kind: type[RtComponent], message: str, does: str, seconds: float) -> None:
    """Measure one row, and print it."""
    manager, clock, context = Manager(), ServingClock(), ExecutionContext(RATE_HZ)
    for n in range(PORTS):
        manager.add(kind(f"C{n}"), context=context)
    context.start()
    manager.activate(*(component.instance_name for component in manager.components))
    runner = RealTime(manager, clock)
    with ExitStack() as stack:
        if message:
            engines = EngineOptions(ros2=Ros2Options(DOMAIN))

            def attach(calls: Any) -> None:
                clock.serve = calls.serve

            stack.enter_context(engines_joined(engines, manager, attach, runner.stop))
        peer = start_peer(message, does, seconds) if does else None
        run_for(runner, manager, SETTLE_S)
        before_s, before, late = time.process_time(), passed(manager), runner.late_ticks
        run_for(runner, manager, seconds)
        share = (time.process_time() - before_s) / seconds
        count = passed(manager) - before
        late = runner.late_ticks - late
        if peer is not None:
            while peer.poll() is None:
                run_for(runner, manager, 0.1)
            peer.communicate()
    worst_ms = runner.worst_late_us / 1_000
    print(f"{name:24} | {100 * share:5.1f} % | {count} | {late}, worst {worst_ms:.0f} ms")


def passed(manager: Manager) -> int:
    """Return how many messages were written to DDS, or have come from there."""
    connectors = [port.connectors for each in manager.components for port in each.ports.values()]
    sent = sum(getattr(connector, "sent", 0) for several in connectors for connector in several)
    return sent + sum(getattr(component, "count", 0) for component in manager.components)


def run_for(runner: RealTime, manager: Manager, seconds: float) -> None:
    """Run the system for a time."""
    until_us = manager.now_us + round(1e6 * seconds)
    while manager.now_us < until_us:
        runner.step()


def start_peer(message: str, does: str, seconds: float) -> subprocess.Popen[str]:
    """Start the process that reads or writes all topics."""
    program = PEER.format(domain=DOMAIN, ports=PORTS, rate=RATE_HZ)
    source = str(Path(__file__).parents[2] / "src")
    words = [sys.executable, "-c", program, source, message, does, str(seconds + SETTLE_S)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
