from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.decode.test_pdos import WRITTEN
from tests.host.canmon.model.decode.traces import trace
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.filter import FilterError, parse_filter
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import ErrorFrame

TRAFFIC = (
    f"{WRITTEN} 000#0105 080# 085#3081110700000000 705#05 706#7F 185#3702D2040000"
    " 185#3802D2040000 285#01 181#00 600#00 18FF0000#01"
    " 605#4041600000000000 585#8041600000000206"
)
ERROR = Record(99_000, "can0", ErrorFrame(0x20))


def passed(text: str) -> str:
    """Return the frames behind the mapping that pass a filter."""
    decoder, chosen = Decoder(), parse_filter(text)
    frames = [*trace(TRAFFIC), ERROR]
    taken = [(record, decoder.take(record)) for record in frames]
    wanted = [record.frame for record, decoded in taken[8:] if chosen.matches(record, decoded)]
    return " ".join(str(frame) for frame in wanted)


EMCY = "085#3081110700000000"
TPDO = "185#3702D2040000"
FAULTY = "185#3802D2040000"
ERROR_TEXT = "20000020#0000000000000000"


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("nmt", "000#0105"),
        ("sync or 080", "080#"),
        ("node=5 and (emcy or heartbeat)", f"{EMCY} 705#05"),
        ("heartbeat and not node=5", "706#7F"),
        ("! (node = 5) and heartbeat", "706#7F"),
        ("tpdo1", f"{TPDO} {FAULTY}"),
        ("pdo1", f"{TPDO} {FAULTY}"),
        ("rpdo", ""),
        ("pdo", f"{TPDO} {FAULTY} 285#01 181#00"),
        ("unmapped", "285#01 181#00"),
        ("181-18F", f"{TPDO} {FAULTY} 181#00"),
        ("181", "181#00"),
        ("181,285", "285#01 181#00"),
        ("18FF0000-18FFFFFF", "18FF0000#01"),
        ("285:7FF", "285#01"),
        ("285:7FF,#FF", f"285#01 {ERROR_TEXT}"),
        ("285:7FF or 181", "285#01 181#00"),
        ("error and #20", f"{ERROR_TEXT}"),
        ("error and #40", ""),
        ("error", f"{ERROR_TEXT}"),
        ("id>=700 and id<7FF", "705#05 706#7F"),
        ("dlc=2", "000#0105"),
        ("statusword.fault", FAULTY),
        ("5.statusword.fault", FAULTY),
        ("6.statusword.fault", ""),
        ("statusword.fault = 0", TPDO),
        ("statusword = 0x237", TPDO),
        ("position_actual_value > 1233.5 and not statusword.fault", TPDO),
        ("state = operational", "705#05"),
        ("node 5 operational", "705#05"),
        ("node 6 pre-operational or node 5 stopped", "706#7F"),
        ("node 5-6 and heartbeat", "705#05 706#7F"),
        ("emcy of 5 or tpdo1 of 5 and statusword.fault", f"{EMCY} {FAULTY}"),
        ("heartbeat of 6-7", "706#7F"),
        ("statusword.fault of 5", FAULTY),
        ("statusword.fault of 6", ""),
        ("statusword.3", FAULTY),
        ("5.statusword.12", ""),
        ("code = 8130h", EMCY),
        ("statusword = 237h", TPDO),
        ("kind = emcy", EMCY),
        ("src = seen", f"{TPDO} {FAULTY}"),
        ("src != seen and 185", ""),
        ("raw", "600#00 18FF0000#01"),
        ("sdo[6041h] and sdo.aborted", "585#8041600000000206"),
        ("sdo[0x6041:0]", "605#4041600000000000 585#8041600000000206"),
        ("sdo[6041:01]", ""),
        ("channel = can0 and nmt", "000#0105"),
        ("ch = can1", ""),
        ("dir = tx", ""),
    ],
)
def test_a_filter_passes_these_frames(text: str, frames: str) -> None:
    assert passed(text) == frames


@pytest.mark.parametrize(
    ("text", "column", "reason"),
    [
        ("node=", 6, "a value is missing"),
        ("node three", 6, "node is compared by one of = == != < <= > >="),
        ("node 0", 6, "'0' is no node-ID 1 to 127, as 3 or 3-5"),
        ("emcy of", 8, "nothing is no node-ID 1 to 127, as 3 or 3-5"),
        ("emcy of 5-3", 9, "'5-3' is no node-ID 1 to 127, as 3 or 3-5; the lower one stands first"),
        ("node 3 running", 8, "'running' after the end; join terms by 'and' or 'or'"),
        ("node=three", 6, "'three' is no number"),
        ("id=xyz", 4, "'xyz' is no number"),
        ("(emcy", 6, "')' is missing"),
        ("emcy sync", 6, "'sync' after the end; join terms by 'and' or 'or'"),
        ("emcy and", 9, "a term is missing, as emcy, node=3, 181-18F or statusword.fault"),
        ("", 1, "a term is missing, as emcy, node=3, 181-18F or statusword.fault"),
        ("sdo[speed]", 5, "'speed' is no object like 6040h or 0x1018:1"),
        ("sdo[6040", 9, "']' is missing"),
        ("18F-181", 1, "18F-181 is no range of CAN-IDs like 181-18F"),
        ("kind<emcy", 6, "kind can be compared by = and != alone"),
        ("speed > fast", 9, "'fast' is no number"),
    ],
)
def test_a_wrong_filter_is_refused_with_its_column(text: str, column: int, reason: str) -> None:
    with pytest.raises(FilterError) as refused:
        parse_filter(text)
    assert str(refused.value) == f"filter {text!r}, column {column}: {reason}"
    assert refused.value.column == column


def test_a_request_that_ends_another_transfer_passes_for_both_objects() -> None:
    decoder = Decoder()
    record = trace("605#4000100000000000 605#4001100000000000")
    decoded = [decoder.take(item) for item in record]
    assert parse_filter("sdo[1000h] and sdo.unanswered").matches(record[1], decoded[1])
    assert parse_filter("sdo[1001h:00]").matches(record[1], decoded[1])


def test_a_filter_says_which_signals_it_asks_for() -> None:
    assert parse_filter("emcy or speed > 3 or 5.statusword.fault").signals == {
        "speed",
        "5.statusword.fault",
    }


@given(st.text(alphabet="nodesp =!<>()[]andortu123#:~-.,xh", max_size=30))
def test_any_text_is_a_filter_or_refused(text: str) -> None:
    try:
        chosen = parse_filter(text)
    except FilterError:
        return
    decoder = Decoder()
    for record in (*trace("185#00 605#4041600000000000"), ERROR):
        assert chosen.matches(record, decoder.take(record)) in (True, False)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("node=300", "column 6: node is 1 to 127, never 300"),
        ("node = 0", "column 8: node is 1 to 127, never 0"),
        ("node=3.5", "column 6: node is 1 to 127, never 3.5"),
        ("emcy or node==-1", "node is 1 to 127, never -1"),
        ("node!=300", "node is 1 to 127, never 300"),
        ("node>127", "node is 1 to 127, never >127"),
        ("node<1", "node is 1 to 127, never <1"),
        ("dlc=16", "dlc is 0 to 15, never 16"),
        ("bytes>64", "bytes is 0 to 64, never >64"),
        ("id=20000000", "id is 0 to 1FFFFFFF, never 20000000"),
        ("id=-5", "'-5' is no number"),
        ("id=\u0661", "is no number"),
        ("node=\u0663", "is no number"),
        ("node=1_0", "'1_0' is no number"),
        ("dir=up", "dir is never 'up', but rx, tx"),
        ("kind=emcyy", "kind is never 'emcyy', but nmt, "),
        ("kind=hartbeat", "did you mean 'heartbeat'?"),
        ("src=edss", "did you mean 'eds'?"),
        ("300.position > 5", "300 is no node-ID 1 to 127"),
        ("node 3-", "'3-' is no node-ID 1 to 127"),
        ("emcy of 3-2", "the lower one stands first"),
        ("181-", "'181-' is neither a kind"),
        ("-5", "a term is missing"),
        ("181-182-183", "'181-182-183' is neither a kind"),
    ],
)
def test_what_can_never_pass_is_refused(text: str, reason: str) -> None:
    with pytest.raises(FilterError, match=re.escape(reason)):
        parse_filter(text)


@pytest.mark.parametrize(
    "text",
    [
        *("node<128", "node>=1", "node<=127", "id=7FF", "id<200", "dlc=15", "bytes=64", "dir=tx"),
        *("kind=tpdo1", "kind=rpdo12", "kind=bootup", "kind=of-a-package", "src=seen", "node!=3"),
    ],
)
def test_what_can_pass_is_taken(text: str) -> None:
    assert parse_filter(text).text == text
