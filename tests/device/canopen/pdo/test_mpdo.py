from __future__ import annotations

import pytest

from tests.device.canopen.pdo_bench import NO_RTR, OFF, RW, PdoBench, u8, u32, u64
from tests.device.canopen.reference import RO, TPDO
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.wire.canopen.pdo import Dispatched, Scanned
from tickrig.wire.errors import FieldError

TPDO1 = NO_RTR | 0x185


@pytest.fixture
def dam() -> PdoBench:
    """RPDO1 and TPDO1 in destination address mode."""
    bench = PdoBench()
    bench.silence_tpdo2()
    for parameters, cob_id in ((0x1400, 0x205), (0x1800, TPDO1)):
        bench.must_write((parameters, 1, OFF | cob_id), (parameters + 0x200, 0, 0xFF))
        bench.must_write((parameters, 1, cob_id))
    assert bench.operational() == []
    return bench


@pytest.fixture
def sam() -> PdoBench:
    """RPDO1 and TPDO1 in source address mode, with lists."""
    bench = PdoBench(
        u8(0x1FA0, 0, 3),
        u32(0x1FA0, 1, Scanned(0x6000, 1, block=2).encode()),
        u32(0x1FA0, 2, 0),
        u32(0x1FA0, 3, Scanned(0x6401, 4, block=9).encode()),
        u32(0x1FA0, 4, Scanned(0x2000, 0, block=1).encode()),
        u8(0x1FD0, 0, 1),
        u64(0x1FD0, 1, Dispatched(9, 0x3000, 7, 0x6200, 1, block=3).encode()),
    )
    bench.silence_tpdo2()
    for parameters, cob_id in ((0x1400, 0x205), (0x1800, TPDO1)):
        bench.must_write((parameters, 1, OFF | cob_id), (parameters + 0x200, 0, 0xFE))
        bench.must_write((parameters, 1, cob_id))
    assert bench.operational() == []
    return bench


def test_destination_address_mode_writes_the_object_that_is_named(dam: PdoBench) -> None:
    dam.step("205#8501200034120000")
    assert dam.value(0x2001) == 0x1234
    dam.step("205#8000200042000000")
    assert dam.value(0x2000) == 0x42


def test_an_mpdo_for_another_node_or_by_source_is_ignored(dam: PdoBench) -> None:
    dam.step("205#8601200034120000", "205#0501200034120000")
    assert dam.value(0x2001) == 0
    assert dam.emergencies == []


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        ("205#85FF3F0000000000", "ff3f00"),
        ("205#8505200000000000", "052000"),
        ("205#8503200000000000", "032000"),
        ("205#8501200500000000", "012005"),
    ],
)
def test_a_missing_destination_is_reported(dam: PdoBench, frame: str, text: str) -> None:
    dam.step(frame)
    assert dam.emergencies == [f"8230 10 {text}"]
    dam.step("205#8500200001000000", "205#8500200002000000")
    assert dam.emergencies == ["8230 gone"]


def test_an_mpdo_has_eight_bytes(dam: PdoBench) -> None:
    dam.step("205#85002000")
    assert dam.emergencies == ["8210 10 0100"]


def test_an_mpdo_may_act_with_sync(dam: PdoBench) -> None:
    dam.must_write((0x1400, 2, 1))
    dam.step("205#8500200042000000")
    assert dam.value(0x2000) == 0
    dam.step("080#")
    assert dam.value(0x2000) == 0x42


def test_the_application_writes_objects_of_others(dam: PdoBench) -> None:
    producer = PdoProducer.of(dam.slave)
    producer.send_to(9, 0x2000, 1, b"\x01")
    producer.send_to(0, 0x2001, 0, b"\x01\x02\x03\x04")
    assert dam.step() == ["185#8900200101000000", "185#8001200001020304"]
    assert dam.step("185#R8") == []


def test_the_first_of_two_tpdos_in_destination_address_mode_is_used(dam: PdoBench) -> None:
    dam.must_write((0x1A01, 0, 0xFF), (0x1801, 1, NO_RTR | 0x285))
    PdoProducer.of(dam.slave).send_to(9, 0x2000, 0, b"\1")
    assert dam.step() == ["185#8900200001000000"]


def test_more_than_four_bytes_are_refused(dam: PdoBench) -> None:
    with pytest.raises(FieldError, match="an MPDO carries 4"):
        PdoProducer.of(dam.slave).send_to(9, 0x2000, 1, bytes(5))


def test_without_such_a_tpdo_nothing_is_written(sam: PdoBench) -> None:
    PdoProducer.of(sam.slave).send_to(9, 0x2000, 1, b"\x01")
    assert sam.step() == []


def test_an_event_without_an_object_sends_no_mpdo(sam: PdoBench) -> None:
    PdoProducer.of(sam.slave).request(1)
    assert sam.run(3) == []


def test_source_address_mode_sends_each_change_of_a_scanned_object(sam: PdoBench) -> None:
    sam.set(0x6000, 1, 1)
    sam.set(0x6401, 4, -2)
    sam.set(0x6000, 1, 2)
    sam.set(0x2000, 0, 9)
    assert sam.step() == ["185#0500600102000000", "185#05016404FEFF0000"]
    assert sam.run(5) == []
    assert sam.step("185#R8", "080#") == []


def test_the_inhibit_time_lets_one_mpdo_through(sam: PdoBench) -> None:
    sam.must_write((0x1800, 1, OFF | 0x185), (0x1800, 3, 100), (0x1800, 1, 0x185))
    sam.set(0x6000, 1, 1)
    sam.set(0x6000, 2, 2)
    assert sam.step() == ["185#0500600101000000"]
    assert sam.run(9) == []
    sam.set(0x6000, 2, 3)
    assert sam.step() == ["185#0500600203000000"]


def test_only_event_driven_mpdos_are_sent(sam: PdoBench) -> None:
    sam.must_write((0x1800, 2, 1))
    sam.set(0x6000, 1, 1)
    assert sam.step("080#") == []


def test_the_dispatching_list_says_where_a_value_goes(sam: PdoBench) -> None:
    sam.step("205#090030072A000000")
    sam.step("205#090030082B000000")
    assert (sam.value(0x6200, 1), sam.value(0x6200, 2)) == (0x2A, 0x2B)


@pytest.mark.parametrize(
    "frame",
    ["205#080030072A000000", "205#890030072A000000", "205#090030092A000000"],
)
def test_what_is_not_in_the_list_is_ignored(sam: PdoBench, frame: str) -> None:
    sam.step(frame)
    assert (sam.value(0x6200, 1), sam.value(0x6200, 2)) == (0, 0)
    assert sam.emergencies == []


def test_what_an_mpdo_cannot_carry_is_not_scanned() -> None:
    bench = PdoBench(
        u8(0x1FA0, 0, 2),
        u32(0x1FA0, 1, Scanned(0x2003, 0, block=1).encode()),
        u32(0x1FA0, 2, Scanned(0x2009, 0, block=1).encode()),
        u8(0x2100, 0, 0, RO | TPDO),
    )
    bench.silence_tpdo2()
    bench.must_write((0x1800, 1, OFF | TPDO1), (0x1A00, 0, 0xFE), (0x1800, 1, TPDO1))
    bench.operational()
    bench.set(0x2003, 0, 1)
    bench.set(0x2009, 0, 1)
    assert bench.step() == []
    assert RW in bench.slave.dictionary[0x2003, 0].description.access
