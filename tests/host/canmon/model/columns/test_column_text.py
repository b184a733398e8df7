from __future__ import annotations

import gzip
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

import pytest
from click.testing import CliRunner
from hypothesis import example, given
from hypothesis import strategies as st

from tests.host.canmon.model.columns.test_column_reader import LINES
from tests.host.canmon.model.strategies import traffic
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.columns import column_reader
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs import log_reader
from tickrig.host.canmon.model.logs.log_writer import log_line, write_log
from tickrig.host.canmon.sources import source
from tickrig.wire.can import CanFrame

MARKS = st.sampled_from(
    [
        "# 12 frames were lost",
        "# trigger: emcy",
        "# can0 is gone: Network is down",
        "DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 1)",
        "(0000000002.000000) can0 123##1AABB",
        " (000.000250)  can0  705   [1]  7F",
    ]
)
USUAL = st.lists(traffic().map(lambda records: [log_line(record) for record in records]))
TEXTS = st.one_of(
    USUAL.map(lambda some: [line for lines in some for line in lines]),
    st.lists(st.one_of(LINES, MARKS), max_size=30),
)
WORDS = (
    ("-r",),
    ("-r", "-x", "-t", "a"),
    ("-r", "-t", "d"),
    ("-r", "-t", "z"),
    ("-r", "-t", "A"),
    ("-L",),
    (),
)
OUT = ("out.asc", "out.asc", "out.log", "out.log.gz", "out.csv", "out.jsonl")
FIRST = "(1000000000.001000) can0 123#01"
"""Begins logs that are dated with the time of writing while they have no frame."""
PIECE = 70


def said(small_bytes: int, *words: object) -> tuple[object, ...]:
    """Return status, output and messages of a verb, which reads in pieces or frame by frame."""
    with ExitStack() as held:
        patch = mock.patch.object
        held.enter_context(patch(source, "SMALL_BYTES", small_bytes))
        held.enter_context(patch(log_reader, "BLOCK_BYTES", PIECE))
        held.enter_context(patch(column_reader, "PIECE", PIECE))
        held.enter_context(patch(column_reader, "BLOCK_BYTES", 30 * PIECE))
        result = CliRunner().invoke(main, [str(word) for word in words])
    return result.exit_code, result.stdout, result.stderr, repr(result.exception)


@given(words=st.sampled_from(WORDS), lines=TEXTS)
@example(words=("-L",), lines=["(0000000001.000000) can0 123#01", "# 12 frames were lost", ""])
@example(words=(), lines=["(1000000000.000000) a%s%d%% 701#05"] * 9)
def test_lines_of_columns_are_those_of_frames(words: tuple[str, ...], lines: list[str]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder, "run.log")
        path.write_bytes("\n".join(lines).encode("latin-1"))
        assert said(0, "dump", path, *words) == said(1 << 30, "dump", path, *words)


@given(name=st.sampled_from(["run.blf", "run.asc", "run.trc", "run.jsonl"]), records=traffic())
def test_other_formats_are_shown_alike(name: str, records: list[Record]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder, name)
        writer = write_log(path)
        for record in records:
            writer.write(record)
        writer.close()
        for words in (("-r", "-x", "-t", "a"), ("-L",)):
            assert said(0, "dump", path, *words) == said(1 << 30, "dump", path, *words)


@given(name=st.sampled_from(OUT), lines=TEXTS)
def test_logs_of_columns_are_those_of_frames(name: str, lines: list[str]) -> None:
    with TemporaryDirectory() as folder:
        path, out = Path(folder, "run.log"), Path(folder, name)
        path.write_bytes("\n".join([FIRST, *lines]).encode("latin-1"))
        found = []
        for small_bytes in (0, 1 << 30):
            found.append(said(small_bytes, "conv", path, out))
            data = out.read_bytes() if out.exists() else b""
            found.append((gzip.decompress(data) if data and name.endswith(".gz") else data,))
            out.unlink(missing_ok=True)
    assert found[:2] == found[2:]


@pytest.mark.parametrize("at_us", [(1 << 51) - 1, 1 << 51, 16_725_225_599_999_999])
def test_late_times_are_written_alike(at_us: int, tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    frames = [Record(at_us + n, "can0", CanFrame(5, b"\1")) for n in range(50)]
    path.write_text("".join(f"{log_line(frame)}\n" for frame in frames), "ascii")
    found = []
    for small_bytes in (0, 1 << 30):
        found.append(said(small_bytes, "conv", path, tmp_path / "out.asc"))
        found.append(((tmp_path / "out.asc").read_bytes(),))
    assert found[:2] == found[2:]


def test_usual_logs_are_read_in_pieces(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text("(0000000001.000000) can0 123#01\n" * 39 + "(0000000001.000000) can0 123#R\n")
    pieces = list(source.PieceLog(path).pieces())
    assert [len(piece) for piece in pieces] == [40, 0]
    assert not isinstance(pieces[0], list)
