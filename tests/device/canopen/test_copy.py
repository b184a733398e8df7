"""What slaves of one type share, and that a twin of a slave has values of its own."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import pytest

from tests.device.canopen.pdo_bench import OFF, PdoBench
from tests.device.canopen.reference import make_dictionary
from tickrig.device.canopen.models import epos
from tickrig.device.canopen.models.motor_core_unit import MotorCoreUnit, make_motor_core_unit
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.can import CanFrame, Frames

COPIES: dict[str, Callable[[CanopenSlave], CanopenSlave]] = {
    "deepcopy": copy.deepcopy,
    "pickle": lambda slave: pickle.loads(pickle.dumps(slave)),
}
each_copy = pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)


def frames(*texts: str) -> Frames:
    return tuple(map(CanFrame.parse, texts))


def test_another_dictionary_has_the_defaults_and_nobodys_rules() -> None:
    original = make_dictionary()
    entry = original[0x2000, 0]
    entry.written = print
    entry.watch(print)
    entry.value = 7
    twin = original.copy()[0x2000, 0]
    assert (twin.value, twin.written, twin.watchers) == (0, None, ())
    twin.value = 9
    assert entry.value == 7


def test_another_dictionary_shares_the_description() -> None:
    original = make_dictionary()
    twin = original.copy()
    assert twin.description is original.description
    assert [entry.description for entry in twin] == [entry.description for entry in original]
    assert twin.look_up(b"\x00\x20\x00") is twin[0x2000, 0]
    assert twin.objects == original.objects


def test_a_deep_copy_shares_the_description() -> None:
    slave = make_slave(make_dictionary(), 5)
    twin = copy.deepcopy(slave)
    assert twin.dictionary.description is slave.dictionary.description
    for mine, theirs in zip(twin.dictionary, slave.dictionary, strict=True):
        assert mine is not theirs
        assert mine.description is theirs.description


@each_copy
def test_an_rpdo_of_a_copy_writes_the_copy(copied: Callable[[CanopenSlave], CanopenSlave]) -> None:
    bench = PdoBench()
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x6200_0108)
    bench.set_rpdo1(255)
    bench.operational()
    twin = copied(bench.slave)
    twin.tick(bench.now_us + 1_000, frames("205#5A"))
    assert (twin.dictionary[0x6200, 1].number, bench.value(0x6200, 1)) == (0x5A, 0)
    bench.step("205#A5")
    assert (twin.dictionary[0x6200, 1].number, bench.value(0x6200, 1)) == (0x5A, 0xA5)


@each_copy
def test_a_copy_of_a_drive_that_moves_moves_on(
    copied: Callable[[CanopenSlave], CanopenSlave],
) -> None:
    slave = epos.make_epos(5)
    now_us = 0
    script = ("000#0105", "205#060000000000", "205#070000000000", "205#0F0000000000")
    for frame in (*script, "205#1F0010270000"):
        now_us += 1_000
        slave.tick(now_us, frames(frame))
    twin = copied(slave)
    for _ in range(50):
        now_us += 1_000
        assert twin.tick(now_us, ()) == slave.tick(now_us, ())
    assert [entry.data for entry in twin.dictionary] == [entry.data for entry in slave.dictionary]


@each_copy
def test_a_copy_of_a_unit_with_a_fault_has_it_too(
    copied: Callable[[CanopenSlave], CanopenSlave],
) -> None:
    slave = make_motor_core_unit(5)
    slave.tick(1_000, ())
    unit = MotorCoreUnit.of(slave)
    unit.inputs.set("supply_v", 80)
    slave.tick(2_000, ())
    twin = MotorCoreUnit.of(copied(slave))
    assert unit.read("status") == twin.read("status") == "over-voltage"
