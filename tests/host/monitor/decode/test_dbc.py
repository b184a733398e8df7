from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.host.monitor.decode.drive_trace import GOLDEN
from tests.host.monitor.decode.traces import trace
from tickrig.host.monitor.decode.dbc_file import DbcError
from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.decoder import Decoder
from tickrig.host.monitor.decode.filter import parse_filter

DBC = GOLDEN / "engine.dbc"


def said(text: str) -> Decoded:
    (record,) = trace(text)
    return Decoder(dbc=[DBC]).take(record)


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        ("123#E8030100", "Engine Speed=500.0rpm Gear=first"),
        ("123#E8030500", "Engine Speed=500.0rpm Gear=5"),
        ("123#E803", "Engine Speed=500.0rpm"),
        ("123#R", "Engine asked for by RTR"),
        ("18FF0001#05", "Wide Mux=0 Level=5%"),
        ("18FF0001#25", "Wide Mux=2 (expected multiplexer id 0, but got 2)"),
    ],
)
def test_a_dbc_file_names_signals(frame: str, text: str) -> None:
    decoded = said(frame)
    assert (decoded.kind, decoded.source, decoded.text) == ("dbc", "dbc", text)


NESTED = """\
VERSION ""
BU_: A B
BO_ 385 Mux: 8 A
 SG_ Selector M : 0|8@1+ (1,0) [0|0] "" B
 SG_ Always : 8|8@1+ (0.5,0) [0|0] "V" B
 SG_ Sub m1M : 16|8@1+ (1,0) [0|0] "" B
 SG_ Deep m4 : 24|8@1+ (1,0) [0|0] "" B
 SG_ Other m2 : 16|8@1- (1,0) [0|0] "" B
VAL_ 385 Selector 1 "one" 9 "nine" ;
SG_MUL_VAL_ 385 Sub Selector 1-1;
SG_MUL_VAL_ 385 Deep Sub 4-4;
SG_MUL_VAL_ 385 Other Selector 2-2;
"""


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        ("181#0104040700000000", "Mux Selector=one Always=2.0V Sub=4 Deep=7"),
        ("181#0204FF0700000000", "Mux Selector=2 Always=2.0V Other=-1"),
        ("181#0904040700000000", "Mux Selector=nine Always=2.0V"),
        ("181#0704040700000000", "Mux Selector=7 Always=2.0V (expected multiplexer id 1, 2 or 9"),
        (
            "181#0104050700000000",
            "Mux Selector=one Always=2.0V Sub=5 (expected multiplexer id 4, but got 5",
        ),
        ("181#0704", "Mux Selector=7 Always=2.0V (expected multiplexer id 1, 2 or 9"),
    ],
)
def test_a_multiplexer_is_told_though_no_signal_has_its_value(
    frame: str, text: str, tmp_path: Path
) -> None:
    path = tmp_path / "mux.dbc"
    path.write_text(NESTED)
    (record,) = trace(frame)
    assert Decoder(dbc=[path]).take(record).text.startswith(text)


def test_messages_of_one_name_keep_their_own_signals(tmp_path: Path) -> None:
    path = tmp_path / "made_from.dbc"
    path.write_text(
        'VERSION ""\nBU_: A B\n'
        'BO_ 385 TPDO1: 1 A\n SG_ speed : 0|8@1+ (1,0) [0|0] "rpm" B\n'
        'BO_ 386 TPDO1: 1 B\n SG_ level : 0|8@1+ (1,0) [0|0] "%" A\n'
    )
    decoder = Decoder(dbc=[path])
    texts = [decoder.take(record).text for record in trace("181#05 182#06")]
    assert texts == ["TPDO1 speed=5rpm", "TPDO1 level=6%"]


def test_what_a_dbc_file_does_not_name_is_decoded_as_ever() -> None:
    assert said("705#05").kind == "heartbeat"
    assert said("00000123#05").kind == "raw"


def test_a_filter_asks_for_signals_of_a_dbc_file() -> None:
    (record,) = trace("123#E8030100")
    assert parse_filter("dbc and Speed > 499 and Gear = first").matches(
        record, said("123#E8030100")
    )


def test_a_file_that_is_no_dbc_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.dbc"
    path.write_text("BO_ x")
    with pytest.raises(DbcError, match=r"bad.dbc is no DBC: DBC: \"Invalid syntax at line 1"):
        Decoder(dbc=[path])


def test_a_missing_file_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        Decoder(dbc=[tmp_path / "none.dbc"])


def test_without_cantools_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cantools", None)
    with pytest.raises(DbcError, match=r"tickrig\[dbc\]"):
        Decoder(dbc=[DBC])
