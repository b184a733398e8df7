"""A rig's bus joined with one of python-can; the clock wakes at each tick and never waits."""

from __future__ import annotations

from collections.abc import Iterator

import can
import pytest

from tests.emulators.can.can_bench import Log, frames
from tests.emulators.can.test_can_rig import Clock, Node
from tickrig.emulators.can.outside.bridge import CanBridge
from tickrig.emulators.can.outside.bus_port import FRAMES_A_POLL, CanBusPort
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.links.can_link import to_frame, to_message
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER


@pytest.fixture
def host() -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel="can_bridge") as bus:
        yield bus


@pytest.fixture
def port() -> Iterator[CanBusPort]:
    port = CanBusPort(can.Bus(interface="virtual", channel="can_bridge"))
    yield port
    port.close()


def all_of(bus: can.BusABC) -> Frames:
    heard = []
    while (message := bus.recv(0)) is not None:
        heard.append(to_frame(message))
    return tuple(frame for frame in heard if frame)


def test_nodes_hear_each_other_and_the_outside_hears_them_once(
    host: can.BusABC, port: CanBusPort
) -> None:
    wire = CanWire()
    log = Log(wire)
    first, second = Node(1, accepts=frozenset({0x80})), Node(2, accepts=frozenset({0x201}))
    stations = [Station(node, wire.end()) for node in (first, second)]
    rig = Rig(*stations, bridges=[CanBridge(wire.end(), port)], clock=Clock())
    rig.run_to(10_000)
    host.send(to_message(frames("080#")[0]))
    rig.run_to(30_000)
    assert second.heard == ["201#0100"]
    assert all_of(host) == frames("201#0100 202#0100")
    assert log.text == "080# 201#0100 202#0100"


def test_what_the_outside_sent_is_not_charged_for_being_polled(
    host: can.BusABC, port: CanBusPort
) -> None:
    wire, node = CanWire(), Node(1, period_us=10_000, accepts=frozenset({0x80}))
    rig = Rig(Station(node, wire.end()), bridges=[CanBridge(wire.end(), port)], clock=Clock())
    rig.run_to(10_000)
    host.send(to_message(frames("080#")[0]))
    rig.run_to(20_000)
    assert node.heard == ["080#"]
    assert node.ticks == [10_000, 11_000, 14_000, 20_000]


def test_frames_are_handed_out_within_a_millisecond(host: can.BusABC, port: CanBusPort) -> None:
    wire = CanWire()
    node, bridge = Node(1, tick_us=10_000, period_us=10_000), CanBridge(wire.end(), port)
    assert bridge.due_us == NEVER
    rig = Rig(Station(node, wire.end()), bridges=[bridge])
    rig.run_to(10_999)
    assert all_of(host) == ()
    rig.run_to(11_000)
    assert all_of(host) == frames("101#01")


def test_one_poll_takes_a_limited_number_of_frames(host: can.BusABC, port: CanBusPort) -> None:
    for _ in range(FRAMES_A_POLL + 1):
        host.send(to_message(frames("080#")[0]))
    host.send(can.Message(is_error_frame=True))
    assert [len(port.poll(0)) for _ in range(3)] == [FRAMES_A_POLL, 1, 0]
    assert (port.errors, port.due_us) == (1, NEVER)


class Stuck(can.BusABC):
    """A bus whose adapter takes nothing while it is stuck."""

    def __init__(self) -> None:
        super().__init__("stuck")
        self.stuck, self.sent = True, list[can.Message]()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self.stuck:
            raise can.CanOperationError("transmit buffer full")
        self.sent.append(msg)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self.stuck:
            raise can.CanOperationError("gone")
        return None


def test_what_an_adapter_does_not_take_is_kept_in_order(caplog: pytest.LogCaptureFixture) -> None:
    bus = Stuck()
    port = CanBusPort(bus, queue_frames=3)
    port.send(0, frames("001# 002#"))
    port.send(0, frames("003# 004# 005#"))
    assert (port.poll(0), port.lost, port.failed) == ((), 2, "gone")
    assert caplog.messages == [
        "CAN bus: transmit buffer full; what it does not take is kept",
        "CAN bus: a read has failed: gone; what came is lost",
        "CAN bus: 10 reads have failed: gone; what came is lost",
    ]
    bus.stuck = False
    assert (port.poll(0), port.failed) == ((), "")
    assert tuple(to_frame(message) for message in bus.sent) == frames("001# 002# 003#")
    port.close()
