"""Tables out of files."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.emulators.testing.signals.test_spec_reader import read, spec
from tickrig.emulators.testing.signals.sources import ValueTable

LOG = "(1000.0) can0 181#0000FEFF\n(1000.5) can0 182#00\n(1001.25) can0 181#0000E803\n"
TRACE = """\
# tickrig-trace v1 rrc {}
0.010000 ! gauge=9
0.500000 ! stick_v_pct=3
2.000000 ! gauge=4
3.000000 .
"""
BENCH_TRACE = """\
# tickrig-trace v2 {"wires": {"bus": {"type": "can"}}, "devices": {\
"left": {"wire": "bus", "type": "epos", "node_id": 2}, \
"right": {"wire": "bus", "type": "epos", "node_id": 3}}}
0.001000 left < 702#00
0.400000 left ! supply_v=23.5
0.500000 right ! supply_v=20
0.600000 right ! 0x6064=7
1.000000 .
"""


@pytest.mark.parametrize(
    ("name", "text", "fields", "wanted"),
    [
        ("a.csv", "time,v\n0,12\n2.5,9\n", "", (((0, 12.0), (2_500_000, 9.0)), True)),
        ("a.csv", "t_ms;v;w\n0;1;2\n20;3;4\n", 'column="w"', (((0, 2.0), (20_000, 4.0)), True)),
        ("a.csv", "# made by hand\n\n0, 1\n1, 2\n", "", (((0, 1.0), (1_000_000, 2.0)), True)),
        ("a.csv", "\ufefft_us\tv\n5\t1e3\n", "", (((5, 1000.0),), True)),
        ("a.log", LOG, 'column="181[2:4]s"', (((0, -2.0), (1_250_000, 1000.0)), True)),
        ("a.trace", TRACE, 'column="gauge"', (((10_000, 9.0), (2_000_000, 4.0)), False)),
        ("a.trace", TRACE, 'column="rrc/stick_v_pct"', (((500_000, 3.0),), False)),
        ("a.trace", BENCH_TRACE, 'column="left/supply_v"', (((400_000, 23.5),), False)),
        ("a.trace", BENCH_TRACE, 'column="0x6064"', (((600_000, 7.0),), False)),
    ],
)
def test_a_column_of_a_file(
    tmp_path: Path,
    name: str,
    text: str,
    fields: str,
    wanted: tuple[tuple[tuple[int, float], ...], bool],
) -> None:
    (tmp_path / name).write_text(text, "utf-8")
    found = spec(f'{{table = "{name}"{", " if fields else ""}{fields}}}', tmp_path).source
    assert isinstance(found, ValueTable)
    assert (tuple(zip(found.times_us, found.values, strict=True)), found.linear) == wanted


@pytest.mark.parametrize(
    ("name", "text", "fields", "reason"),
    [
        ("a.csv", "", "", "{path} has no value"),
        ("a.csv", "t,v\n", 'column="v"', "{path} has no value of v"),
        ("a.csv", "t,v,w\n0,1,2\n", "", "{path}: column is missing: one of v, w"),
        ("a.csv", "t,v\n0,1\n", 'column="u"', "{path}: no column 'u'; known: v"),
        ("a.csv", "t,v\n0,1\n1\n", "", "{path}: line 3 has 1 columns"),
        ("a.csv", "t,v\n\n0,x\n", "", "{path}: line 3: could not convert string to float: 'x'"),
        ("a.csv", "t,v\n0,inf\n", "", "{path}: line 2: it takes a number, as 12.5, not inf"),
        ("a.csv", "t,v\n-1,0\n", "", "{path}: line 2: -1 is no time from 0 on"),
        (
            "a.csv",
            "1,0\n0,0\n",
            "",
            "{path}: line 2: its time is before that of the line above it",
        ),
        ("a.log", LOG, "", "{path}: column is missing: bits of a frame, as 181[2:6]s*0.001"),
        ("a.log", LOG, 'column="183[0]"', "{path} has no value of 183[0]"),
        ("a.trace", TRACE, "", "{path}: column is missing: the name of an input"),
        (
            "a.trace",
            BENCH_TRACE,
            'column="supply_v"',
            "{path}: column 'supply_v' is not of one device: name one of left/supply_v,"
            " right/supply_v",
        ),
        (
            "a.trace",
            "noise",
            'column="gauge"',
            "{path}: line 1 is not '# tickrig-trace v1 DEVICE {{CONFIG}}': 'noise'",
        ),
    ],
)
def test_what_is_wrong_with_a_file(
    tmp_path: Path, name: str, text: str, fields: str, reason: str
) -> None:
    path = tmp_path / name
    path.write_text(text, "utf-8")
    found = read(f'{{table = "{name}"{", " if fields else ""}{fields}}}', tmp_path)
    assert isinstance(found, list)
    assert [str(mistake) for mistake in found] == [f"x.table: {reason.format(path=path)}"]


def test_a_file_that_is_not_there_or_no_text(tmp_path: Path) -> None:
    (tmp_path / "raw.csv").write_bytes(b"t,v\n\xff\n")
    for name, reason in (
        ("no.csv", "No such file or directory"),
        (".", "a log's name ends in"),
        ("raw.csv", "'utf-8' codec can't decode byte 0xff in position 4: invalid start byte"),
    ):
        found = read(f'{{table = "{name}", column = "181[0]"}}', tmp_path)
        assert isinstance(found, list)
        assert found[0].reason.startswith(f"{tmp_path / name}: {reason}")
