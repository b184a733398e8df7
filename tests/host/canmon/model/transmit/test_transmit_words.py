from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.transmit import (
    PdoFrames,
    RowText,
    TransmitRow,
    parse_row_text,
    render_transmit,
)

EPOS = Path(__file__).parents[5] / "examples/eds/epos.eds"
ROWS = (
    "080# --every 10ms",
    "100#0000 --every 1.5s --counter 0:0..14 --checksum 1:crc8 --name 'still alive'",
    "5.rpdo1 target=-1 --name turn",
)


def row(text: str) -> TransmitRow:
    return parse_row_text(text).row(PdoFrames({5: read_eds_objects(EPOS, 5)}))


@pytest.mark.parametrize("text", ROWS)
def test_a_row_is_written_as_it_was_read(text: str) -> None:
    assert str(parse_row_text(text)) == text


@given(
    st.builds(
        RowText,
        st.sampled_from(["080#", "5.rpdo1 target=1", "123#R"]),
        st.sampled_from(["", "10ms"]),
        st.sampled_from([(), ("0:0..14",), ("0:0..14", "1:0..3")]),
        st.sampled_from([(), ("7:crc8",)]),
        st.text(max_size=8),
    )
)
def test_any_row_comes_back(words: RowText) -> None:
    assert parse_row_text(str(words)) == words


def test_a_row_sends_what_it_says() -> None:
    alive = row(ROWS[1])
    assert (alive.name, alive.period_us) == ("still alive", 1_500_000)
    first, second = alive.once() + alive.once()
    assert (str(first)[:6], str(second)[:6]) == ("100#00", "100#01")
    assert str(row(ROWS[2]).frame) == "205#0000FFFFFFFF"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "a row needs a frame as 123#DEADBEEF"),
        ("--every 10ms", "a row needs a frame"),
        ("123#00 080#", "'080#' behind a frame: a row has one frame"),
        ("123#00 --count 3", "no '--count' here; known: --every, --counter, --checksum, --name"),
        ("123#00 --every", "--every says nothing"),
        ("123#00 --every 1s --every 2s", "--every is given 2 times"),
        ("123#00 --name 'a", "no closing quotation"),
        ("123#0", "'123#0' is not a frame like"),
        ("9.rpdo1", "no description of node 9"),
        ("123#00 --every soon", "'soon' is not a time"),
        ("123#00 --every 0s", "--every takes a time above 0, as 10ms"),
        ("123#00 --counter 1:0..3", "no byte 1 for a counter or checksum"),
        ("123#00 --counter x", "'x' is not BYTE:LOW..HIGH"),
        ("123#00 --checksum 0:md5", "no checksum 'md5'"),
    ],
)
def test_what_cannot_be_sent_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        row(text)


TABLE = """\
SENDS  FRAME                          EVERY     SENT  MISSED  NAME
[x]    080#                           10 ms        0       0
[ ]    100#0000*                    1500 ms        1       0  still alive
 -     205#0000FFFFFFFF                            0       0  turn"""


def test_a_list_is_shown_like_this() -> None:
    rows = [row(text) for text in ROWS]
    rows[0].enable(0)
    rows[1].once()
    assert "\n".join(render_transmit(rows)) == TABLE
