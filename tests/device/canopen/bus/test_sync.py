from __future__ import annotations

import pytest

from tests.device.canopen.pdo_bench import OFF, PdoBench, u8
from tests.device.canopen.reference import R32, RW
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

PRODUCER = 0x4000_0080


@pytest.fixture
def bench() -> PdoBench:
    bench = PdoBench()
    bench.silence_tpdo2()
    return bench


def heard(bench: PdoBench) -> list[int]:
    counters: list[int] = []
    bench.slave.on_sync.append(counters.append)
    return counters


def begin(bench: PdoBench, *writes: tuple[int, int, int]) -> None:
    """Write objects; the tick that comes next is the one that begins to count."""
    bench.must_write(*writes)
    assert bench.step() == []


def test_who_wants_to_hear_of_sync_does_before_and_in_operational(bench: PdoBench) -> None:
    counters = heard(bench)
    bench.step("080#")
    bench.operational()
    bench.step("080#", "080#")
    bench.step("000#0205", "080#")
    assert counters == [0, 0, 0]


def test_the_counter_is_told(bench: PdoBench) -> None:
    counters = heard(bench)
    bench.must_write((0x1019, 0, 10))
    bench.step("080#07", "080#08")
    assert counters == [7, 8]


def test_a_sync_of_another_length_is_none(bench: PdoBench) -> None:
    counters = heard(bench)
    bench.step("080#01")
    assert counters == []
    assert bench.emergencies == ["8240 10 01"]
    bench.step("080#")
    assert counters == [0]
    assert bench.emergencies == ["8240 gone"]
    bench.step("080#")
    assert bench.emergencies == []


def test_a_sync_without_the_counter_is_none(bench: PdoBench) -> None:
    counters = heard(bench)
    bench.must_write((0x1019, 0, 10))
    bench.step("080#", "080#0102")
    assert counters == []
    assert bench.emergencies == ["8240 10 00", "8240 10 02"]


def test_a_reset_forgets_the_wrong_length(bench: PdoBench) -> None:
    bench.step("080#01")
    bench.step("000#8205")
    bench.step("080#")
    assert bench.emergencies == []


def test_another_can_id_counts_at_once(bench: PdoBench) -> None:
    counters = heard(bench)
    bench.must_write((0x1005, 0, 0xB0))
    bench.step("080#")
    assert counters == []
    bench.step("0B0#")
    assert counters == [0]
    bench.must_write((0x1005, 0, OFF | 0xB0))
    bench.step("0B0#")
    assert counters == [0, 0]


@pytest.mark.parametrize("cob_id", [0, 0x601, 0x2000_0080, 0x0000_0880, 0x1000_0080])
def test_a_can_id_that_it_may_not_have_is_refused(bench: PdoBench, cob_id: int) -> None:
    assert bench.write(0x1005, 0, cob_id) is AbortCode.VALUE_RANGE


def test_the_producer_sends_each_period_and_does_not_drift(bench: PdoBench) -> None:
    begin(bench, (0x1006, 0, 10_000), (0x1005, 0, PRODUCER))
    assert [bench.run(10) for _ in range(50)] == [["080#"]] * 50


def test_a_period_between_ticks_is_kept_on_average(bench: PdoBench) -> None:
    begin(bench, (0x1006, 0, 2_500), (0x1005, 0, PRODUCER))
    assert len(bench.run(1_000)) == 400


def test_a_period_below_the_tick_is_one_sync_a_tick(bench: PdoBench) -> None:
    begin(bench, (0x1006, 0, 300), (0x1005, 0, PRODUCER))
    assert bench.run(5) == ["080#"] * 5


def test_the_producer_counts(bench: PdoBench) -> None:
    counters = heard(bench)
    begin(bench, (0x1019, 0, 3), (0x1006, 0, 2_000), (0x1005, 0, PRODUCER))
    assert bench.run(10) == ["080#01", "080#02", "080#03", "080#01", "080#02"]
    assert counters == [1, 2, 3, 1, 2]


def test_the_own_sync_sends_tpdos_behind_it(bench: PdoBench) -> None:
    bench.set_tpdo1(1)
    bench.operational()
    begin(bench, (0x1006, 0, 2_000), (0x1005, 0, PRODUCER))
    assert bench.run(4) == ["080#", "185#0000"] * 2


def test_a_new_period_begins_at_once(bench: PdoBench) -> None:
    begin(bench, (0x1006, 0, 100_000), (0x1005, 0, PRODUCER))
    bench.run(50)
    begin(bench, (0x1006, 0, 10_000))
    assert bench.run(9) == []
    assert bench.step() == ["080#"]
    bench.must_write((0x1006, 0, 0))
    assert bench.run(200) == []
    assert bench.slave.due_us == NEVER


def test_a_stopped_producer_is_silent_and_counts_from_1_again(bench: PdoBench) -> None:
    begin(bench, (0x1019, 0, 9), (0x1006, 0, 2_000), (0x1005, 0, PRODUCER))
    assert bench.run(4) == ["080#01", "080#02"]
    assert bench.step("000#0205") == []
    assert bench.run(10) == []
    assert bench.step("000#8005") == []
    assert bench.run(2) == ["080#01"]
    bench.step("000#0105")
    assert "080#02" in bench.run(2)


def test_bit_30_0_ends_the_production(bench: PdoBench) -> None:
    bench.must_write((0x1006, 0, 2_000), (0x1005, 0, PRODUCER), (0x1005, 0, 0x80))
    assert bench.run(10) == []


def test_the_can_id_does_not_change_while_it_produces(bench: PdoBench) -> None:
    begin(bench, (0x1006, 0, 10_000), (0x1005, 0, PRODUCER))
    assert bench.write(0x1005, 0, 0x4000_00B0) is AbortCode.VALUE_RANGE
    begin(bench, (0x1005, 0, 0x80), (0x1005, 0, 0x4000_00B0))
    assert bench.run(10) == ["0B0#"]


def test_the_counter_does_not_change_while_a_period_is_set(bench: PdoBench) -> None:
    bench.must_write((0x1006, 0, 1_000))
    assert bench.write(0x1019, 0, 5) is AbortCode.DEVICE_STATE


@pytest.mark.parametrize("overflow", [1, 241, 255])
def test_an_impossible_counter_is_refused(bench: PdoBench, overflow: int) -> None:
    assert bench.write(0x1019, 0, overflow) is AbortCode.VALUE_RANGE


def test_a_default_producer_sends_after_the_boot_up() -> None:
    bench = PdoBench()
    bench.slave.dictionary[0x1005, 0].description.default = PRODUCER.to_bytes(4, "little")
    bench.slave.dictionary[0x1006, 0].description.default = (5_000).to_bytes(4, "little")
    assert bench.step("000#8105") == ["705#00"]
    assert bench.run(10) == ["080#"] * 2


def test_a_dictionary_without_a_period_produces_nothing() -> None:
    bench = PdoBench(without=[0x1006, 0x1019])
    assert bench.write(0x1005, 0, PRODUCER) is AbortCode.VALUE_RANGE
    counters = heard(bench)
    bench.step("080#")
    assert counters == [0]


def test_a_dictionary_without_1005h_has_no_sync() -> None:
    bench = PdoBench(u8(0x1004, 0), without=[0x1005])
    counters = heard(bench)
    bench.must_write((0x1006, 0, 1_000))
    assert bench.step("080#") == []
    assert counters == []


def test_a_cob_id_of_a_strange_type_is_refused() -> None:
    bench = PdoBench(EntryDescription(0x1005, 0, "COB-ID SYNC", R32, RW), without=[0x1005])
    assert bench.write(0x1005, 0, 1) is AbortCode.PARAMETER_INCOMPATIBLE


def test_what_changes_in_stopped_counts_when_the_node_leaves_it(bench: PdoBench) -> None:
    bench.step("000#0205")
    bench.set(0x1006, 0, 2_000)
    bench.set(0x1005, 0, 0x4000_00B0)
    assert bench.run(5) == []
    bench.step("000#8005")
    assert bench.run(2) == ["0B0#"]
