from __future__ import annotations

import pytest

from tests.device.canopen.objects import array, make_bus, u32
from tests.device.canopen.reference import make_dictionary
from tests.device.canopen.sdo_client import OPEN_SECOND, booted
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.nmt import NmtState

RW = Access.READ | Access.WRITE
READ_TYPE, TYPE = "4000100000000000", "4300100091010F00"


def test_the_default_server_needs_no_object() -> None:
    bus = make_bus(u32(0x1000, 7))
    bus.step()
    assert bus.step(f"605#{READ_TYPE}") == ["585#4300100007000000"]


def test_1200h_tells_the_truth_whatever_the_eds_says() -> None:
    server = [EntryDescription(0x1200, sub, f"{sub}", DataType.UNSIGNED32, RW) for sub in (1, 2)]
    bus = make_bus(server, node_id=0x7F)
    bus.step()
    assert bus.step("67F#4000120100000000") == ["5FF#430012017F060000"]
    assert bus.step("67F#4000120200000000") == ["5FF#43001202FF050000"]
    assert bus.step("67F#2300120101060000") == ["5FF#8000120102000106"]


def test_an_object_whose_values_are_made_later_is_asked_for_them() -> None:
    bus = make_bus(u32(0x2000, 7))
    bus.step()
    for _ in range(3):
        assert bus.step("605#4000200000000000") == ["585#4300200007000000"]
    bus.slave.dictionary[0x2000, 0].source = lambda entry: bytes([9, 0, 0, 0])
    assert bus.step("605#4000200000000000") == ["585#4300200009000000"]


@pytest.mark.parametrize(("index", "served"), [(0x127F, True), (0x1280, False)])
def test_the_last_server_is_127fh(index: int, served: bool) -> None:
    bus = make_bus(u32(0x1000, 7), array(index, 0x6A0, 0x6A1))
    bus.step()
    assert bus.step(f"6A0#{READ_TYPE}") == (["6A1#4300100007000000"] if served else [])


def test_1200h_of_another_type_is_left_alone() -> None:
    bus = make_bus([EntryDescription(0x1200, 1, "odd", DataType.UNSIGNED8, RW, default=3)])
    bus.step()
    assert bus.step("605#4000120100000000") == ["585#4F00120103000000"]


@pytest.mark.parametrize(
    ("command", "served"),
    [("000#0105", True), ("000#8005", True), ("000#0205", False)],
)
def test_it_serves_in_pre_operational_and_operational(command: str, served: bool) -> None:
    bus = booted()
    bus.step(command)
    bus.run(10)
    answer = [text for text in bus.step(f"605#{READ_TYPE}") if text.startswith("585")]
    assert answer == ([f"585#{TYPE}"] if served else [])


def test_a_transfer_ends_silently_when_the_node_is_stopped() -> None:
    bus = booted()
    bus.step("605#4008100000000000")
    assert bus.step("000#0205") + bus.run(6_000) == []
    bus.step("000#8005")
    assert bus.step("605#6000000000000000") == ["585#8000000001000405"]


def test_a_transfer_goes_on_when_the_node_is_started() -> None:
    bus = booted()
    bus.step("605#4008100000000000")
    bus.step("000#0105")
    assert "585#007265666572656E" in bus.step("605#6000000000000000")


@pytest.mark.parametrize("command", ["000#8105", "000#8205"])
def test_a_reset_ends_transfers_and_additional_servers(command: str) -> None:
    bus = booted()
    bus.step(*OPEN_SECOND)
    bus.step("605#4008100000000000", "6A0#4008100000000000")
    assert bus.step(command) == ["705#00"]
    assert bus.step("605#6000000000000000") == ["585#8000000001000405"]
    assert bus.step(f"6A0#{READ_TYPE}") + bus.run(6_000) == []


def test_an_additional_server_serves_once_both_cob_ids_are_valid() -> None:
    bus = booted()  # SG-03
    assert bus.step("605#23011201A0060000") == ["585#6001120100000000"]
    assert bus.step(f"6A0#{READ_TYPE}") == []
    assert bus.step("605#23011202A1060000") == ["585#6001120200000000"]
    assert 0x6A0 in (bus.slave.accepts or ())
    assert bus.step(f"6A0#{READ_TYPE}") == [f"6A1#{TYPE}"]


def test_two_servers_transfer_at_the_same_time() -> None:
    bus = booted()  # SG-04
    bus.step(*OPEN_SECOND)
    both = [
        ("4008100000000000", "410810000F000000"),
        ("6000000000000000", "007265666572656E"),
        ("7000000000000000", "10636520736C6176"),
    ]
    for request, answer in both:
        assert bus.step(f"605#{request}", f"6A0#{request}") == [f"585#{answer}", f"6A1#{answer}"]


def test_each_server_has_its_own_time_out() -> None:
    bus = booted()
    bus.step(*OPEN_SECOND)
    bus.step("605#4008100000000000")
    bus.run(999)
    bus.step("6A0#4008100000000000")
    assert bus.run(3_999) == []
    assert bus.step() == ["585#8008100000000405"]
    assert bus.run(999) == []
    assert bus.step() == ["6A1#8008100000000405"]
    assert bus.run(10_000) == []


def test_an_additional_server_is_silenced_by_bit_31() -> None:
    bus = booted()  # SG-05
    bus.step(*OPEN_SECOND)
    bus.step("6A0#4008100000000000")
    assert bus.step("605#2301120100000080") == ["585#6001120100000000"]
    assert bus.step("6A0#6000000000000000") + bus.run(6_000) == []
    assert bus.step("605#23011201A2060000") == ["585#6001120100000000"]
    assert bus.step("6A2#6000000000000000") == ["6A1#8000000001000405"]


def test_a_server_may_silence_itself_and_confirms_it() -> None:
    bus = booted()
    bus.step(*OPEN_SECOND)
    assert bus.step("6A0#2301120200000080") == ["6A1#6001120200000000"]
    assert bus.step(f"6A0#{READ_TYPE}") == []


@pytest.mark.parametrize(
    ("cob_id", "why"),
    [
        (0x601, "restricted"),  # SG-06
        (0x000, "restricted"),
        (0x581, "restricted"),
        (0x2000_06A0, "29-bit"),
        (0x0000_0E00, "beyond 11 bits"),
        (0xA000_0000, "29-bit, though invalid"),
    ],
)
def test_a_cob_id_that_cannot_be_is_refused(cob_id: int, why: str) -> None:
    request = cob_id.to_bytes(4, "little").hex().upper()
    assert booted().step(f"605#23011201{request}") == ["585#8001120130000906"], why


def test_a_can_id_changes_only_while_it_is_invalid() -> None:
    bus = booted()
    bus.step(*OPEN_SECOND)
    assert bus.step("605#23011201A2060000") == ["585#8001120130000906"]
    assert bus.step("605#23011201A0060000") == ["585#6001120100000000"]
    bus.step("605#23011201A0060080")
    assert bus.step("605#23011201A2060000") == ["585#6001120100000000"]
    assert bus.step(f"6A2#{READ_TYPE}") == [f"6A1#{TYPE}"]


def test_a_server_with_one_cob_id_in_the_dictionary_is_left_out() -> None:
    bus = make_bus([EntryDescription(0x1201, 1, "half", DataType.UNSIGNED32, RW, default=0x6A0)])
    bus.step()
    assert 0x6A0 not in (bus.slave.accepts or (0x6A0,))


def test_an_additional_server_of_the_eds_serves_from_the_start() -> None:
    cob_ids = [
        EntryDescription(0x127F, sub, "cob", DataType.UNSIGNED32, RW, default=0x69F + sub)
        for sub in (1, 2)
    ]
    bus = make_bus(cob_ids, u32(0x1000, 7))
    bus.step()
    assert bus.step(f"6A0#{READ_TYPE}") == ["6A1#4300100007000000"]


def test_an_unconfigured_node_serves_nobody() -> None:
    slave = make_slave(make_dictionary(()), 0xFF)
    slave.tick(1_000, ())
    assert slave.state is NmtState.INITIALISING
    assert slave.tick(2_000, (CanFrame(0x6FF, bytes.fromhex(READ_TYPE)),)) == ()
