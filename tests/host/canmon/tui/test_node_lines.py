from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_board import NodeBoard
from tickrig.host.canmon.tui.panels.nodes_panel import (
    BAD,
    GOOD,
    WARNING,
    board_lines,
    card_lines,
    heartbeat_line,
)
from tickrig.host.tui import Line, line_text, line_width

EPOS = Path(__file__).parents[4] / "examples/eds/epos.eds"
LOG = """
0.0 705#00
0.1 705#05
0.2 705#05
0.3 705#05
0.31 708#00
0.32 000#0208
0.33 605#2F01650001000000
0.34 585#8001650000000206
0.35 705#00
0.36 705#05
0.36 185#37170A000000
0.36 085#1082110100000000
"""
NOW_US = 365_000

BOARDS = {
    80: """\
NODE  NAME        NMT STATE                   HEARTBEAT        ERRORS
5     EPOS (EDS)  operational                 ███░░░ 5/~10 ms  8210h PDO not pr…
8                 pre-operational -> stopped  none, 0.1 s ago
""",
    120: """\
NODE  NAME        NMT STATE                   HEARTBEAT              DRIVE              ERRORS
5     EPOS (EDS)  operational                 ██████░░░░░░ 5/~10 ms  operation enabled  8210h PDO not processed due to …
8                 pre-operational -> stopped  none, 0.1 s ago
""",  # noqa: E501 - as wide as the screen
    200: """\
NODE  NAME        MAKER                    NMT STATE                   HEARTBEAT                  BOOT-UPS  DRIVE              TPDOs CARRY                        ERRORS
5     EPOS (EDS)  tickrig 00006210h (EDS)  operational                 ████████░░░░░░░░ 5/~10 ms  2         operation enabled  statusword, position_actual_value  8210h PDO not processed due to length…
8                                          pre-operational -> stopped  none, 0.1 s ago            1
""",  # noqa: E501 - as wide as the screen
}
CARD = """\
can0 node 5: EPOS (EDS)
  device     EDS: CiA 402 drive, vendor tickrig 00000000h, product 00006210h,
             revision 1.0
  TPDO1 185h statusword=0x1737[operation enabled] position_actual_value=10 (eds)
  RPDO1 205h controlword, target_velocity (eds)
  RPDO2 305h controlword, target_position (eds)
  drive      operation enabled
  SDO        1 failed, the latest: download 6501h:00 = 0x01 (aborted by server:
             object does not exist (06020000h), 10.0 ms)

EMCY, latest first
0.360000  node 5  8210h PDO not processed due to length error, register
          GENERIC|COMMUNICATION, 01 00 00 00 00
"""


def board(text: str = LOG, eds: bool = True) -> NodeBoard:
    decoder = Decoder({5: EPOS} if eds else {})
    made = NodeBoard(decoder, {5: "EPOS"} if eds else {})
    for record in hear(text):
        made.take(record, decoder.take(record))
    return made


def texts(lines: list[Line]) -> list[str]:
    return [line_text(line).rstrip() for line in lines]


@pytest.mark.parametrize("width", BOARDS)
def test_a_board_uses_the_width_and_is_no_wider(width: int) -> None:
    lines = board_lines(board().rows(), NOW_US, width)
    assert "\n".join([*texts(lines), ""]) == BOARDS[width]
    assert max(map(line_width, lines)) <= width


def test_a_card_says_who_a_node_is_what_it_carries_and_what_went_wrong() -> None:
    rows = board().rows()
    lines = card_lines(rows[0], rows, 80)
    assert "\n".join([*texts(lines), ""]) == CARD
    assert max(map(line_width, lines)) <= 80


def test_of_a_node_without_an_eds_it_is_said_that_nothing_is_known() -> None:
    rows = board("1.0 708#05", eds=False).rows()
    assert texts(card_lines(rows[0], rows, 100)) == [
        "can0 node 8",
        "  device     not known: no EDS, and no read of 1000h or 1018h",
    ]


def test_a_mapping_that_was_not_heard_is_told() -> None:
    text = "1.0 608#2300180188010000\n1.1 588#6000180100000000\n1.2 708#05"
    rows = board(text, eds=False).rows()
    assert texts(card_lines(rows[0], rows, 100))[2] == "  TPDO1 188h mapping unknown"


@pytest.mark.parametrize(
    ("age_us", "text", "style"),
    [
        (0, "░░░░░░ 0/~100 ms", ""),
        (50_000, "███░░░ 50/~100 ms", ""),
        (100_000, "██████ 100/~100 ms", ""),
        (150_001, "██████ 150/~100 ms LATE", BAD),
        (12_345_678, "██████ 12 s/~100 ms LATE", BAD),
    ],
)
def test_the_bar_is_full_when_a_period_has_passed(age_us: int, text: str, style: str) -> None:
    (row,) = board("1.0 705#05\n1.1 705#05", eds=False).rows()
    line = heartbeat_line(row, 1_100_000 + age_us, 80)
    assert line_text(line) == text
    assert line[-1][1] == style


def test_a_heartbeat_that_is_expected_and_never_came_is_told() -> None:
    row = board("0.9 605#2B17100064000000\n1.0 585#6017100000000000", eds=False).rows()[0]
    assert line_text(heartbeat_line(row, 2_000_000, 80)) == "never seen"


@pytest.mark.parametrize(
    ("frame", "style"),
    [("705#05", GOOD), ("705#7F", WARNING), ("705#04", "magenta"), ("705#11", "dim")],
)
def test_a_state_has_a_colour(frame: str, style: str) -> None:
    line = board_lines(board(f"1.0 {frame}", eds=False).rows(), 1_000_000, 80)[1]
    assert line[2][1] == style


def test_several_buses_are_told_apart() -> None:
    decoder = Decoder()
    made = NodeBoard(decoder)
    for channel in ("can0", "can1"):
        (record,) = hear("1.0 705#05")
        heard = record._replace(channel=channel)
        made.take(heard, decoder.take(heard))
    lines = texts(board_lines(made.rows(), 1_000_000, 80))
    assert [line[:6] for line in lines[1:]] == ["can0 5", "can1 5"]


def test_two_nodes_with_one_node_id_are_marked_until_one_is_gone() -> None:
    both = sorted([n * 75 for n in range(9)] + [20 + n * 75 for n in range(9)])
    alone = [both[-1] + 55 + n * 75 for n in range(14)]
    text = "\n".join(f"{ms / 1e3:.3f} 705#05" for ms in both)
    (row,) = board(text, eds=False).rows()
    now_us = both[-1] * 1_000 + 40_000
    assert texts(board_lines([row], now_us, 80))[1].split() == (
        ["5", "operational", "from", "two", "nodes", "two", "nodes", "have", "this", "node-ID"]
    )
    assert heartbeat_line(row, now_us, 80)[0][1] == BAD
    assert line_text(heartbeat_line(row, now_us + 100_000, 80)) == "from two nodes LATE"
    text += "".join(f"\n{ms / 1e3:.3f} 705#05" for ms in alone)
    (row,) = board(text, eds=False).rows()
    assert line_text(heartbeat_line(row, alone[-1] * 1_000, 80)).endswith(" 0/~75 ms")
