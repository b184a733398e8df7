from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.column_log import blocks
from tests.host.canmon.model.decode.drive_trace import record as drive_trace
from tests.host.canmon.model.decode.test_noise import FRAMES
from tests.host.canmon.model.strategies import traffic
from tickrig.host.canmon.model.columns import column_meanings
from tickrig.host.canmon.model.columns.column_meanings import ColumnMeanings
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record, decoded_text
from tickrig.host.text.page_text import one_line
from tickrig.wire.can import CanFrame

CONFIGURED = [
    *("605#2F001A0000000000", "585#60001A0000000000"),
    *("605#23001A0110004160", "585#60001A0100000000"),
    *("605#23001A0220006460", "585#60001A0200000000"),
    *("605#2F001A0002000000", "585#60001A0000000000"),
]
"""Node 5 is told what its first TPDO carries: a statusword and a position."""

HEAD = 'VERSION ""\nBU_: A\n'


def texts(decoder: Decoder, records: list[Record]) -> list[str]:
    return [one_line(decoded_text(decoder.take(record))) for record in records]


def assert_alike(records: list[Record], size: int, dbc: tuple[Path, ...] = ()) -> None:
    meanings = ColumnMeanings(Decoder(dbc=dbc))
    found = [
        text
        for block in blocks(records, size)
        for text in meanings.texts(block).lines(slice(None)).split("\n")[:-1]
    ]
    assert found == texts(Decoder(dbc=dbc), records)


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the fast way with the few frames that a test has."""
    monkeypatch.setattr(column_meanings, "_FEW", 1)
    monkeypatch.setattr(column_meanings, "_SETTLED", 3)


TPDOS = st.binary(max_size=8).map(lambda data: CanFrame(0x185, data))
BEATS = st.sampled_from(["705#05", "705#00", "705#7F", "705#85", "705#R", "705#", "705#0505"])
HEARTBEATS = st.lists(BEATS.map(CanFrame.parse), max_size=20)
CONFIGURING = st.lists(st.sampled_from(CONFIGURED).map(CanFrame.parse), max_size=8)


@given(
    parts=st.lists(
        st.one_of(CONFIGURING, st.lists(TPDOS, max_size=20), HEARTBEATS, FRAMES), max_size=8
    ),
    size=st.integers(1, 50),
)
def test_frames_of_canopen_mean_the_same_in_columns(parts: list[list[CanFrame]], size: int) -> None:
    frames = [*map(CanFrame.parse, CONFIGURED), *(frame for part in parts for frame in part)]
    records = [
        Record(1_000 * n, f"can{n % 7 // 6}", frame)
        for n, frame in enumerate(frames)
        if 0 <= getattr(frame, "dlc", 0) <= 8
    ]
    assert_alike(records, size)


@given(records=traffic(), size=st.integers(1, 30))
def test_any_traffic_means_the_same_in_columns(records: list[Record], size: int) -> None:
    assert_alike(records, size)


@pytest.mark.parametrize("size", [1, 40, 1_000])
def test_the_trace_of_a_drive_means_the_same_in_columns(size: int) -> None:
    assert_alike(drive_trace(), size)


SCALES = st.sampled_from(
    [
        *("(1,0)", "(2,-3)", "(-1,7)", "(1e20,0)", "(1,1e20)", "(1e300,0.5)"),
        *("(0.1,0)", "(-0.01,0)", "(0.125,-40)", "(1,0.5)", "(0.001,-273.15)", "(2.5e-05,0)"),
        *("(1e-07,1e-08)", "(1e-09,0)", "(0.333333333333,0)"),
    ]
)
ORDERS = st.sampled_from(["1+", "1-", "0+", "0-"])
FLOATS = ("s0 : 1", "s1 : 1", "s1 : 2")
UNITS = st.sampled_from(["", "rpm", "%", "%s", "{x} ", "\N{DEGREE SIGN}C", "a\tb"])


@st.composite
def dbc_files(draw: st.DrawFn) -> str:
    """Signals anywhere: some overlap, reach beyond their message, or are multiplexed."""
    length = draw(st.integers(1, 8))
    lines = [HEAD, f"BO_ 389 M: {length} A"]
    if draw(st.booleans()):
        lines.append(' SG_ kind M : 0|2@1+ (1,0) [0|0] "" A')
        for n in range(draw(st.integers(1, 3))):
            lines.append(
                f' SG_ m{n} m{n} : 8|{draw(st.integers(1, 56))}@1- {draw(SCALES)} [0|0] "" A'
            )
    for n in range(draw(st.integers(0, 4))):
        place = f"{draw(st.integers(0, 63))}|{draw(st.integers(1, 64))}@{draw(ORDERS)}"
        lines.append(f' SG_ s{n} : {place} {draw(SCALES)} [0|0] "{draw(UNITS)}" A')
    choices = draw(st.sampled_from(["", 'VAL_ 389 s0 0 "off" 1 "on" 255 "%d %s" 7 "x " ;\n']))
    floats = draw(st.sampled_from(["", *(f"SIG_VALTYPE_ 389 {name};\n" for name in FLOATS)]))
    return (
        "\n".join(lines)
        + "\n\n"
        + (choices if " s0 " in "".join(lines) else "")
        + (floats if floats[18:20] in "".join(lines) else "")
    )


@given(
    text=dbc_files(),
    datas=st.lists(
        st.one_of(st.binary(max_size=8), st.sampled_from([bytes(8), b"\xff" * 8])), max_size=20
    ),
)
def test_messages_of_dbc_files_mean_the_same_in_columns(text: str, datas: list[bytes]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder, "x.dbc")
        path.write_text(text, "utf-8")
        try:
            Decoder(dbc=[path])
        except ValueError:
            return
        frames = [CanFrame(0x185, data) for data in datas]
        frames.append(CanFrame(0x185, b"", True, False, 3))
        assert_alike([Record(n, "can0", frame) for n, frame in enumerate(frames)], 7, (path,))


FLOATS_WITH_NAMES = f"""{HEAD}BO_ 389 M: 8 A
 SG_ f : 0|32@1- (1,0) [0|0] "" A
 SG_ d : 32|32@1- (0.5,0) [0|0] "m" A

SIG_VALTYPE_ 389 f : 1;
SIG_VALTYPE_ 389 d : 1;
VAL_ 389 f 0 "off" 1 "on" ;
"""


def test_a_float_that_is_no_number_means_the_same_in_columns(tmp_path: Path) -> None:
    """With names of values cantools does not decode it, nor a float that is infinite."""
    path = tmp_path / "x.dbc"
    path.write_text(FLOATS_WITH_NAMES, "utf-8")
    words = ("00000000", "0000803F", "0000C07F", "0000807F", "000080FF", "CDCCCC3D", "FFFFFFFF")
    frames = [CanFrame.parse(f"185#{one}{other}") for one in words for other in words]
    assert_alike([Record(n, "can0", frame) for n, frame in enumerate(frames)], 7, (path,))


def test_a_wide_text_stands_in_its_line(tmp_path: Path) -> None:
    """Lines with many characters do not make the others long."""
    path = tmp_path / "x.dbc"
    signals = [f' SG_ a_long_name_{n} : {n}|1@1+ (1,0) [0|0] "" A' for n in range(64)]
    path.write_text("\n".join([f"{HEAD}BO_ 389 M: 8 A", *signals, ""]), "utf-8")
    frames = [CanFrame.parse(f"{ident}#0123456789ABCDEF") for ident in ("185", "186", "000")]
    assert_alike([Record(n, "can0", frame) for n, frame in enumerate(frames * 9)], 10, (path,))


def test_text_of_a_file_is_data(tmp_path: Path) -> None:
    """A unit with the marks of format strings stands in the line as it is in the file."""
    path = tmp_path / "x.dbc"
    path.write_text(
        f'{HEAD}BO_ 389 M: 4 A\n SG_ s : 0|32@1+ (1,0) [0|0] "%s{{0}}%(x)d" A\n', "utf-8"
    )
    record = Record(0, "can0", CanFrame(0x185, bytes(4)))
    meanings = ColumnMeanings(Decoder(dbc=[path]))
    assert meanings.texts(blocks([record], 1)[0]).lines(slice(None)) == "dbc M s=0%s{0}%(x)d\n"
