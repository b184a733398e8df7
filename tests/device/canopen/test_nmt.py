from __future__ import annotations

import pytest

from tests.device.canopen.objects import write
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.nmt import NmtState

RW = Access.READ | Access.WRITE


def make_bus(heartbeat_ms: int = 0, startup: int = 4) -> Bus:
    entries = [
        EntryDescription(0x1000, 0, "Device type", DataType.UNSIGNED32, Access.READ),
        EntryDescription(0x1017, 0, "Heartbeat", DataType.UNSIGNED16, RW, default=heartbeat_ms),
        EntryDescription(0x1F80, 0, "NMT startup", DataType.UNSIGNED32, RW, default=startup),
        EntryDescription(0x2000, 0, "Mine", DataType.UNSIGNED8, RW, default=7),
    ]
    return Bus(make_slave(Dictionary(entries), node_id=5))


def test_the_first_tick_boots_up() -> None:
    bus = make_bus()
    assert bus.step() == ["705#00"]
    assert bus.slave.state is NmtState.PRE_OPERATIONAL
    assert bus.run(100) == []


@pytest.mark.parametrize(
    "command", ["000#8100", "000#8205", "000#0105", "000#0200", "605#4000100000000000", "705#R1"]
)
def test_a_node_that_initialises_hears_nothing(command: str) -> None:
    bus = make_bus()
    assert bus.step(command) == ["705#00"]
    assert bus.slave.state is NmtState.PRE_OPERATIONAL
    bus.slave.reset()
    assert bus.step(command, command) == ["705#00"]
    assert bus.slave.state is NmtState.PRE_OPERATIONAL
    assert bus.run(20) == []


@pytest.mark.parametrize(
    ("command", "state"),
    [
        ("000#0105", NmtState.OPERATIONAL),
        ("000#0200", NmtState.STOPPED),
        ("000#0106", NmtState.PRE_OPERATIONAL),
        ("000#0305", NmtState.PRE_OPERATIONAL),
        ("000#01", NmtState.PRE_OPERATIONAL),
        ("000#010500", NmtState.PRE_OPERATIONAL),
        ("000#R2", NmtState.PRE_OPERATIONAL),
        ("00000000#0105", NmtState.PRE_OPERATIONAL),
    ],
)
def test_commands_for_this_node_or_all_are_obeyed(command: str, state: NmtState) -> None:
    bus = make_bus()
    bus.step()
    assert bus.step(command) == []
    assert bus.slave.state is state


@pytest.mark.parametrize(
    ("startup", "state"),
    [
        (8, NmtState.OPERATIONAL),
        (10, NmtState.OPERATIONAL),
        (0, NmtState.PRE_OPERATIONAL),
        (9, NmtState.PRE_OPERATIONAL),
        (12, NmtState.PRE_OPERATIONAL),
    ],
)
def test_a_node_starts_itself_if_1f80h_says_so(startup: int, state: NmtState) -> None:
    bus = make_bus(startup=startup)
    bus.step()
    assert bus.slave.state is state


def test_heartbeats_follow_the_boot_up_and_do_not_drift() -> None:
    bus = make_bus(heartbeat_ms=100)
    assert bus.step() == ["705#00"]
    assert [bus.run(100) for _ in range(50)] == [["705#7F"]] * 50


def test_a_heartbeat_time_set_from_the_inside_counts_from_the_next_tick() -> None:
    bus = make_bus()
    bus.step()
    bus.slave.dictionary[0x1017, 0].value = 50
    assert bus.run(50) == []
    assert bus.run(1) == ["705#7F"]
    bus.slave.dictionary[0x1017, 0].value = 0
    assert bus.run(200) == []


def test_writing_the_same_heartbeat_time_restarts_the_period() -> None:
    bus = make_bus(heartbeat_ms=100)
    bus.step()
    assert bus.run(60) == []
    write(bus, 0x1017, 100)
    assert bus.run(100) == []
    assert bus.step() == ["705#7F"]


def test_an_unconfigured_node_sends_no_heartbeat() -> None:
    bus = Bus(make_slave(make_bus(heartbeat_ms=10).slave.dictionary.copy(), UNCONFIGURED))
    assert bus.run(100) == []
    bus.slave.dictionary[0x1017, 0].value = 20
    assert bus.run(100) == []


def test_changes_of_state_are_told() -> None:
    bus, told = make_bus(), list[tuple[NmtState, NmtState]]()
    bus.slave.on_state.append(lambda old, new: told.append((old, new)))
    bus.step("000#0105")
    bus.step("000#0105")
    pre_operational = (NmtState.INITIALISING, NmtState.PRE_OPERATIONAL)
    assert told == [pre_operational, (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL)]


def test_a_slave_accepts_all_from_power_on_and_a_reset_to_the_first_tick() -> None:
    bus, told = make_bus(), list[bool]()
    slave = bus.slave
    assert slave.accepts is None
    slave.on_accepts.append(lambda: told.append(slave.accepts is None))
    bus.step()
    assert told.pop() is False
    slave.reset()
    assert told.pop() is True
    bus.step()
    assert told.pop() is False


def test_reset_communication_keeps_the_application() -> None:
    bus = make_bus()
    bus.step()
    bus.slave.dictionary[0x2000, 0].value = 9
    bus.slave.dictionary[0x1017, 0].value = 50
    assert bus.step("000#8205") == ["705#00"]
    assert bus.slave.dictionary[0x2000, 0].value == 9
    assert bus.slave.dictionary[0x1017, 0].value == 0


def test_reset_node_restores_all() -> None:
    bus = make_bus()
    bus.step()
    bus.slave.dictionary[0x2000, 0].value = 9
    assert bus.step("000#8100") == ["705#00"]
    assert bus.slave.dictionary[0x2000, 0].value == 7


def test_a_power_cycle_boots_again() -> None:
    bus = make_bus(heartbeat_ms=100)
    bus.step("000#0105")
    bus.slave.reset()
    assert bus.slave.due_us == 0
    assert bus.step() == ["705#00"]


@pytest.mark.parametrize("node_id", [0, 128, -1, 256])
def test_an_impossible_node_id_is_refused(node_id: int) -> None:
    with pytest.raises(ValueError, match=r"is not in 1\.\.127"):
        make_slave(Dictionary([]), node_id)


def test_a_slave_that_was_never_ticked_is_not_silent() -> None:
    assert make_slave(Dictionary([]), 5).silent_until_us == 0
