from __future__ import annotations

import gzip
import random
from collections.abc import Callable, Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.columns import column_reader
from tickrig.host.canmon.model.columns.column_reader import CandumpBlock, ColumnReader, read_columns
from tickrig.host.canmon.model.columns.columns import ChannelNames, Columns, NoColumnsError, Rows
from tickrig.host.canmon.model.frames import Record, flagged_id
from tickrig.host.canmon.model.logs.log_file import LogError, LogTally
from tickrig.host.canmon.model.logs.log_reader import LogLines, LogReader, read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.wire.can import CanFrame, FdFrame

HEX = "0123456789abcdefABCDEF"


def text(alphabet: str, least: int, most: int) -> st.SearchStrategy[str]:
    return st.text(alphabet, min_size=least, max_size=most)


STAMPS = st.one_of(
    st.tuples(text("0123456789", 10, 10), text("0123456789", 6, 6)).map(".".join),
    st.tuples(text("0123456789", 1, 13), text("0123456789", 0, 10)).map(".".join),
)
NAMES = st.one_of(
    st.sampled_from(["can0", "can1", "vcan0", "udp_multicast", "239.74.163.2", "x" * 17]),
    text("abc:µ\0 \t", 0, 9),
)
IDENTS = st.one_of(text(HEX, 3, 3), text(HEX, 8, 8), text(HEX + " ", 0, 9))
DATA = st.one_of(
    st.binary(max_size=8).map(bytes.hex),
    text(HEX, 0, 18),
    st.sampled_from(["R", "R8", "#0AABB", "11.22", "0011223344556677_9", "#", "0g"]),
)
LINES = st.one_of(
    st.builds(
        "({}) {} {}#{}{}".format,
        STAMPS,
        NAMES,
        IDENTS,
        DATA,
        st.sampled_from(["", " R", " T", "\r", " R\r", " X"]),
    ),
    st.sampled_from(["", "# comment", "\r", '{"v":1,"t":1.5,"ch":"can0","id":1,"x":0,"data":""}']),
    text("()#. 0a\r\xb2\x85", 0, 40),
)


def log(folder: Path, text: str) -> Path:
    path = folder / "run.log"
    path.write_bytes(text.encode("latin-1"))
    return path


def rows_of(blocks: Iterable[Columns]) -> list[tuple[object, ...]]:
    return [row for columns in blocks for row in _rows(columns)]


def _rows(columns: Columns) -> list[tuple[object, ...]]:
    rows = zip(*(array.tolist() for array in columns.parts), strict=True)
    return [(*row, columns.channels[place]) for *row, place in rows]


def rows_by_line(path: Path) -> tuple[list[tuple[object, ...]], LogTally]:
    reader = read_log(path)
    return rows_of_records(reader), reader.tally


def rows_of_records(records: Iterable[Record]) -> list[tuple[object, ...]]:
    rows: list[tuple[object, ...]] = []
    for record in records:
        length = getattr(record.frame, "dlc", len(record.frame.data))
        payload = int.from_bytes(record.frame.data, "little")
        row = record.at_us, flagged_id(record), length, payload, record.sent, record.channel
        rows.append(row)
    return rows


@pytest.mark.parametrize("block_bytes", [1, 70, 1 << 20])
@given(lines=st.lists(LINES, max_size=12), end=st.sampled_from(["", "\n"]))
def test_columns_are_what_single_lines_give(block_bytes: int, lines: list[str], end: str) -> None:
    with (
        TemporaryDirectory() as folder,
        mock.patch.object(column_reader, "BLOCK_BYTES", block_bytes),
    ):
        path = log(Path(folder), "\n".join(lines) + end)
        columns = read_columns(path)
        if any(isinstance(record.frame, FdFrame) for record in read_log(path)):
            with pytest.raises(NoColumnsError):
                rows_of(columns)
            return
        found = rows_of(columns)
        rows, tally = rows_by_line(path)
    assert (found, columns.tally) == (rows, tally)


@pytest.mark.parametrize(
    "line",
    [
        "(1436509052.249713) can0 044#2A366C2BBA",
        "(0000000000.010000) vcan0 1FFFFFFF#0011223344556677 T",
        "(9999999999.999999) udp_multicast 7ff#",
    ],
)
def test_usual_lines_take_the_fast_way(line: str) -> None:
    rows, channels = Rows(1), ChannelNames()
    CandumpBlock(f"{line}\r\n".encode()).take(rows, channels)
    (record,) = LogLines().push(f"{line}\n".encode())
    assert (rows.known.tolist(), rows.at_us.tolist()) == ([True], [record.at_us])
    assert rows.ident.tolist() == [flagged_id(record)]


def test_lines_longer_than_a_block_and_files_without_end_are_whole(tmp_path: Path) -> None:
    line = "(0000000000.010000) can0 705#7F\n"
    path = log(tmp_path, line * 40_000 + "x" * (1 << 20) + "\n" + line[:-1])
    columns = read_columns(path)
    assert len(rows_of(columns)) == 40_001
    assert columns.tally.bad_lines.first[0][0] == 40_001


def until_damaged(reader: ColumnReader | LogReader) -> tuple[int, str]:
    """Return how many frames come, and what is said behind them."""
    frames = 0
    try:
        for found in reader:
            frames += len(found) if isinstance(found, Columns) else 1
    except LogError as error:
        return frames, str(error)
    return frames, ""


@pytest.mark.parametrize("read", [read_columns, read_log])
def test_of_a_compressed_log_that_was_cut_all_comes_that_is_there(
    read: Callable[[Path], ColumnReader | LogReader], tmp_path: Path
) -> None:
    path, chance = tmp_path / "run.log.gz", random.Random(1)
    lines = b"".join(
        b"(%010d.000000) can0 705#%02X\n" % (n, chance.randrange(256)) for n in range(40_000)
    )
    whole = gzip.compress(lines)
    path.write_bytes(whole[:-4])
    said = "Compressed file ended before the end-of-stream marker was reached"
    assert until_damaged(read(path)) == (
        40_000,
        f"{path}: cut or damaged behind line 40000: {said}",
    )
    path.write_bytes(whole[: len(whole) // 2])
    frames, message = until_damaged(read(path))
    assert (frames > 19_000, f"behind line {frames}: " in message) == (True, True)
    path.write_bytes(whole[:-8] + b"\0" * 8)
    assert until_damaged(read(path))[1].startswith(f"{path}: cut or damaged behind line 40000: CRC")


def test_more_buses_than_a_byte_numbers_are_refused(tmp_path: Path) -> None:
    path = log(tmp_path, "".join(f"(0000000000.000000) can{n} 001#\n" for n in range(257)))
    with pytest.raises(LogError, match="more than 256 buses"):
        list(read_columns(path))


def test_other_formats_are_read_frame_by_frame(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.write_text('{"v":1,"t":1.5,"ch":"can0","id":1,"x":1,"dir":"rx","data":"0A"}\n')
    assert rows_of(read_columns(path)) == [(1_500_000, 0x8000_0001, 1, 10, False, "can0")]


@pytest.mark.parametrize(
    "name", ["run.blf", "run.asc.gz", "run.trc.gz", "run.pcapng", "run.pcapng.gz"]
)
def test_of_another_format_that_was_cut_all_comes_that_is_there(name: str, tmp_path: Path) -> None:
    writer = write_log(tmp_path / name)
    for n in range(20_000):
        data = random.Random(n).randbytes(8)
        writer.write(Record(1_700_000_000_000_000 + n, "can0", CanFrame(0x705, data)))
    writer.close()
    whole = (tmp_path / name).read_bytes()
    for data in (whole[: len(whole) // 2], whole[:-8] + bytes(8))[: 1 + name.endswith(".gz")]:
        (tmp_path / name).write_bytes(data)
        frames, said = until_damaged(read_columns(tmp_path / name))
        assert (frames, said) == until_damaged(read_log(tmp_path / name))
        assert frames > 5_000
        assert said
