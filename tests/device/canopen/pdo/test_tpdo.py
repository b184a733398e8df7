from __future__ import annotations

import pytest

from tests.device.canopen.pdo_bench import NO_RTR, OFF, PdoBench
from tests.device.canopen.reference import NODE_ID, R32, RO, TPDO, make_dictionary
from tests.device.canopen.reference import STR as NAME
from tickrig.device.canopen.dictionary import Entry, SdoAbort
from tickrig.device.canopen.nmt import NmtSlave
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.sync import Sync
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER


@pytest.fixture
def bench() -> PdoBench:
    bench = PdoBench()
    bench.silence_tpdo2()
    return bench


@pytest.fixture
def running(bench: PdoBench) -> PdoBench:
    assert bench.operational() == ["185#0000"]
    return bench


def test_event_driven_tpdos_are_sent_once_when_the_node_starts() -> None:
    bench = PdoBench()
    assert bench.operational() == ["185#0000", "285#0000000000000000"]
    assert bench.run(100) == []
    assert bench.slave.due_us == NEVER


def test_a_change_is_sent_once(running: PdoBench) -> None:
    running.set(0x6000, 1, 1)
    running.set(0x6000, 2, 2)
    assert running.slave.due_us <= running.now_us
    assert running.step() == ["185#0102"]
    running.set(0x6000, 1, 1)
    assert running.run(10) == []


def test_nothing_is_sent_before_operational_and_after_it(bench: PdoBench) -> None:
    bench.set(0x6000, 1, 1)
    assert bench.run(10) == []
    assert bench.operational() == ["185#0100"]
    bench.set(0x6000, 1, 2)
    assert bench.step("000#8005") == []
    bench.set(0x6000, 1, 3)
    assert bench.run(10) == []
    assert bench.step("080#", "185#R2") == []


def test_a_second_start_sends_nothing(running: PdoBench) -> None:
    assert running.step("000#0105") == []


def test_the_event_timer_does_not_drift(bench: PdoBench) -> None:
    bench.set_tpdo1(254, (5, 100))
    assert bench.operational() == ["185#0000"]
    assert [bench.run(100) for _ in range(20)] == [["185#0000"]] * 20


def test_the_event_timer_runs_from_each_transmission(bench: PdoBench) -> None:
    bench.set_tpdo1(255, (5, 100))
    bench.operational()
    bench.run(59)
    bench.set(0x6000, 1, 1)
    assert bench.step() == ["185#0100"]
    assert bench.run(99) == []
    assert bench.step() == ["185#0100"]


def test_the_event_timer_may_change_at_any_time(running: PdoBench) -> None:
    running.must_write((0x1800, 5, 10))
    assert running.step() == []
    assert running.run(30) == ["185#0000"] * 3
    running.must_write((0x1800, 5, 0))
    assert running.run(30) == []


def test_an_event_timer_written_while_an_event_waits_counts_from_the_next(
    bench: PdoBench,
) -> None:
    bench.set_tpdo1(255, (3, 100))
    bench.operational()
    bench.set(0x6000, 1, 1)
    bench.must_write((0x1800, 5, 50))
    assert bench.run(9) == []
    assert bench.step() == ["185#0100"]
    assert bench.run(49) == []
    assert bench.step() == ["185#0100"]


def test_the_inhibit_time_delays_and_the_newest_data_are_sent(bench: PdoBench) -> None:
    bench.set_tpdo1(255, (3, 1_000))
    assert bench.operational() == ["185#0000"]
    bench.run(250)
    bench.set(0x6000, 1, 1)
    assert bench.step() == ["185#0100"]
    bench.set(0x6000, 1, 2)
    assert bench.run(20) == []
    bench.set(0x6000, 1, 3)
    assert bench.run(79) == []
    assert bench.step() == ["185#0300"]
    assert bench.run(200) == []


def test_an_event_timer_below_the_inhibit_time_waits_for_it(bench: PdoBench) -> None:
    bench.set_tpdo1(255, (3, 1_000), (5, 40))
    bench.operational()
    assert [bench.run(100) for _ in range(3)] == [["185#0000"]] * 3


def test_each_tpdo_has_its_own_event_timer() -> None:
    bench = PdoBench()
    bench.set_tpdo1(255, (5, 30))
    bench.must_write((0x1801, 5, 50))
    bench.operational()
    sent = [(tick, frame[:3]) for tick in range(1, 101) for frame in bench.step()]
    assert sent == [(30, "185"), (50, "285"), (60, "185"), (90, "185"), (100, "285")]


def test_a_change_of_a_tpdo_delays_no_other(bench: PdoBench) -> None:
    bench.set_tpdo1(255, (5, 30))
    bench.operational()
    bench.run(10)
    bench.must_write((0x1801, 5, 500), (0x1801, 1, NO_RTR | 0x285))
    assert bench.step() == ["285#0000000000000000"]
    bench.must_write((0x1802, 1, NO_RTR | 0x385))
    assert bench.run(18) == []
    assert bench.step() == ["185#0000"]


def test_the_fourth_tpdo_has_the_fourth_parameters(bench: PdoBench) -> None:
    bench.map(0x1A03, 0x2000_0008)
    bench.must_write((0x1803, 1, NO_RTR | 0x485))
    assert bench.operational() == ["185#0000", "485#00"]
    PdoProducer.of(bench.slave).request(4)
    assert bench.step() == ["485#00"]


def test_a_sync_of_before_a_stop_sends_nothing_after_it(bench: PdoBench) -> None:
    bench.set_tpdo1(1)
    bench.operational()
    assert bench.step("080#", "000#0205", "000#0105") == []


def test_who_makes_values_is_notified_when_a_tpdo_begins_to_watch_them(bench: PdoBench) -> None:
    watched: list[str] = []
    bench.slave.watch_handlers.append(lambda: watched.append("watched"))
    bench.operational()
    assert watched == ["watched"]


def test_type_0_is_sent_with_the_sync_after_a_change(bench: PdoBench) -> None:
    bench.set_tpdo1(0)
    assert bench.operational() == []
    assert bench.step("080#") == ["185#0000"]
    assert bench.step("080#") == []
    bench.set(0x6000, 1, 7)
    assert bench.run(5) == []
    assert bench.step("080#") == ["185#0700"]
    assert bench.step("080#") == []


def test_type_1_is_sent_with_each_sync(bench: PdoBench) -> None:
    bench.set_tpdo1(1)
    assert bench.operational() == []
    bench.set(0x6000, 1, 1)
    assert bench.run(5) == []
    assert bench.step("080#") == ["185#0100"]
    assert bench.step("080#", "080#") == ["185#0100"] * 2
    assert bench.run(20) == []


@pytest.mark.parametrize("kind", [2, 3, 240])
def test_type_n_is_sent_with_each_nth_sync_the_nth_is_the_first(bench: PdoBench, kind: int) -> None:
    bench.set_tpdo1(kind)
    bench.operational()
    for _ in range(3):
        assert [text for _ in range(kind - 1) for text in bench.step("080#")] == []
        assert bench.step("080#") == ["185#0000"]


def test_the_phase_begins_anew_when_the_tpdo_is_switched_on(bench: PdoBench) -> None:
    bench.set_tpdo1(3)
    bench.operational()
    bench.step("080#", "080#")
    bench.set_tpdo1(3)
    assert bench.step("080#", "080#") == []
    assert bench.step("080#") == ["185#0000"]


def test_the_first_is_at_the_sync_start_value(bench: PdoBench) -> None:
    bench.must_write((0x1019, 0, 10))
    bench.set_tpdo1(2, (6, 3))
    bench.operational()
    assert bench.step("080#01", "080#02") == []
    assert bench.step("080#03") == ["185#0000"]
    assert bench.step("080#04") == []
    assert bench.step("080#05") == ["185#0000"]


def test_type_1_with_a_sync_start_value_is_sent_with_each_sync_from_there(
    bench: PdoBench,
) -> None:
    bench.must_write((0x1019, 0, 10))
    bench.set_tpdo1(1, (6, 3))
    bench.operational()
    assert [bench.step(f"080#0{count}") for count in (1, 2, 3, 4)] == [
        *([], []),
        *(["185#0000"], ["185#0000"]),
    ]


def test_a_sync_start_value_without_a_counter_is_of_no_effect(bench: PdoBench) -> None:
    bench.set_tpdo1(2, (6, 3))
    bench.operational()
    assert bench.step("080#") == []
    assert bench.step("080#") == ["185#0000"]


def test_type_253_is_fetched_by_a_remote_frame(bench: PdoBench) -> None:
    bench.set_tpdo1(253, cob_id=0x185)
    assert bench.operational() == []
    bench.set(0x6000, 1, 0x22)
    assert bench.step("080#") == []
    assert bench.step("185#R2") == ["185#2200"]


def test_type_252_is_sampled_with_sync_and_fetched_by_a_remote_frame(bench: PdoBench) -> None:
    bench.set_tpdo1(252, cob_id=0x185)
    assert bench.operational() == []
    bench.set(0x6000, 1, 1)
    assert bench.step("185#R2") == ["185#0000"]
    assert bench.step("080#") == []
    bench.set(0x6000, 1, 2)
    assert bench.step("185#R2") == ["185#0100"]


def test_each_type_answers_remote_frames_if_bit_30_is_0(bench: PdoBench) -> None:
    bench.set_tpdo1(1, cob_id=0x185)
    bench.operational()
    assert bench.step("185#R2") == ["185#0000"]
    bench.must_write((0x1800, 1, NO_RTR | 0x185))
    assert bench.step("185#R2") == []


def test_a_tpdo_that_is_off_is_silent(bench: PdoBench) -> None:
    bench.must_write((0x1800, 1, OFF | 0x185))
    assert bench.operational() == []
    bench.set(0x6000, 1, 1)
    assert bench.step("080#", "185#R2") == []


def test_a_tpdo_without_objects_is_silent(bench: PdoBench) -> None:
    bench.must_write((0x1800, 1, OFF | 0x185), (0x1A00, 0, 0), (0x1800, 1, 0x185))
    assert bench.operational() == []
    assert bench.step("080#", "185#R2") == []


def test_a_tpdo_that_is_switched_on_in_operational_is_sent(bench: PdoBench) -> None:
    bench.must_write((0x1800, 1, OFF | 0x185))
    bench.operational()
    bench.must_write((0x1800, 1, NO_RTR | 0x1A5))
    assert bench.step() == ["1A5#0000"]


def test_the_type_may_change_at_any_time(running: PdoBench) -> None:
    running.must_write((0x1800, 2, 1))
    assert running.step() == []
    assert running.step("080#") == ["185#0000"]


def test_bits_are_packed_behind_each_other(bench: PdoBench) -> None:
    bench.must_write((0x1800, 1, OFF | 0x185))
    bench.map(0x1A00, 0x200C_0101, 0x200C_0201, 0x200C_0301, 0x2000_0008)
    bench.set_tpdo1(1)
    for sub in (1, 3):
        bench.set(0x200C, sub, 1)
    bench.set(0x2000, 0, 0xFF)
    bench.operational()
    assert bench.step("080#") == ["185#FD07"]


def test_an_object_mapped_shorter_gives_its_low_bytes(bench: PdoBench) -> None:
    bench.must_write((0x1800, 1, OFF | 0x185))
    bench.map(0x1A00, 0x2002_0010, 0x2003_0018)
    bench.set_tpdo1(1)
    bench.set(0x2002, 0, 0x11223344)
    bench.set(0x2003, 0, 0x0102030405060708)
    bench.operational()
    assert bench.step("080#") == ["185#4433080706"]


def test_one_object_may_fill_the_frame(bench: PdoBench) -> None:
    bench.must_write((0x1800, 1, OFF | 0x185))
    bench.map(0x1A00, 0x2003_0040)
    bench.set_tpdo1(1)
    bench.set(0x2003, 0, 0x0807060504030201)
    bench.operational()
    assert bench.step("080#") == ["185#0102030405060708"]


def test_an_object_that_is_made_on_demand_is_asked(bench: PdoBench) -> None:
    entry = bench.slave.dictionary[0x6000, 1]
    entry.source = lambda entry: b"\x2a"
    bench.set_tpdo1(1)
    bench.operational()
    assert bench.step("080#") == ["185#2A00"]

    def refuse(entry: Entry) -> bytes:
        raise SdoAbort(AbortCode.LOCAL_CONTROL)

    entry.source = refuse
    assert bench.step("080#") == ["185#0000"]


def test_a_profile_may_judge_what_an_event_is(bench: PdoBench) -> None:
    producer = PdoProducer.of(bench.slave)
    entry = bench.slave.dictionary[0x6000, 1]
    producer.quiet.add(entry.key)
    bench.operational()
    bench.set(0x6000, 1, 1)
    assert bench.step() == []
    producer.request_for(entry)
    assert bench.step() == ["185#0100"]
    producer.request_for(entry)
    producer.request(1)
    producer.request(9)
    assert bench.step() == ["185#0100"]


def test_a_tpdo_is_asked_for_by_its_number() -> None:
    bench = PdoBench()
    bench.operational()
    PdoProducer.of(bench.slave).request(1)
    assert bench.step() == ["185#0000"]
    PdoProducer.of(bench.slave).request(2)
    assert bench.step() == ["285#0000000000000000"]


def test_what_is_asked_for_before_power_on_is_forgotten() -> None:
    slave = CanopenSlave(make_dictionary(), NODE_ID, (NmtSlave, Sync, PdoProducer))
    producer = PdoProducer.of(slave)
    slave.dictionary[0x1800, 5].value = 10
    producer.request(1)
    producer.request_for(slave.dictionary[0x6000, 1])
    assert [str(frame) for frame in slave.tick(1_000, ())] == ["705#00"]
    assert slave.due_us == NEVER


def test_an_object_that_is_mapped_no_longer_is_no_event(running: PdoBench) -> None:
    running.must_write((0x1800, 1, OFF | 0x185))
    running.map(0x1A00, 0x2000_0008)
    running.must_write((0x1800, 1, NO_RTR | 0x185))
    assert running.step() == ["185#00"]
    running.set(0x6000, 1, 1)
    assert running.slave.due_us == NEVER
    assert running.run(10) == []
    running.set(0x2000, 0, 1)
    assert running.run(10) == ["185#01"]


def test_who_wants_to_hear_of_transmissions_is_told_the_objects(running: PdoBench) -> None:
    sent: list[tuple[int, int]] = []
    PdoProducer.of(running.slave).on_sent.append(
        lambda entries: sent.extend((entry.index, entry.sub) for entry in entries)
    )
    running.set(0x6000, 1, 1)
    running.step()
    assert sent == [(0x6000, 1), (0x6000, 2)]


def test_an_event_of_a_cyclic_tpdo_is_none(bench: PdoBench) -> None:
    bench.set_tpdo1(1)
    bench.must_write((0x1800, 5, 10))
    bench.operational()
    PdoProducer.of(bench.slave).request(1)
    assert bench.run(20) == []


def test_a_change_that_the_reset_makes_is_no_event(running: PdoBench) -> None:
    running.set(0x6000, 1, 1)
    assert running.step() == ["185#0100"]
    assert running.step("000#8105") == ["705#00"]
    assert running.run(10) == []


def test_a_dictionary_without_mapping_parameters_sends_nothing() -> None:
    bench = PdoBench(without=range(0x1A00, 0x1A04))
    assert bench.operational() == []


def test_a_default_mapping_of_missing_objects_is_silent() -> None:
    bench = PdoBench(without=[0x6000])
    assert bench.operational() == ["285#0000000000000000"]


def test_a_default_mapping_of_too_many_bits_is_silent() -> None:
    bench = PdoBench()
    for sub in range(1, 4):
        bench.slave.dictionary[0x1A00, sub].assign(bytes.fromhex("40000320"))
    bench.slave.dictionary[0x1A00, 0].assign(b"\x03")
    assert bench.operational() == ["285#0000000000000000"]


def test_a_default_mapping_may_have_objects_that_are_not_called_mappable() -> None:
    hidden = EntryDescription(0x2100, 0, "hidden", R32, RO, default=1.0)
    bench = PdoBench(hidden)
    bench.slave.dictionary[0x1A00, 1].value = 0x2100_0020
    bench.slave.dictionary[0x1A00, 0].value = 1
    assert bench.operational() == ["185#0000803F", "285#0000000000000000"]


def test_a_string_goes_into_a_tpdo_by_bytes() -> None:
    name = EntryDescription(0x2100, 0, "name", NAME, RO | TPDO, default="ab")
    bench = PdoBench(name)
    bench.silence_tpdo2()
    bench.must_write((0x1800, 1, OFF | 0x185))
    bench.map(0x1A00, 0x2100_0018, 0x6000_0108)
    bench.set_tpdo1(1)
    bench.operational()
    assert bench.step("080#") == ["185#61620000"]
