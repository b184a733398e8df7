from __future__ import annotations

import pytest

from tests.device.canopen.ds402.wheel import Wheel
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.models import epos
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.eds.object_table import RO, ROT, RW, RWW

ROWS = [
    (0x1000, 0, RO, 0x0002_0192),
    (0x2030, 0, RWW, 0),
    (0x2062, 0, RWW, 0),
    (0x206B, 0, RWW, 0),
    (0x6040, 0, RWW, 0),
    (0x6041, 0, ROT, 0),
    (0x6060, 0, RWW, 1),
    (0x6065, 0, RW, 2_000),
    (0x6067, 0, RW, 0xFFFF_FFFF),
    (0x607F, 0, RW, 25_000),
    (0x6081, 0, RWW, 1_000),
    (0x6083, 0, RWW, 10_000),
    (0x6085, 0, RW, 10_000),
    (0x6084, 0, RWW, 10_000),
    (0x6098, 0, RW, 7),
    (0x6099, 1, RW, 100),
    (0x6099, 2, RW, 10),
]
"""EPOS Firmware Specification, object dictionary: defaults."""

HOMED, OFFSET_MEASURED = 0x8000, 0x0100


@pytest.mark.parametrize(("index", "sub", "access", "value"), ROWS)
def test_an_object_is_as_the_table_says(index: int, sub: int, access: object, value: int) -> None:
    entry = epos.dictionary()[index, sub]
    assert (entry.description.access, entry.number) == (access, value)


@pytest.mark.parametrize("node_id", [1, 2])
def test_a_wheel_of_beego_has_the_pdos_of_k21(node_id: int) -> None:
    slave = epos.make_epos(node_id)
    slave.tick(1_000, ())
    slave.tick(2_000, (CanFrame.parse("000#0100"),))
    velocity = CanFrame(0x200 + node_id, bytes.fromhex("060058020000"))
    sent = slave.tick(20_000, (velocity,))
    assert slave.dictionary[0x60FF, 0].number == 600
    assert [frame.can_id for frame in sent] == [0x180 + node_id]
    assert sent[0].data[:2] == slave.dictionary[0x6041, 0].data


def test_each_dictionary_is_a_new_one() -> None:
    first: Dictionary = epos.dictionary()
    first[0x60FF, 0].value = 1
    assert epos.dictionary()[0x60FF, 0].number == 0


def test_the_current_is_in_milliamperes_and_the_torque_in_per_mille() -> None:
    wheel = Wheel()
    wheel.set(shaft_blocked=1)
    wheel.enable(-3)
    wheel.write(0x2030, 1_720)
    wheel.run(20)
    assert wheel.read(0x6078) == pytest.approx(1_720, abs=5)
    assert wheel.read(0x6077) == pytest.approx(500, abs=2)


def test_the_statusword_shows_the_offset_and_a_home() -> None:
    wheel = Wheel()
    assert wheel.read(0x6041) & (HOMED | OFFSET_MEASURED) == OFFSET_MEASURED
    wheel.write(0x6098, 35)
    wheel.enable(6)
    wheel.control(0x1F)
    wheel.run(5)
    assert wheel.read(0x6041) & HOMED


def test_a_power_cut_forgets_home_and_position() -> None:
    wheel = Wheel()
    wheel.write(0x60FF, 600)
    wheel.enable(3)
    wheel.run(200)
    before = wheel.drive.axis.motor.counts
    wheel.drive.axis.place_home(77, before)
    wheel.slave.reset()
    wheel.run(500)
    coasted = wheel.drive.axis.motor.counts - before
    assert wheel.read(0x6064) == pytest.approx(coasted, abs=30)  # the first tick is not counted
    assert wheel.read(0x6041) & HOMED == 0
