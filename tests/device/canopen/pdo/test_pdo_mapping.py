from __future__ import annotations

import pytest

from tests.device.canopen.pdo_bench import OFF, RW, PdoBench, u8
from tests.device.canopen.reference import R32, STR, TPDO, U8, U32
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode


@pytest.fixture
def bench() -> PdoBench:
    bench = PdoBench()
    bench.must_write((0x1400, 1, OFF | 0x205), (0x1800, 1, OFF | 0x185))
    return bench


@pytest.fixture
def unmapped(bench: PdoBench) -> PdoBench:
    bench.must_write((0x1600, 0, 0), (0x1A00, 0, 0))
    return bench


@pytest.mark.parametrize("sub", [0, 1])
def test_a_mapping_does_not_change_while_the_pdo_is_valid(sub: int) -> None:
    assert PdoBench().write(0x1600, sub, 0) is AbortCode.UNSUPPORTED_ACCESS


def test_an_object_is_not_mapped_while_sub_index_0_is_not_0(bench: PdoBench) -> None:
    assert bench.write(0x1600, 1, 0x2000_0008) is AbortCode.UNSUPPORTED_ACCESS


@pytest.mark.parametrize("direction", [0x1600, 0x1A00])
def test_an_object_that_is_mappable_is_mapped(unmapped: PdoBench, direction: int) -> None:
    unmapped.map(direction, 0x2001_0010, 0x2000_0008)
    assert unmapped.value(direction, 0) == 2


@pytest.mark.parametrize(
    ("mapped", "code"),
    [
        (0x3FFF_0008, AbortCode.NO_OBJECT),
        (0x2000_0108, AbortCode.NO_SUBINDEX),
        (0x2005_0008, AbortCode.NOT_MAPPABLE),
        (0x2009_0010, AbortCode.NOT_MAPPABLE),
        (0x2001_0020, AbortCode.NOT_MAPPABLE),
        (0x2001_0000, AbortCode.NOT_MAPPABLE),
        (0x0005_0010, AbortCode.NOT_MAPPABLE),
        (0x0005_0000, AbortCode.NOT_MAPPABLE),
        (0x0001_0002, AbortCode.NOT_MAPPABLE),
        (0x0008_0020, AbortCode.NO_OBJECT),
    ],
)
def test_what_cannot_be_in_an_rpdo_is_refused_at_once(
    unmapped: PdoBench, mapped: int, code: AbortCode
) -> None:
    assert unmapped.write(0x1600, 1, mapped) is code


@pytest.mark.parametrize(
    ("mapped", "code"),
    [(0x2004_0008, AbortCode.NOT_MAPPABLE), (0x0005_0008, AbortCode.NO_OBJECT)],
)
def test_what_cannot_be_in_a_tpdo_is_refused_at_once(
    unmapped: PdoBench, mapped: int, code: AbortCode
) -> None:
    assert unmapped.write(0x1A00, 1, mapped) is code


def test_0_takes_an_object_out(unmapped: PdoBench) -> None:
    unmapped.must_write((0x1600, 1, 0), (0x1600, 2, 0x2000_0008), (0x1600, 0, 2))
    unmapped.must_write((0x1400, 1, 0x205))
    unmapped.operational()
    unmapped.step("205#2A")
    assert unmapped.value(0x2000) == 0x2A


def test_nothing_but_nothing_is_no_mapping(unmapped: PdoBench) -> None:
    unmapped.must_write((0x1600, 1, 0))
    assert unmapped.write(0x1600, 0, 1) is AbortCode.VALUE_RANGE


def test_more_objects_than_it_can_map_are_refused(unmapped: PdoBench) -> None:
    unmapped.must_write(*((0x1600, sub, 0x2000_0008) for sub in range(1, 9)))
    assert unmapped.write(0x1600, 0, 9) is AbortCode.PDO_LENGTH
    unmapped.must_write((0x1600, 0, 8))


def test_more_than_64_bits_are_refused(unmapped: PdoBench) -> None:
    unmapped.must_write((0x1600, 1, 0x2003_0040), (0x1600, 2, 0x2000_0008))
    assert unmapped.write(0x1600, 0, 2) is AbortCode.PDO_LENGTH
    assert unmapped.value(0x1600, 0) == 0
    unmapped.must_write((0x1600, 0, 1))


def test_sub_index_0_judges_default_objects_too(bench: PdoBench) -> None:
    bench.must_write((0x1600, 0, 0))
    bench.slave.dictionary[0x1600, 1].value = 0x2005_0008
    assert bench.write(0x1600, 0, 1) is AbortCode.NOT_MAPPABLE
    bench.slave.dictionary[0x1600, 1].value = 0x3FFF_0008
    assert bench.write(0x1600, 0, 1) is AbortCode.NO_OBJECT


@pytest.mark.parametrize("direction", [0x1600, 0x1A00])
def test_an_mpdo_by_source_needs_a_list(unmapped: PdoBench, direction: int) -> None:
    assert unmapped.write(direction, 0, 0xFE) is AbortCode.PDO_LENGTH
    unmapped.must_write((direction, 0, 0xFF))


def test_a_string_is_mapped_by_whole_bytes() -> None:
    bench = PdoBench(EntryDescription(0x2100, 0, "name", STR, RW | TPDO, max_bytes=3))
    bench.must_write((0x1800, 1, OFF | 0x185), (0x1A00, 0, 0), (0x1A00, 1, 0x2100_0018))
    assert bench.write(0x1A00, 1, 0x2100_0014) is AbortCode.NOT_MAPPABLE
    assert bench.write(0x1A00, 1, 0x2100_0020) is AbortCode.NOT_MAPPABLE


def test_a_dictionary_without_sub_index_0_maps_all_there_is() -> None:
    kept = EntryDescription(0x1A00, 1, "map1", U32, RW, default=0x2000_0008)
    bench = PdoBench(kept, without=[0x1A00])
    bench.silence_tpdo2()
    assert bench.operational() == ["185#00"]


def test_a_mapping_of_a_strange_type_is_refused() -> None:
    bench = PdoBench(
        EntryDescription(0x1A00, 0, "map.n", U8, RW),
        EntryDescription(0x1A00, 1, "map1", R32, RW),
        without=[0x1A00],
    )
    bench.must_write((0x1800, 1, OFF | 0x185))
    assert bench.write(0x1A00, 1, 1) is AbortCode.PARAMETER_INCOMPATIBLE


def test_a_pdo_without_a_mapping_parameter_does_nothing() -> None:
    bench = PdoBench(u8(0x1B00, 0), without=[0x1600])
    bench.operational()
    assert bench.step("205#0000") == []
    assert bench.emergencies == []
