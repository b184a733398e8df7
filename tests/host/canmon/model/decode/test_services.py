from __future__ import annotations

import pytest

from tests.host.canmon.model.decode.traces import decode, last
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import BIT_ERROR, NO_ACK, ErrorFrame


@pytest.mark.parametrize(
    ("frames", "kind", "node", "text"),
    [
        ("000#0105", "nmt", 5, "start, node 5"),
        ("000#8200", "nmt", None, "reset communication, all nodes"),
        ("000#0305", "nmt", None, "no NMT command: 03 05"),
        ("000#01", "nmt", None, "no NMT command: 01"),
        ("080#", "sync", None, ""),
        ("080#07", "sync", None, "counter=7"),
        ("100#B0A429043143", "time", None, "2031-02-04 19:23:58.000"),
        ("100#B0", "time", None, "a TIME stamp of 1 bytes, it has 6"),
        ("085#0000000000000000", "emcy", 5, "0000h error reset or no error, register none"),
        ("085#00", "emcy", 5, "an EMCY of 1 bytes, it has 8"),
        ("705#00", "boot-up", 5, "boot-up"),
        ("705#7F", "heartbeat", 5, "pre-operational"),
        ("705#11", "heartbeat", 5, "11h"),
        ("705#", "heartbeat", 5, "no NMT state: no data"),
        ("705#R1", "guard", 5, "guarding request"),
        ("705#R1 705#05", "guard", 5, "operational, toggle 0"),
        ("705#85", "guard", 5, "operational, toggle 1"),
        ("585#4B171000E8030000 705#R1 705#05", "heartbeat", 5, "operational"),
        ("7E5#0401000000000000", "lss", None, "master: switch global configuration"),
        ("7E5#1300020000000000", "lss", None, "master: configure bit timing 500 kbit/s"),
        ("7E5#1301020000000000", "lss", None, "master: configure bit timing table 1 index 2"),
        ("7E5#15E8030000000000", "lss", None, "master: activate bit timing after 1000 ms"),
        ("7E5#4378563412000000", "lss", None, "master: switch serial 12345678h"),
        ("7E5#5100000000800000", "lss", None, "master: fastscan reset"),
        ("7E5#51785634121F0301", "lss", None, "master: fastscan serial 12345678h from bit 31"),
        ("7E5#4C00000000000000", "lss", None, "master: identify non configured"),
        ("7E5#11FF000000000000", "lss", None, "master: configure node id none"),
        ("7E4#1101000000000000", "lss", None, "slave: configure node id refused, error 1"),
        ("7E4#11FF070000000000", "lss", None, "slave: configure node id refused, error 255, 7"),
        ("7E4#1700000000000000", "lss", None, "slave: store done"),
        ("7E4#5E05000000000000", "lss", None, "slave: inquire node id 5"),
        ("7E4#5D78563412000000", "lss", None, "slave: inquire serial 12345678h"),
        ("7E4#4F00000000000000", "lss", None, "slave: identified"),
        ("7E4#FF00000000000000", "lss", None, "slave: no LSS message: FF 00 00 00 00 00 00 00"),
        ("185#R", "unmapped", 5, "RTR"),
        ("17F#00", "raw", None, ""),
        ("00000705#00", "raw", None, ""),
    ],
)
def test_a_frame_says_this(frames: str, kind: str, node: int | None, text: str) -> None:
    decoded = last(frames)
    assert (decoded.kind, decoded.node, decoded.text) == (kind, node, text)


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (NO_ACK, "no acknowledge"),
        (BIT_ERROR, "protocol, bus error"),
        (ErrorFrame(0x04, bytes([0, 0x20, 0, 0, 0, 0, 0, 0])), "controller: TX passive"),
        (ErrorFrame(0x1000), "class 1000h"),
    ],
)
def test_an_error_frame_says_this(frame: ErrorFrame, text: str) -> None:
    decoded = Decoder().take(Record(0, "can0", frame))
    assert (decoded.kind, decoded.text) == ("error", text)


def test_sync_and_emcy_and_time_follow_the_cob_ids_that_were_heard() -> None:
    told = (
        "585#4305100081000000 585#4312100001010000 585#4314100025010000"
        " 081#01 101#B0A429043143 125#1082110100000000"
    )
    assert [decoded.kind for decoded in decode(told)][3:] == ["sync", "time", "emcy"]
    assert last(told).node == 5


def test_an_emcy_that_is_not_valid_moves_nothing() -> None:
    assert last("585#4314100025010080 125#1082110100000000").kind == "raw"


def test_the_cob_id_of_sync_may_come_from_an_eds() -> None:
    eds = EdsObjects(values={(0x1005, 0): bytes.fromhex("81000040")})
    assert last("081#", {5: eds}).kind == "sync"
