from __future__ import annotations

import pytest

from tests.device.canopen.pdo_bench import OFF, PdoBench, u8, u32
from tests.device.canopen.reference import RO, RPDO, RW, STR, U16
from tickrig.device.canopen.dictionary import Entry, SdoAbort
from tickrig.device.canopen.pdo.rpdo import PdoConsumer
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER


@pytest.fixture
def running(bench: PdoBench) -> PdoBench:
    bench.operational()
    return bench


def outputs(bench: PdoBench) -> tuple[int, int]:
    return bench.value(0x6200, 1), bench.value(0x6200, 2)


def test_type_255_acts_at_once(running: PdoBench) -> None:
    assert running.step("205#5AA5") == []
    assert outputs(running) == (0x5A, 0xA5)
    running.step("305#0100020003000400")
    assert [running.value(0x6411, sub) for sub in range(1, 5)] == [1, 2, 3, 4]


@pytest.mark.parametrize("command", ["000#8005", "000#0205"])
def test_nothing_acts_outside_operational(running: PdoBench, command: str) -> None:
    running.step(command, "205#1234")
    assert outputs(running) == (0, 0)


def test_remote_frames_and_long_can_ids_are_ignored(running: PdoBench) -> None:
    running.step("205#R2", "00000205#1234")
    assert outputs(running) == (0, 0)


def test_type_1_acts_with_the_next_sync_and_the_newest_counts(bench: PdoBench) -> None:
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#1111", "205#2222")
    bench.run(10)
    assert outputs(bench) == (0, 0)
    bench.step("080#", "205#3333")
    assert outputs(bench) == (0x22, 0x22)
    bench.step("080#")
    assert outputs(bench) == (0x33, 0x33)
    bench.set(0x6200, 1, 0)
    bench.step("080#")
    assert outputs(bench) == (0, 0x33)


@pytest.mark.parametrize("command", [(0x1400, 2, 255), (0x1400, 1, OFF | 0x205), (0x1400, 5, 7)])
def test_what_waits_for_sync_outlives_only_another_deadline(
    bench: PdoBench, command: tuple[int, int, int]
) -> None:
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#1111")
    bench.must_write(command)
    bench.step("080#")
    assert outputs(bench) == ((0x11, 0x11) if command[1] == 5 else (0, 0))


@pytest.mark.parametrize(
    "writes",
    [[(0x1400, 2, 255), (0x1400, 2, 1)], [(0x1400, 1, OFF | 0x205), (0x1400, 1, 0x205)]],
    ids=["another type", "off and on"],
)
def test_what_waited_for_sync_does_not_come_back(
    bench: PdoBench, writes: list[tuple[int, int, int]]
) -> None:
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#1111")
    bench.must_write(*writes)
    bench.step("080#")
    assert outputs(bench) == (0, 0)


def test_an_rpdo_that_is_switched_off_is_not_late(bench: PdoBench) -> None:
    bench.set_rpdo1(255, (5, 100))
    bench.operational()
    bench.step("205#0000")
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.run(500)
    assert bench.emergencies == []


def test_leaving_operational_forgets_what_waits_for_sync(bench: PdoBench) -> None:
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#1111", "000#8005", "000#0105", "080#")
    assert outputs(bench) == (0, 0)


def test_synchronous_rpdos_act_before_the_tpdo_of_the_same_sync(bench: PdoBench) -> None:
    bench.must_write((0x1400, 1, OFF | 0x205), (0x1800, 1, OFF | 0x185))
    bench.map(0x1600, 0x2000_0008)
    bench.map(0x1A00, 0x2000_0008)
    bench.set_rpdo1(1)
    bench.set_tpdo1(1)
    bench.operational()
    assert bench.step("205#77", "080#") == ["185#77"]


def test_a_change_by_an_rpdo_is_an_event_for_a_tpdo(bench: PdoBench) -> None:
    bench.must_write((0x1400, 1, OFF | 0x205), (0x1800, 1, OFF | 0x185))
    bench.map(0x1600, 0x2000_0008)
    bench.map(0x1A00, 0x2000_0008)
    bench.set_rpdo1(255)
    bench.set_tpdo1(255)
    bench.operational()
    assert bench.step("205#77") == ["185#77"]
    assert bench.step("205#77") == []


def test_too_few_bytes_are_not_used(running: PdoBench) -> None:
    running.step("205#5A", "205#5B")
    assert outputs(running) == (0, 0)
    assert running.emergencies == ["8210 10 0100"]
    running.step("205#5AA5")
    assert outputs(running) == (0x5A, 0xA5)
    assert running.emergencies == ["8210 gone 0100"]
    running.step("205#5AA5")
    assert running.emergencies == []


def test_too_few_bytes_do_not_wait_for_sync(bench: PdoBench) -> None:
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#5AA5", "205#5B", "080#")
    assert outputs(bench) == (0x5A, 0xA5)
    assert bench.emergencies == ["8210 10 0100"]


def test_of_too_many_bytes_the_first_are_used(running: PdoBench) -> None:
    running.step("205#5AA5FF", "205#5BA5FF")
    assert outputs(running) == (0x5B, 0xA5)
    assert running.emergencies == ["8220 10 0100"]
    running.step("205#5AA5")
    assert running.emergencies == ["8220 gone 0100"]


def test_each_rpdo_has_its_own_length_error(running: PdoBench) -> None:
    running.step("205#", "305#")
    running.step("205#0000")
    assert running.emergencies == ["8210 10 0100", "8210 10 0200", "8210 gone 0100"]


def test_a_reset_forgets_errors(running: PdoBench) -> None:
    running.step("205#")
    running.step("000#8205")
    running.operational()
    running.step("205#0000")
    assert running.emergencies == []


def test_the_deadline_runs_from_the_first_frame(bench: PdoBench) -> None:
    bench.set_rpdo1(255, (5, 100))
    bench.operational()
    bench.run(500)
    assert bench.emergencies == []
    bench.step("205#0000")
    bench.run(60)
    bench.step("205#0000")
    bench.run(99)
    assert bench.emergencies == []
    bench.run(1)
    assert bench.emergencies == ["8250 10 0100"]
    bench.run(500)
    assert bench.emergencies == []
    bench.step("205#0000")
    assert bench.emergencies == ["8250 gone 0100"]
    bench.run(100)
    assert bench.emergencies == ["8250 10 0100"]


def test_an_rpdo_that_is_late_is_not_waited_for_any_more(bench: PdoBench) -> None:
    bench.set_rpdo1(255, (5, 100))
    bench.silence_tpdo2()
    bench.operational()
    bench.step("205#0000")
    bench.run(100)
    assert bench.emergencies == ["8250 10 0100"]
    assert bench.slave.due_us == NEVER


def test_the_earliest_deadline_counts(bench: PdoBench) -> None:
    bench.set_rpdo1(1, (5, 100))
    bench.must_write((0x1401, 5, 50))
    bench.operational()
    bench.step("205#0000")
    bench.step("305#0000000000000000")
    bench.run(50)
    assert bench.emergencies == ["8250 10 0200"]
    bench.run(49)
    assert bench.emergencies == ["8250 10 0100"]


def test_a_later_deadline_does_not_delay_an_earlier_one(bench: PdoBench) -> None:
    bench.set_rpdo1(1, (5, 50))
    bench.must_write((0x1401, 5, 100))
    bench.operational()
    bench.step("205#0000", "305#0000000000000000")
    bench.run(50)
    assert bench.emergencies == ["8250 10 0100"]
    bench.run(50)
    assert bench.emergencies == ["8250 10 0200"]


def test_a_deadline_of_before_a_reset_delays_none_after_it(bench: PdoBench) -> None:
    def restart() -> None:
        bench.set_rpdo1(255, (5, 100))
        bench.operational()
        bench.step("205#0000")

    restart()
    bench.run(90)
    bench.step("000#8105")
    bench.step()
    restart()
    bench.run(99)
    assert bench.emergencies == []
    bench.step()
    assert bench.emergencies == ["8250 10 0100"]


@pytest.mark.parametrize("ending", ["000#8005", "000#0205"])
def test_leaving_operational_ends_the_deadline(bench: PdoBench, ending: str) -> None:
    bench.set_rpdo1(255, (5, 100))
    bench.operational()
    bench.step("205#0000")
    bench.step(ending)
    bench.run(500)
    assert bench.emergencies == []


def test_the_deadline_may_change_at_any_time(running: PdoBench) -> None:
    running.must_write((0x1400, 5, 100))
    running.step("205#0000")
    running.must_write((0x1400, 5, 10))
    running.run(500)
    assert running.emergencies == []
    running.step("205#0000")
    running.run(10)
    assert running.emergencies == ["8250 10 0100"]


def test_a_frame_that_is_too_short_does_not_meet_the_deadline(bench: PdoBench) -> None:
    bench.set_rpdo1(255, (5, 100))
    bench.operational()
    bench.step("205#0000")
    bench.run(50)
    bench.step("205#")
    bench.run(49)
    assert bench.emergencies == ["8210 10 0100", "8250 10 0100"]
    bench.step("205#000000")
    assert bench.emergencies == ["8220 10 0100", "8250 gone 0100"]


def test_after_the_synchronous_window_a_synchronous_rpdo_is_thrown_away(bench: PdoBench) -> None:
    bench.must_write((0x1007, 0, 5_000))
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#0101", "080#")
    assert outputs(bench) == (1, 1)
    bench.run(4)
    bench.step("205#0202")
    bench.step("205#0303", "080#")
    assert outputs(bench) == (2, 2)


def test_the_synchronous_window_may_be_a_power_on_value() -> None:
    bench = PdoBench(u32(0x1007, 0, 5_000), without=[0x1007])
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("080#")
    bench.run(5)
    bench.step("205#0202")
    bench.step("080#")
    assert outputs(bench) == (0, 0)


@pytest.mark.parametrize("command", ["000#8005", "000#0205", "000#8105", "000#8205"])
def test_a_synchronous_window_ends_with_operational(bench: PdoBench, command: str) -> None:
    bench.must_write((0x1007, 0, 5_000))
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("080#")
    bench.run(10)
    bench.step(command)
    bench.must_write((0x1007, 0, 5_000))
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#0202")
    bench.step("080#")
    assert outputs(bench) == (2, 2)


def test_a_sync_before_a_reset_opens_no_window_after_it(bench: PdoBench) -> None:
    bench.must_write((0x1007, 0, 5_000))
    bench.step("080#")
    bench.run(10)
    bench.step("000#8205")
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("205#0202")
    bench.step("080#")
    assert outputs(bench) == (2, 2)


def test_a_sync_before_operational_hands_nothing_over(bench: PdoBench) -> None:
    bench.set_rpdo1(1)
    bench.step("205#0101", "080#")
    bench.operational()
    bench.step("080#")
    assert outputs(bench) == (0, 0)


def test_the_fourth_rpdo_has_the_fourth_parameters(bench: PdoBench) -> None:
    bench.map(0x1603, 0x2000_0008)
    bench.must_write((0x1403, 1, 0x505))
    bench.operational()
    bench.step("505#07")
    assert bench.value(0x2000) == 7


def test_without_the_object_there_is_no_window() -> None:
    bench = PdoBench(without=[0x1007])
    bench.set_rpdo1(1)
    bench.operational()
    bench.step("080#")
    bench.run(50)
    bench.step("205#0303", "080#")
    assert outputs(bench) == (3, 3)


def test_another_can_id_counts_at_once(running: PdoBench) -> None:
    running.must_write((0x1400, 1, OFF | 0x205), (0x1400, 1, 0x3A5))
    running.step("205#1111")
    assert outputs(running) == (0, 0)
    running.step("3A5#2222")
    assert outputs(running) == (0x22, 0x22)
    accepts = running.slave.accepts or (0x205,)
    assert 0x3A5 in accepts
    assert 0x205 not in accepts


def test_an_rpdo_that_may_write_communication_objects_can_change_what_is_heard() -> None:
    heartbeat = EntryDescription(0x1017, 0, "u16", U16, RW | RPDO)
    bench = PdoBench(heartbeat, without=[0x1017])
    bench.operational()
    assert bench.slave.reconfigured_by == {0x000}
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x1017_0010)
    bench.set_rpdo1(0xFF)
    assert bench.slave.reconfigured_by == {0x000, 0x205}
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x2000_0008, 0x1017_0010)
    bench.set_rpdo1(0xFF)
    assert bench.slave.reconfigured_by == {0x000, 0x205}
    bench.set_rpdo1(1)  # it acts with SYNC
    assert bench.slave.reconfigured_by == {0x000, 0x080, 0x205}
    bench.step("000#8005")
    assert bench.slave.reconfigured_by == {0x000}


def test_an_mpdo_can_change_what_is_heard_also_without_sync() -> None:
    bench = PdoBench(without=[0x1005])
    bench.must_write((0x1400, 1, OFF | 0x205), (0x1600, 0, 0xFF), (0x1400, 1, 0x205))
    bench.operational()
    assert bench.slave.reconfigured_by == {0x000, 0x205}


def test_two_rpdos_may_share_a_can_id(running: PdoBench) -> None:
    running.must_write((0x1401, 1, OFF | 0x305), (0x1401, 1, 0x205))
    running.step("205#0102000000000000")
    assert outputs(running) == (1, 2)
    assert running.value(0x6411, 1) == 0x0201


def test_a_dummy_skips_bytes(bench: PdoBench) -> None:
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x0005_0008, 0x2001_0010, 0x0007_0020, 0x2000_0008)
    bench.set_rpdo1(255)
    bench.operational()
    bench.step("205#FF3412FFFFFFFF42")
    assert (bench.value(0x2001), bench.value(0x2000)) == (0x1234, 0x42)


def test_bits_are_unpacked(bench: PdoBench) -> None:
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x200C_0101, 0x0001_0001, 0x200C_0301, 0x2001_000C)
    bench.set_rpdo1(255)
    bench.operational()
    bench.step("205#FDFF")
    assert [bench.value(0x200C, sub) for sub in (1, 2, 3)] == [1, 0, 1]
    assert bench.value(0x2001) == 0xFFF
    bench.step("205#00")
    assert bench.emergencies == ["8210 10 0100"]


def test_an_object_mapped_shorter_gets_zeros_above(bench: PdoBench) -> None:
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x2002_0010)
    bench.set_rpdo1(255)
    bench.set(0x2002, 0, 0xFFFF_FFFF)
    bench.operational()
    bench.step("205#3412")
    assert bench.value(0x2002) == 0x1234


def test_a_string_gets_its_bytes() -> None:
    bench = PdoBench(EntryDescription(0x2100, 0, "name", STR, RW | RPDO, default="long before"))
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x2100_0018)
    bench.set_rpdo1(255)
    bench.operational()
    bench.step("205#616263")
    assert bench.slave.dictionary[0x2100, 0].value == "abc"


def test_a_value_that_its_limits_refuse_is_not_taken_and_the_others_are() -> None:
    limited = u8(0x2100, 0, 0x10, RW | RPDO)
    limited.low, limited.high = 0x10, 0x20
    bench = PdoBench(limited)
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x2100_0008, 0x2000_0008)
    bench.set_rpdo1(255)
    bench.operational()
    bench.step("205#2101")
    assert (bench.value(0x2100), bench.value(0x2000)) == (0x10, 1)
    bench.step("205#2002")
    assert (bench.value(0x2100), bench.value(0x2000)) == (0x20, 2)


def test_the_owner_of_an_object_judges_and_acts() -> None:
    bench = PdoBench(u8(0x2100, 0, 0, RW | RPDO))
    owned = bench.slave.dictionary[0x2100, 0]
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x2100_0008)
    bench.set_rpdo1(255)
    acted: list[int] = []

    def guard(entry: Entry, value: Value) -> None:
        if value == 9:
            raise SdoAbort(AbortCode.VALUE_RANGE)

    owned.guard, owned.written = guard, lambda entry: acted.append(entry.number)
    bench.operational()
    bench.step("205#08", "205#09", "205#08")
    assert acted == [8, 8]


def test_an_object_that_sdo_may_not_write_may_be_an_rpdo_s() -> None:
    shown = u8(0x2100, 0, 0, RO | RPDO)
    shown.high = 7
    bench = PdoBench(shown)
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x2100_0008)
    bench.set_rpdo1(255)
    bench.operational()
    bench.step("205#08")
    assert bench.value(0x2100) == 8


def test_who_wants_to_hear_of_rpdos_does(running: PdoBench) -> None:
    heard: list[int] = []
    PdoConsumer.of(running.slave).on_rpdo.append(heard.append)
    running.step("205#0000", "305#0000000000000000", "205#00")
    assert heard == [1, 2]


def test_an_rpdo_without_objects_ignores_what_comes(running: PdoBench) -> None:
    running.must_write((0x1402, 1, 0x405))
    running.step("405#00")
    assert running.emergencies == []


def test_a_boolean_takes_only_0_and_1() -> None:
    bench = PdoBench(EntryDescription(0x2100, 0, "on", DataType.BOOLEAN, RW | RPDO))
    bench.must_write((0x1400, 1, OFF | 0x205))
    bench.map(0x1600, 0x2100_0008)
    bench.set_rpdo1(255)
    bench.operational()
    seen = []
    for data in ("01", "02", "FF", "00"):
        bench.step(f"205#{data}")
        seen.append(bench.slave.dictionary[0x2100, 0].number)
    assert seen == [1, 1, 1, 0]
