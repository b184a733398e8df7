from __future__ import annotations

import pytest

from tests.device.canopen.pdo_bench import OFF, RW, PdoBench, u8, u32
from tests.device.canopen.reference import R32
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode

RANGE = AbortCode.VALUE_RANGE


@pytest.fixture
def off(bench: PdoBench) -> PdoBench:
    bench.must_write((0x1400, 1, OFF | 0x205), (0x1800, 1, OFF | 0x185))
    return bench


@pytest.mark.parametrize("cob_id", [0x206, 0x3A5, 0x4000_0206])
def test_the_can_id_does_not_change_while_the_pdo_is_valid(bench: PdoBench, cob_id: int) -> None:
    assert bench.write(0x1400, 1, cob_id) is RANGE


@pytest.mark.parametrize("cob_id", [0x205, 0x4000_0205, OFF | 0x205, OFF | 0x3A5, OFF])
def test_it_may_be_switched_off_and_bit_30_may_change(bench: PdoBench, cob_id: int) -> None:
    bench.must_write((0x1400, 1, cob_id))
    assert bench.value(0x1400, 1) == cob_id


@pytest.mark.parametrize(
    "cob_id",
    [
        *(0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF),
        *(0x701, 0x77F, 0x780, 0x7FF, 0x2000_0205, 0x0000_0A05, 0x1000_0205, 0xA000_0205),
    ],
)
def test_a_can_id_that_it_may_not_have_is_refused(off: PdoBench, cob_id: int) -> None:
    assert off.write(0x1400, 1, cob_id) is RANGE
    assert off.write(0x1800, 1, cob_id) is RANGE


@pytest.mark.parametrize("kind", [0, 1, 240, 252, 253, 254, 255])
def test_the_types_of_a_tpdo(bench: PdoBench, kind: int) -> None:
    bench.must_write((0x1800, 2, kind))


@pytest.mark.parametrize("kind", [241, 251])
def test_reserved_types_are_refused(off: PdoBench, kind: int) -> None:
    assert off.write(0x1800, 2, kind) is RANGE
    assert off.write(0x1400, 2, kind) is RANGE


@pytest.mark.parametrize("kind", [252, 253])
def test_an_rpdo_is_not_fetched(off: PdoBench, kind: int) -> None:
    assert off.write(0x1400, 2, kind) is RANGE


@pytest.mark.parametrize("sub", [3, 6])
def test_inhibit_time_and_sync_start_value_change_only_while_it_is_off(
    bench: PdoBench, sub: int
) -> None:
    assert bench.write(0x1800, sub, 5) is RANGE
    bench.must_write((0x1800, 1, OFF | 0x185), (0x1800, sub, 5))


def test_a_sync_start_value_that_no_counter_has_is_refused(off: PdoBench) -> None:
    off.must_write((0x1800, 6, 240))
    assert off.write(0x1800, 6, 241) is RANGE


def test_the_event_timer_changes_at_any_time(bench: PdoBench) -> None:
    bench.must_write((0x1800, 5, 100), (0x1400, 5, 100))


@pytest.mark.parametrize("index", [0x1400, 0x1800])
def test_sub_index_4_is_there_if_the_dictionary_has_it(index: int) -> None:
    bench = PdoBench(u8(index, 4))
    bench.must_write((index, 4, 1))
    assert bench.slave.dictionary[index, 4].upload() == b"\1"


@pytest.mark.parametrize("cob_id", [0x0000_0000, 0x0000_0601, 0x2000_0185, 0x0000_0985])
def test_a_default_cob_id_that_it_may_not_have_is_none(cob_id: int) -> None:
    bench = PdoBench(u32(0x1800, 1, cob_id), u32(0x1400, 1, cob_id), without=[0x1800, 0x1400])
    assert bench.operational() == ["285#0000000000000000"]
    assert cob_id & 0x7FF not in (bench.slave.accepts or frozenset({cob_id})) - {0x000}


def test_a_pdo_without_a_cob_id_does_not_exist() -> None:
    bench = PdoBench(u8(0x1800, 0), without=[0x1800])
    assert bench.operational() == ["285#0000000000000000"]


def test_a_pdo_without_a_type_is_event_driven() -> None:
    bench = PdoBench(u32(0x1800, 1, 0x185), without=[0x1800])
    assert bench.operational() == ["185#0000", "285#0000000000000000"]


def test_a_cob_id_of_a_strange_type_is_refused() -> None:
    bench = PdoBench(EntryDescription(0x1800, 1, "cobid", R32, RW), without=[0x1800])
    assert bench.write(0x1800, 1, 1) is AbortCode.PARAMETER_INCOMPATIBLE


def test_a_reset_gives_back_the_default_pdos(bench: PdoBench) -> None:
    bench.must_write((0x1800, 1, OFF | 0x185), (0x1800, 1, 0x1A5))
    assert bench.operational() == ["1A5#0000", "285#0000000000000000"]
    bench.step("000#8205")
    assert bench.operational() == ["185#0000", "285#0000000000000000"]
