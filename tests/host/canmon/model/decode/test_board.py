from __future__ import annotations

import json

import pytest

from tests.host.canmon.model.decode import drive_trace
from tests.host.canmon.model.decode.traces import STEP_US, trace
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_board import (
    NodeBoard,
    NodeStatus,
    board_json,
    render_board,
)
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame

WIDE = 300


def board_of(text: str) -> NodeBoard:
    decoder = Decoder()
    board = NodeBoard(decoder)
    for record in trace(text):
        board.take(record, decoder.take(record))
    return board


def status(text: str) -> NodeStatus:
    (row,) = board_of(text).rows()
    return row


def beats(*at_ms: int) -> NodeBoard:
    decoder = Decoder()
    board = NodeBoard(decoder)
    for at in at_ms:
        record = Record(at * 1_000, "can0", CanFrame.parse("705#05"))
        board.take(record, decoder.take(record))
    return board


def test_the_board_of_a_drive_reads_like_this() -> None:
    decoder = Decoder()
    board = NodeBoard(decoder)
    for record in drive_trace.record()[:-4]:
        board.take(record, decoder.take(record))
    head, row, *history = render_board(board, board.now_us, WIDE, 10)
    assert head.split("  ")[0] == "NODE"
    assert " ".join(row.split()) == (
        "5 EPOS operational -> pre-operational 349 ms ago 1 operation enabled"
        " 8210h PDO not processed due to length error [1] download 1000h:00 device_type ="
        " 0x78787878 (aborted by server: object is read only (06010002h), 0.9 ms) [2]"
    )
    assert history[:2] == ["", "EMCY, latest first"]
    assert "node 5  8210h PDO not processed" in history[2]


@pytest.mark.parametrize("frame", ["080#", "201#00", "601#4000100000000000", "181#R", "7E5#00"])
def test_no_node_is_said_to_be_none(frame: str) -> None:
    assert render_board(board_of(frame), 0, WIDE, 10) == ["no node has sent a frame"]


@pytest.mark.parametrize("can_id", ["189", "289", "389", "489"])
def test_a_pdo_at_its_pre_defined_can_id_is_hearing_its_node(can_id: str) -> None:
    board = board_of(f"{can_id}#01")
    (row,) = board.rows()
    assert (row.node, row.present, row.state) == (9, True, None)
    assert render_board(board, 0, WIDE, 10) == ["NODE  NMT STATE", "9     ?"]


def test_the_period_of_a_heartbeat_is_learnt() -> None:
    board = beats(0, 100, 200, 300)
    (row,) = board.rows()
    assert (row.heartbeats.period_us, row.heartbeats.learnt) == (100_000, True)
    assert "##... 80/~100 ms" in render_board(board, 380_000, WIDE, 10)[1]


def test_heartbeats_of_one_time_are_no_period() -> None:
    assert "0 ms ago" in render_board(beats(100, 100), 100_000, WIDE, 10)[1]
    assert "0/~100 ms" in render_board(beats(0, 0, 100, 100, 50), 50_000, WIDE, 10)[1]


def test_the_period_of_a_heartbeat_is_known_by_1017h() -> None:
    row = status("605#2B171000C8000000 585#6017100000000000 705#05 705#05")
    assert (row.heartbeats.period_us, row.heartbeats.learnt) == (200_000, False)


def test_a_heartbeat_that_is_missing_is_late() -> None:
    board = beats(0, 100, 200)
    (row,) = board.rows()
    assert not row.is_late(350_000)
    assert row.is_late(351_000)
    assert "##### 400/~100 ms LATE" in render_board(board, 600_000, WIDE, 10)[1]


def test_a_gap_between_heartbeats_is_counted() -> None:
    board = beats(0, 100, 200, 500, 600)
    (row,) = board.rows()
    assert row.late == 1
    assert render_board(board, 600_000, WIDE, 10)[1].endswith("late so far: 1")


@pytest.mark.parametrize(("command", "late"), [("000#8105", 0), ("000#8106", 1)])
def test_a_gap_before_a_boot_up_without_a_reset_is_counted(command: str, late: int) -> None:
    decoder = Decoder()
    board = NodeBoard(decoder)
    frames = ["705#05"] * 3 + [command, *["705#00"] * 2]
    for at_ms, text in zip((0, 100, 200, 250, 900, 1_900), frames, strict=True):
        record = Record(at_ms * 1_000, "can0", CanFrame.parse(text))
        board.take(record, decoder.take(record))
    assert board.rows()[0].late == late


def test_a_boot_up_that_nobody_asked_for_is_counted() -> None:
    row = status("705#00 705#7F 705#00")
    assert (row.boots, row.unrequested_boots, row.state_text) == (2, 1, "pre-operational")


def test_a_node_that_sent_a_pdo_of_its_own_boots_again() -> None:
    mapped = {(0x1A00, 0): b"\1", (0x1A00, 1): bytes.fromhex("10004160")}
    decoder = Decoder({5: EdsObjects(values=mapped)})
    board = NodeBoard(decoder)
    for record in trace("185#3702 705#00"):
        board.take(record, decoder.take(record))
    assert board.rows()[0].unrequested_boots == 1


def test_a_boot_up_after_a_reset_was_asked_for() -> None:
    row = status("705#00 000#8105 705#00 000#8200 705#00")
    assert (row.boots, row.unrequested_boots) == (3, 0)


def test_a_command_shows_behind_an_arrow_until_the_node_confirms_it() -> None:
    assert status("705#7F 000#0105").state_text == "pre-operational -> operational"
    assert status("705#7F 000#0105 705#05").state_text == "operational"
    assert status("705#7F 000#0106 000#0300").state_text == "pre-operational"


def test_an_emcy_is_kept_when_the_error_is_gone() -> None:
    text = "085#3081110700000000 085#0000000000000000 085#00"
    row = status(text)
    assert [emcy.code for emcy in row.emcys] == [0x8130, 0]
    assert (row.error_code, row.emcy_count) == (0, 2)
    assert render_board(board_of(text), 0, WIDE, 9)[1].split() == ["5", "?", "gone", "[2]"]


def test_a_heartbeat_time_of_0_by_sdo_means_none_and_by_an_eds_nothing() -> None:
    told = "705#05 705#05 585#4B17100000000000"
    assert status(told).heartbeats.period_us is None
    decoder = Decoder({5: EdsObjects(values={(0x1017, 0): bytes(2)})})
    board = NodeBoard(decoder, {5: ""})
    for record in trace("705#05 705#05"):
        board.take(record, decoder.take(record))
    assert board.rows()[0].heartbeats.period_us == STEP_US


def test_the_state_of_a_drive_is_read_by_sdo_as_well() -> None:
    row = status("605#4041600000000000 585#4B41600037020000")
    assert row.drive_state == "operation enabled"


def test_a_request_to_a_node_that_never_answers_is_no_node() -> None:
    assert board_of("606#4000100000000000 606#4001100000000000").rows() == []


def test_an_unanswered_request_is_an_error_of_a_node_that_was_heard() -> None:
    row = status("705#05 605#4000100000000000 605#4001100000000000")
    assert row.sdo_errors == 1
    assert "unanswered" in row.sdo_error


def test_a_node_that_is_expected_is_on_the_board_from_the_beginning() -> None:
    decoder = Decoder()
    board = NodeBoard(decoder, {7: "a drive"})
    for record in trace("705#05"):
        board.take(record, decoder.take(record))
    assert [(row.node, row.name) for row in board.rows()] == [(5, ""), (7, "a drive")]


def test_nodes_of_several_buses_are_told_apart() -> None:
    decoder = Decoder()
    board = NodeBoard(decoder)
    for record in (*trace("705#05", "can1"), *trace("705#7F", "can0")):
        board.take(record, decoder.take(record))
    lines = render_board(board, 0, WIDE, 10)
    assert [line.split("  ")[0] for line in lines] == ["NODE", "can0 5", "can1 5"]


def test_lines_are_cut_to_the_size_of_the_terminal() -> None:
    lines = render_board(board_of("705#05 706#05 707#05"), 0, 12, 3)
    assert lines == ["NODE  NMT S…", "5     opera…", "6     opera…"]


def test_a_node_is_one_json_object() -> None:
    board = beats(0, 100)
    (text,) = board_json(board, 150_000)
    found = json.loads(text)
    assert (found["v"], found["ev"], found["node"], found["state"]) == (1, "node", 5, "operational")
    assert (found["heartbeat_ms"], found["age_ms"], found["late"]) == (100.0, 50.0, False)
