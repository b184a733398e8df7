"""python-can on a rig in virtual time: nothing here waits."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path

import can
import canopen
import pytest
from can.typechecking import CanFilters

from tests.emulators.can.can_bench import Log, frames
from tests.emulators.can.test_can_rig import Node
from tests.emulators.sim_bench import eds
from tickrig.emulators.can.outside.interface import CHANNELS, TickrigBus
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import MOST_LOOKS
from tickrig.emulators.rig.station import Station
from tickrig.host.links.can_link import to_frame, to_message


@pytest.fixture
def log() -> Iterator[Log]:
    wire = CanWire()
    node = Node(1, period_us=50_000, accepts=frozenset({0x80}))
    with CHANNELS.offer("robot", Rig(Station(node, wire.end())), wire):
        yield Log(wire)


def open_bus(can_filters: CanFilters | None = None) -> TickrigBus:
    return TickrigBus("robot", can_filters)


def test_python_can_finds_the_interface_by_its_name() -> None:
    (point,) = entry_points(group="can.interface", name="tickrig")
    assert point.load() is TickrigBus


def test_a_bus_is_opened_by_the_name_of_its_channel(log: Log) -> None:
    with can.Bus(interface="tickrig", channel="robot", bitrate=500_000) as bus:
        assert isinstance(bus, TickrigBus)
        assert str(bus) == "tickrig robot"


def test_time_passes_while_a_message_is_waited_for(log: Log) -> None:
    with open_bus() as bus:
        bus.send(to_message(frames("080#")[0]))
        message = bus.recv(1)
        assert message is not None
        assert (to_frame(message), bus.now_us) == (frames("201#0100")[0], 4_066)
        assert (message.timestamp, message.channel) == (0.004066, "robot")
        assert (bus.recv(0.01), bus.now_us) == (None, 14_066)
        assert bus.recv(0) is None


def test_own_messages_are_received_when_they_have_been_on_the_bus(log: Log) -> None:
    with can.Bus("robot", "tickrig", receive_own_messages=True) as bus, open_bus() as other:
        for frame in frames("181#01 180#02"):
            bus.send(to_message(frame))
        other.send(to_message(frames("100#")[0]))
        heard = [bus.recv(1) for _ in range(4)]
        assert [(str(to_frame(one)), one.is_rx) for one in heard if one] == [
            *(("100#", True), ("181#01", False), ("180#02", False), ("101#01", True)),
        ]
        times = [one.timestamp for one in heard if one]
        assert times == sorted(times)
        assert [str(to_frame(one)) for one in iter(lambda: other.recv(0), None) if one] == [
            *("181#01", "180#02", "101#01"),
        ]


def test_a_bus_without_the_option_does_not_receive_its_own_messages(log: Log) -> None:
    with can.Bus("robot", "tickrig", receive_own_messages=False) as bus:
        bus.send(to_message(frames("181#01")[0]))
        assert bus.recv(0.001) is None


def test_own_messages_that_are_filtered_or_lost_are_not_received(log: Log) -> None:
    filters: CanFilters = [{"can_id": 0x180, "can_mask": 0x7FF}]
    with TickrigBus("robot", filters, receive_own_messages=True) as bus:
        bus.send(to_message(frames("181#01")[0]))
        assert bus.recv(0.001) is None
        faults = bus._host._end.wire.faults
        faults.arm("drop", "1.0")
        bus.send(to_message(frames("180#02")[0]))
        assert bus.recv(0.001) is not None  # it was sent well, and taken by nobody
        faults.clear("drop")
        faults.arm("short")
        bus.send(to_message(frames("180#03")[0]))
        assert bus.recv(0.001) is None


def test_a_bus_that_is_to_listen_only_is_refused(log: Log) -> None:
    with pytest.raises(can.CanInitializationError, match="listen_only is not emulated"):
        can.Bus("robot", "tickrig", listen_only=True)


def test_filters_count_and_the_timeout_is_that_of_the_rig(log: Log) -> None:
    with open_bus(can_filters=[{"can_id": 0x201, "can_mask": 0x7FF}]) as bus:
        assert (bus.recv(1), bus.now_us) == (None, 1_000_000)


@pytest.mark.parametrize("kind", ["log", "asc", "blf", "csv", "trc"])
def test_a_logger_of_the_library_writes_what_its_reader_reads(
    log: Log, tmp_path: Path, kind: str
) -> None:
    path = tmp_path / f"run.{kind}"
    with can.Bus(interface="tickrig", channel="robot") as bus, can.Logger(path) as logger:
        for message in [bus.recv(0.1), bus.recv(0.1)]:
            assert message is not None
            logger(message)
    with can.LogReader(path) as reader:
        assert [message.arbitration_id for message in reader] == [0x101, 0x101]


def test_several_buses_of_one_channel_hear_each_other(log: Log) -> None:
    with open_bus() as one, open_bus() as other:
        one.send(to_message(frames("123#01")[0]))
        message = other.recv(1)
        assert message is not None
        assert to_frame(message) == frames("123#01")[0]


def test_periodic_messages_are_sent_in_virtual_time(log: Log) -> None:
    with open_bus() as bus:
        messages = [to_message(frame) for frame in frames("300#01 300#02")]
        task = bus.send_periodic(messages, 0.01)
        assert isinstance(task, can.ModifiableCyclicTaskABC)
        bus.recv(0.025)
        task.modify_data([to_message(frame) for frame in frames("300#03 300#04")])
        bus.recv(0.01)
        task.stop()
        bus.recv(0.01)
    assert log.text == "300#01 300#02 300#01 300#04"


@pytest.mark.parametrize(
    "options", [{"duration": 1.0}, {"autostart": False}, {"modifier_callback": print}]
)
def test_other_kinds_of_periodic_messages_are_refused(log: Log, options: dict[str, object]) -> None:
    with open_bus() as bus, pytest.raises(NotImplementedError):
        bus.send_periodic(can.Message(), 0.01, **options)  # type: ignore[arg-type]  # by name


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (can.Message(is_fd=True, data=bytes(12)), "CAN FD"),
        (can.Message(is_error_frame=True), "error frames"),
        (can.Message(arbitration_id=0x800, is_extended_id=False), "CAN-ID 0x800 is not 11-bit"),
    ],
)
def test_what_cannot_be_on_the_bus_is_told(log: Log, message: can.Message, reason: str) -> None:
    with open_bus() as bus, pytest.raises(can.CanOperationError, match=reason):
        bus.send(message)


def test_a_bus_that_was_shut_down_says_so(log: Log) -> None:
    bus = open_bus()
    bus.shutdown()
    with pytest.raises(can.CanOperationError, match="closed"):
        bus.send(can.Message())
    with pytest.raises(can.CanOperationError, match="closed"):
        bus.recv(1)


def test_a_channel_is_there_only_while_it_is_offered(log: Log) -> None:
    twice = CHANNELS.offer("robot", Rig(), CanWire())
    with pytest.raises(ValueError, match="'robot' is offered already"), twice:
        pass
    assert CHANNELS.names == ("robot",)
    with pytest.raises(can.CanInitializationError, match="no rig offers channel 'car'; known: rob"):
        TickrigBus("car")


def test_the_canopen_library_can_use_it_by_hand(log: Log) -> None:
    with open_bus() as bus:
        network = canopen.Network(bus)
        node = network.add_node(canopen.RemoteNode(5, eds()))
        node.nmt.state = "OPERATIONAL"
        while (message := bus.recv(0.01)) is not None:
            network.listeners[0].on_message_received(message)  # type: ignore[no-untyped-call]
    assert log.text == "000#0105"


def test_a_loop_that_only_polls_is_told_what_to_do(log: Log) -> None:
    with open_bus() as bus:
        with pytest.raises(can.CanOperationError, match="give recv or receive a timeout, or sleep"):
            all(bus.recv(0) is None for _ in range(2 * MOST_LOOKS))
        assert (bus.recv(0.001), bus.recv(0), bus.now_us) == (None, None, 1_000)
