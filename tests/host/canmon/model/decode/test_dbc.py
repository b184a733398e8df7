from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tests.host.canmon.model.decode.traces import trace
from tickrig.host.canmon.model.decode.dbc_file import DbcError
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.filter import parse_filter

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


HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: A B\n\n'


def message(*signals: str, length: int = 8, more: str = "") -> str:
    """Return a DBC file with one message; the signals are given from the start bit on."""
    lines = "".join(f' SG_ {one} [0|0] "" B\n' for one in signals)
    return f"{HEAD}BO_ 291 M: {length} A\n{lines}{more}"


# Kinds of DBC files that people reported of other tools; the files are written for this test.
REPORTED = {
    "Motorola signals across bytes": (
        message("S : 3|12@0+ (1,0)", "T : 23|16@0- (0.5,-10)"),
        {"123#0ABCFFFE00000000": "S=2748 T=-11.0"},
    ),
    "a multiplexer behind what it selects": (
        message("A0 m0 : 8|8@1+ (1,0)", "A1 m1 : 8|8@1+ (1,0)", "Mux M : 0|8@1+ (1,0)"),
        {"123#0005": "Mux=0 A0=5", "123#0105": "Mux=1 A1=5"},
    ),
    "ranges of a multiplexer": (
        message(
            "Mux M : 0|8@1+ (1,0)",
            "P m0 : 8|8@1+ (1,0)",
            "Q m3 : 8|8@1+ (1,0)",
            more="SG_MUL_VAL_ 291 P Mux 0-2, 5-5;\nSG_MUL_VAL_ 291 Q Mux 3-4;\n",
        ),
        {"123#0205": "Mux=2 P=5", "123#0405": "Mux=4 Q=5", "123#0505": "Mux=5 P=5"},
    ),
    "floating point with a factor": (
        message(
            "F : 0|32@1- (1,0)",
            "G : 32|32@1- (2,1)",
            more="SIG_VALTYPE_ 291 F : 1;\nSIG_VALTYPE_ 291 G : 1;\n",
        ),
        {"123#0000803F00000040": "F=1.0 G=5.0", "123#0000C07F0000807F": "F=nan G=inf"},
    ),
    "factors with an exponent": (
        message("F : 0|8@1+ (1E-3,0)", "G : 8|8@1+ (1.0e+2,-1e1)"),
        {"123#0102": "F=0.001 G=190"},
    ),
    "names of negative and of unscaled values": (
        message(
            "F : 0|8@1- (1,0)",
            "G : 8|8@1+ (0.5,0)",
            more='VAL_ 291 F -1 "none" 255 "odd" ;\nVAL_ 291 G 255 "error" ;\n',
        ),
        {"123#FFFF": "F=none G=error", "123#0564": "F=5 G=50.0"},
    ),
    "a signal beyond the message": (
        message("F : 0|8@1+ (1,0)", "G : 8|16@1+ (1,0)", length=2),
        {"123#0102": "F=1 (cannot be decoded: G)"},
    ),
    "signals one over the other": (
        message("F : 0|8@1+ (1,0)", "G : 4|8@1+ (1,0)", length=2),
        {"123#3412": "F=52 G=35"},
    ),
    "a frame of another length than the message": (
        message("F : 0|8@1+ (1,0)", "G : 8|16@1+ (1,0)", length=3),
        {"123#01": "F=1", "123#": "", "123#0102030405": "F=1 G=770"},
    ),
    "comments with quotes, and lines that are comments": (
        "// a note\n"
        + message("F : 0|8@1+ (1,0)", length=1, more='CM_ SG_ 291 F "it says \\"so\\"";\n'),
        {"123#01": "F=1"},
    ),
    "signals of no message, and a message of no length": (
        HEAD + "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n"
        ' SG_ X : 0|8@1+ (1,0) [0|0] "" Vector__XXX\n\nBO_ 291 M: 0 A\n',
        {"123#": "", "123#05": ""},
    ),
    "CRLF, a mark of the byte order in front, and units in UTF-8": (
        "\ufeff" + message("F : 0|8@1+ (1,0)").replace('"" B', '"°C" B').replace("\n", "\r\n"),
        {"123#01": "F=1°C"},
    ),
}


@pytest.mark.parametrize(("text", "said"), REPORTED.values(), ids=REPORTED)
def test_a_reported_kind_of_dbc_file_is_read_as_meant(
    text: str, said: dict[str, str], tmp_path: Path
) -> None:
    path = tmp_path / "reported.dbc"
    path.write_bytes(text.encode("utf-8"))
    decoder = Decoder(dbc=[path])
    read = {str(one.frame): decoder.take(one).text for one in trace(" ".join(said))}
    assert read == {frame: f"M {text}".strip() for frame, text in said.items()}


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-8-sig"])
def test_units_and_names_are_read_in_utf_8_and_windows_1252(encoding: str, tmp_path: Path) -> None:
    text = message("F : 0|8@1- (1,-40)", more='VAL_ 291 F -1 "früh" ;\n').replace('""', '"°C"')
    path = tmp_path / "units.dbc"
    path.write_bytes(text.encode(encoding))
    decoder = Decoder(dbc=[path])
    assert [decoder.take(one).text for one in trace("123#05 123#FF")] == ["M F=-35°C", "M F=früh°C"]


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
