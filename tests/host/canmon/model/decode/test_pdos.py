from __future__ import annotations

import pytest

from tests.host.canmon.model.decode.traces import decode, last, trace
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, ObjectText
from tickrig.wire.canopen.datatypes import DataType

WRITTEN = " ".join(
    f"605#{request} 585#60001A{request[6:8]}00000000"
    for request in (
        "2F001A0000000000",  # 1A00h:00 = 0
        "23001A0110004160",  # 6041h:00, 16 bits
        "23001A0220006460",  # 6064h:00, 32 bits
        "2F001A0002000000",  # 1A00h:00 = 2
    )
)
EDS = EdsObjects(
    texts={
        (0x2001, 0): ObjectText("speed", DataType.INTEGER16, "rpm", 0.5, "eds"),
        (0x2002, 0): ObjectText("ratio", DataType.REAL32, "", 1, "eds"),
    },
    values={
        (0x1800, 1): bytes.fromhex("85010000"),
        (0x1A00, 0): b"\2",
        (0x1A00, 1): bytes.fromhex("10000120"),
        (0x1A00, 2): bytes.fromhex("20000220"),
    },
)


def test_nothing_is_assumed_of_a_pdo_that_nobody_described() -> None:
    decoded = last("185#3702")
    assert (decoded.kind, decoded.node, decoded.source) == ("unmapped", 5, "")
    assert decoded.signals == ()


def test_a_mapping_that_was_written_names_the_signals() -> None:
    decoded = last(f"{WRITTEN} 185#3702D2040000")
    assert (decoded.kind, decoded.node, decoded.source) == ("tpdo1", 5, "seen")
    assert decoded.text == "statusword=0x0237[operation enabled] position_actual_value=1234"


@pytest.mark.parametrize(
    ("device_type", "text"),
    [
        ("91010200", "6041h:00=0x0237 6064h:00=0x000004D2"),
        ("92010200", "statusword=0x0237[operation enabled] position_actual_value=1234"),
        ("9101FFFF", "statusword=0x0237[operation enabled] position_actual_value=1234"),
    ],
)
def test_another_device_type_has_no_statusword(device_type: str, text: str) -> None:
    assert last(f"{WRITTEN} 585#43001000{device_type} 185#3702D2040000").text == text


def test_names_of_a_drive_come_to_all_its_pdos() -> None:
    before = "585#4F00160001000000 585#4300160110004060"
    assert last(f"{before} 205#0F00").text == "6040h:00=0x000F"
    assert last(f"{before} {WRITTEN} 205#0F00").text == "controlword=0x000F"


def test_a_mapping_that_was_read_counts_as_well() -> None:
    read = (
        "605#40001A0000000000 585#4F001A0001000000 605#40001A0100000000 585#43001A0110004160"
        " 185#4002"
    )
    assert last(read).text == "statusword=0x0240[switch on disabled]"


def test_of_a_mapping_half_heard_the_rest_is_said_to_be_unknown() -> None:
    read = "585#4F001A0002000000 585#43001A0110004160 185#4002FFFF"
    assert last(read).text.endswith("and 1A00h:02, which is unknown")


def test_a_mapping_that_was_refused_is_not_learnt() -> None:
    refused = "605#2F001A0001000000 585#80001A0041000406 185#3702"
    assert last(refused).kind == "unmapped"


def test_an_eds_names_signals_with_unit_and_factor() -> None:
    decoded = last("185#FEFF0000803F", {5: EDS})
    assert decoded.text == "speed=-1.0rpm ratio=1.0"
    assert decoded.source == "eds"


def test_traffic_counts_more_than_the_eds() -> None:
    decoded = last(f"{WRITTEN} 185#3702D2040000", {5: EDS})
    assert [signal.name for signal in decoded.signals] == ["statusword", "position_actual_value"]
    assert decoded.source == "seen"


def test_a_cob_id_that_was_written_moves_the_pdo() -> None:
    moved = "605#23001801AA010000 585#6000180100000000"
    kinds = [d.kind for d in decode(f"{WRITTEN} {moved} 1AA#3702D2040000 185#00")][-2:]
    assert kinds == ["tpdo1", "unmapped"]


def test_a_pdo_that_is_not_valid_is_not_decoded() -> None:
    off = "605#23001801850100C0 585#6000180100000000"
    assert last(f"{WRITTEN} {off} 185#3702D2040000").kind == "unmapped"


def test_a_mapping_that_was_not_stored_is_gone_after_a_boot_up() -> None:
    assert last(f"{WRITTEN} 705#00 185#3702D2040000").kind == "unmapped"


def test_a_pdo_that_was_switched_off_is_back_after_a_boot_up() -> None:
    off = "605#2300180185010080 585#6000180100000000"
    kinds = [d.kind for d in decode(f"{off} 185#FEFF0000803F 705#00 185#FEFF0000803F", {5: EDS})]
    assert kinds[2:] == ["unmapped", "boot-up", "tpdo1"]


def test_a_mapping_that_was_stored_survives_a_boot_up() -> None:
    stored = "605#2310100173617665 585#6010100100000000"
    assert last(f"{WRITTEN} {stored} 705#00 185#3702D2040000").kind == "tpdo1"


def test_a_pdo_that_is_asked_for_has_no_signals() -> None:
    decoded = last(f"{WRITTEN} 185#R")
    assert (decoded.text, decoded.signals) == ("asked for by RTR", ())


def test_a_multiplexed_pdo_of_a_wrong_length_is_said_to_be() -> None:
    assert last("585#4F001A00FF000000 185#00").text == "1 bytes, an MPDO has 8"


def test_a_pdo_beyond_the_fourth_needs_its_cob_id() -> None:
    mapping = "585#4F041A0001000000 585#43041A0110004160"
    assert last(f"{mapping} 185#3702").kind == "unmapped"
    assert last(f"{mapping} 585#4304180185010000 185#3702").kind == "tpdo5"


def test_a_cob_id_without_a_mapping_names_the_pdo_alone() -> None:
    decoded = last("585#4301180185010000 185#3702")
    assert (decoded.kind, decoded.source) == ("tpdo2", "seen")
    assert decoded.text == "unmapped: 1A01h is unknown"


def test_a_short_pdo_is_not_processed() -> None:
    decoded = last(f"{WRITTEN} 185#3702")
    assert decoded.text == "2 B, 6 are mapped: not processed"
    assert decoded.signals == ()


def test_bits_and_dummies_lie_behind_each_other() -> None:
    mapping = "585#4F00160003000000 585#4300160101010060 585#4300160207000500 585#4300160308020060"
    decoded = last(f"{mapping} 205#81AB")
    assert decoded.kind == "rpdo1"
    assert [(s.name, s.value) for s in decoded.signals] == [("6000h:01", 1), ("6000h:02", 0xAB)]


def test_a_multiplexed_pdo_names_its_object() -> None:
    decoded = last("585#4F001A00FF000000 185#85171000E8030000")
    assert decoded.text == "heartbeat_time=1000 to 5"


def test_who_sends_a_pdo_is_named_before_who_receives_it() -> None:
    receives = "586#4F00160001000000 586#4300160110004060 586#4300140185010000"
    assert last(f"{receives} {WRITTEN} 185#3702D2040000").node == 5
    assert last(f"{receives} 185#0F00").kind == "rpdo1"


def test_each_bus_has_nodes_of_its_own() -> None:
    decoder = Decoder()
    for record in trace(WRITTEN):
        decoder.take(record)
    (other,) = trace("185#3702D2040000", "can1")
    assert decoder.take(other).kind == "unmapped"
