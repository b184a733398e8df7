from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.record_log import hear, snapshot
from tests.host.canmon.model.strategies import traffic
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.top_model import RowOrder, TableView, render

LOG = hear(
    "\n".join(f"{0.1 * n:.1f} 181#{n:02X}000{n // 8}" for n in range(20))
    + "\n2.0 701#05\n2.05 20000204#0020000000006080\n2.1 00000605#R4"
)

TABLE = """\
can0: 22 frames, load 0.8 kbit/s, error frames 1, controller passive, TEC 96 REC 128, mean 0.8 kbit/s, peak 0.8 kbit/s
lost 3, 3 identifiers by id
CAN-ID      frames     1/s   gap ms      min      avg      p99      max   jitter missed   age s data
181             20   10.00  100.000  100.000  100.000  100.000  100.000    0.000      0     0.2 13 00 02
701              1    0.00        -        -        -        -        -        -      -     0.1 05
00000605R        1    0.00        -        -        -        -        -        -      -     0.0 remote request for 4"""  # noqa: E501 - as wide as it is

BITS = """\
can0: 22 frames, load 0.2 %, error frames 1, controller passive, TEC 96 REC 128,
lost 0, 3 identifiers by id  q quit, space hold, b bits, d decode, n notch, s so
CAN-ID        1/s bits that change
181         10.00 ···▁▁▂▄█ ········ ······▁▁
701          0.00 ········
00000605R    0.00"""


def test_the_whole_table() -> None:
    assert "\n".join(render(snapshot(LOG), TableView(), lost=3)) == TABLE


def test_the_bits_on_a_small_screen() -> None:
    view = TableView(bits=True, bit_rate=500_000, keys=True)
    assert "\n".join(render(snapshot(LOG), view, 0, 80, 24)) == BITS


def test_bytes_that_the_latest_frame_changed_are_reverse() -> None:
    records = hear("0 181#0011\n1 181#0111")
    assert render(snapshot(records), TableView(styled=True))[-1].endswith(" \x1b[7m01\x1b[0m 11")
    assert render(snapshot(records), TableView())[-1].endswith(" 01 11")


def test_bits_that_the_latest_frame_changed_are_reverse() -> None:
    line = render(snapshot(hear("0 181#00\n1 181#01")), TableView(styled=True, bits=True))[-1]
    assert line.endswith(" ·······\x1b[7m█\x1b[0m")


def test_two_buses_are_named() -> None:
    lines = render(snapshot(hear("0 181#00", "can0") + hear("0 181#00", "vcan12")), TableView())
    assert [line[:16] for line in lines[3:]] == [
        "bus    CAN-ID   ",
        "can0   181      ",
        "vcan12 181      ",
    ]


@pytest.mark.parametrize(
    ("order", "idents"),
    [
        (RowOrder.ID, "181 281 381"),
        (RowOrder.RATE, "281 181 381"),
        (RowOrder.GAP, "181 281 381"),
        (RowOrder.JITTER, "281 181 381"),
        (RowOrder.AGE, "381 281 181"),
    ],
)
def test_rows_are_sorted(order: RowOrder, idents: str) -> None:
    records = hear("0 381#\n0.0 281#\n0.1 281#\n0.3 281#\n0.0 181#\n9.0 181#")
    lines = render(snapshot(records), TableView(order))[3:]
    assert " ".join(line.split()[0] for line in lines) == idents


def test_rows_that_are_scrolled_past_are_left_out() -> None:
    records = hear("0 181#\n0 182#\n0 183#")
    assert [line[:3] for line in render(snapshot(records), TableView(top=1))[3:]] == ["182", "183"]


def test_without_frames_there_is_a_head() -> None:
    assert render(snapshot([]), TableView(), 0, 50)[0] == "lost 0, 0 identifiers by id"


@given(traffic(), st.integers(1, 200), st.integers(1, 40), st.booleans())
def test_no_line_leaves_the_screen(
    records: list[Record], width: int, height: int, bits: bool
) -> None:
    lines = render(snapshot(records), TableView(styled=True, bits=bits), 0, width, height)
    assert len(lines) <= height
    assert all(len(re.sub(r"\x1b\[\d*m", "", line)) <= width for line in lines)
