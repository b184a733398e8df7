from __future__ import annotations

import pytest

from tests.device.canopen.objects import array, booted, make_bus, u32, write
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import UNCONFIGURED, CanopenSlave
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER


def test_a_slave_without_power_waits_for_its_first_tick() -> None:
    slave = CanopenSlave(Dictionary([]), 5, ())
    assert (slave.now_us, slave.tick_us, slave.due_us) == (0, 1_000, 0)
    assert (slave.state, slave.time_of_day) == (NmtState.INITIALISING, None)
    assert (slave.accepts, slave.reconfigured_by) == (None, frozenset())


@pytest.mark.parametrize("node_id", [1, 127, UNCONFIGURED])
def test_a_node_id_may_be_1_to_127_or_wait_for_lss(node_id: int) -> None:
    assert CanopenSlave(Dictionary([]), node_id, ()).node_id == node_id


@pytest.mark.parametrize("node_id", [-1, 0, 128, 254, 256])
def test_another_node_id_is_refused(node_id: int) -> None:
    with pytest.raises(ValueError, match=f"node-ID {node_id} is not in 1..127"):
        CanopenSlave(Dictionary([]), node_id, ())


@pytest.mark.parametrize(("index", "left"), [(0x1000, 1), (0x1FFF, 1), (0x2000, 2), (0xFFFF, 2)])
def test_reset_communication_resets_1000h_to_1fffh(index: int, left: int) -> None:
    bus = booted(u32(index, 1))
    write(bus, index, 2)
    assert bus.step("000#8205") == ["705#00"]
    assert bus.slave.dictionary[index, 0].number == left


@pytest.mark.parametrize("index", [0x1000, 0x1FFF, 0x2000, 0xFFFF])
def test_reset_node_resets_every_object(index: int) -> None:
    bus = booted(u32(index, 1))
    write(bus, index, 2)
    assert bus.step("000#8105") == ["705#00"]
    assert bus.slave.dictionary[index, 0].number == 1


def test_what_is_sent_without_power_is_lost() -> None:
    bus = make_bus()
    bus.slave.send(0x123, b"")
    assert bus.step() == ["705#00"]
    bus.slave.reset()
    bus.slave.send(0x123, b"")
    assert bus.step() == ["705#00"]


def test_a_reset_forgets_what_services_waited_for() -> None:
    bus = booted(array(0x1016, 0x0007_00C8))
    bus.step("707#05")
    assert bus.slave.due_us == bus.now_us + 200_000
    bus.step("000#8205")
    assert bus.slave.due_us == NEVER


def test_a_change_of_state_is_told_to_what_belongs_to_the_slave_first() -> None:
    bus, told = booted(), list[str]()
    bus.slave.on_state.append(lambda old, new: told.append(f"observer {old.name} {new.name}"))
    bus.slave.entered = lambda old, new: told.append(f"own {old.name} {new.name}")
    bus.step("000#0105", "000#0105")
    own = "PRE_OPERATIONAL OPERATIONAL"
    assert told == [f"own {own}", f"observer {own}"]
