from __future__ import annotations

import pytest

from tests.device.canopen.objects import RW, U8, U16, U32, array, make_bus, read, u16, write
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.parameter_store import LOAD, SAVE, ParameterStore
from tickrig.device.canopen.slave import Nonvolatile
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode

STORE, RESTORE = 0x1010, 0x1011
COMMUNICATION, MINE, PROFILE = 0x1017, 0x2001, 0x6005


def make() -> Bus:
    bus = make_bus(
        array(STORE, 1, 1, 1, 1),
        array(RESTORE, 1, 1, 1, 1),
        u16(COMMUNICATION),
        [EntryDescription(0x1014, 0, "EMCY", U32, RW, default=0x80, relative=True)],
        [EntryDescription(0x1003, 0, "errors", U8, RW)],
        [EntryDescription(MINE, 0, "both ways", U16, RW | Access.TPDO | Access.RPDO, default=7)],
        [
            EntryDescription(0x2002, 0, "read", U8, Access.READ),
            EntryDescription(0x2003, 0, "write", U8, Access.WRITE),
        ],
        [EntryDescription(0x2004, 0, "domain", DataType.DOMAIN, RW)],
        [EntryDescription(0x6200, 0, "output", U8, RW | Access.RPDO)],
        [EntryDescription(PROFILE, 0, "profile", U8, RW)],
    )
    bus.step()
    return bus


def change_all(bus: Bus) -> None:
    for entry in bus.slave.dictionary:
        if entry.index not in (STORE, RESTORE):
            entry.assign(b"\x55" * max(entry.size, 1))


def power_cycle(bus: Bus) -> None:
    bus.slave.reset()
    bus.step()


@pytest.mark.parametrize("index", [STORE, RESTORE])
def test_both_objects_read_that_they_act_on_command(index: int) -> None:
    bus = make()
    assert [read(bus, index, sub) for sub in (1, 2, 3, 4)] == [1, 1, 1, 1]


@pytest.mark.parametrize(
    ("index", "signature"), [(STORE, LOAD), (RESTORE, SAVE), (STORE, 0), (STORE, 1)]
)
def test_another_signature_is_refused(index: int, signature: int) -> None:
    bus = make()
    assert write(bus, index, signature, 1) is AbortCode.NOT_STORED
    assert bus.slave.nonvolatile.version == 0


def test_the_signatures_are_words_on_the_wire() -> None:
    bus = make()
    bus.slave.dictionary[STORE, 1].download(b"save")
    bus.slave.dictionary[RESTORE, 1].download(b"load")
    assert bus.slave.nonvolatile.version == 2
    assert read(bus, STORE, 1) == read(bus, RESTORE, 1) == 1


def test_what_was_not_saved_is_lost_with_the_power() -> None:
    bus = make()
    change_all(bus)
    power_cycle(bus)
    assert (read(bus, COMMUNICATION), read(bus, MINE), read(bus, PROFILE)) == (0, 7, 0)


@pytest.mark.parametrize(
    ("sub", "kept"),
    [
        (1, {0x1014, COMMUNICATION, MINE, PROFILE}),
        (2, {0x1014, COMMUNICATION}),
        (3, {PROFILE}),
        (4, {MINE}),
    ],
)
def test_each_sub_index_saves_its_parameters(sub: int, kept: set[int]) -> None:
    bus = make()
    change_all(bus)
    assert write(bus, STORE, SAVE, sub) is None
    assert {key >> 8 for key in bus.slave.nonvolatile.parameters} == kept
    power_cycle(bus)
    assert {e.index for e in bus.slave.dictionary if e.data in (b"\x55" * 2, b"UUUU", b"U")} == kept


def test_what_has_its_default_value_is_not_kept() -> None:
    bus = make()
    write(bus, MINE, 9)
    write(bus, STORE, SAVE, 1)
    write(bus, MINE, 7)
    write(bus, STORE, SAVE, 1)
    assert bus.slave.nonvolatile.parameters == {}


def test_load_acts_with_the_next_reset() -> None:
    bus = make()
    write(bus, MINE, 9)
    write(bus, COMMUNICATION, 300)
    write(bus, STORE, SAVE, 1)
    assert write(bus, RESTORE, LOAD, 1) is None
    assert read(bus, MINE) == 9
    bus.step("000#8205")
    assert (read(bus, MINE), read(bus, COMMUNICATION)) == (9, 0)
    bus.step("000#8105")
    assert read(bus, MINE) == 7


def test_load_restores_only_its_parameters() -> None:
    bus = make()
    change_all(bus)
    write(bus, STORE, SAVE, 1)
    write(bus, RESTORE, LOAD, 2)
    power_cycle(bus)
    assert (read(bus, COMMUNICATION), read(bus, MINE)) == (0, 0x5555)


def test_a_reset_restores_what_was_saved() -> None:
    bus = make()
    write(bus, MINE, 9)
    write(bus, STORE, SAVE, 1)
    write(bus, MINE, 11)
    bus.step("000#8105")
    assert read(bus, MINE) == 9


def test_a_device_profile_may_name_more_that_is_not_kept() -> None:
    bus = make()
    ParameterStore.of(bus.slave).volatile.add(MINE)
    change_all(bus)
    write(bus, STORE, SAVE, 4)
    assert bus.slave.nonvolatile.parameters == {}


def test_a_slave_is_born_with_what_it_kept() -> None:
    kept = Nonvolatile(parameters={0x2001_00: b"\x09\x00"})
    bus = make_bus([EntryDescription(MINE, 0, "mine", U16, RW)], kept=kept)
    bus.step()
    assert read(bus, MINE) == 9
