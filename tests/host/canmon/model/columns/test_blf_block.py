from __future__ import annotations

import struct
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import example, given
from hypothesis import strategies as st

from tests.host.canmon.model.columns.test_column_reader import rows_of, rows_of_records
from tests.host.canmon.model.strategies import traffic
from tickrig.host.canmon.model.columns.column_reader import BlfBlocks, read_columns
from tickrig.host.canmon.model.columns.columns import ChannelNames, Columns, NoColumnsError
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.can_log import BlfBlock, CanLogReader
from tickrig.host.canmon.model.logs.log_file import LogError, LogFormat
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.wire.can import CanFrame, FdFrame

HEAD = struct.Struct("<4sLBBBBBBBBQQLL8H8H")
STARTED = (2020, 5, 1, 4, 5, 6, 7, 8)
BODIES = st.one_of(
    st.builds(
        struct.Struct("<HBBL8s").pack,
        st.sampled_from([0, 1, 1, 2, 0xFFFF]),
        st.sampled_from([0, 0, 1, 0x80, 0x81, 0x7E]),
        st.sampled_from([*range(9), 8, 8, 9, 255]),
        st.sampled_from([0x181, 0x7FF, 0x800, 0x8000_0005, 0x9FFF_FFFF, 0xFFFF_FFFF]),
        st.binary(min_size=8, max_size=8),
    ),
    st.binary(max_size=120),
)
KINDS = st.sampled_from([1] * 8 + [86] * 4 + [0, 2, 4, 10, 31, 73, 96, 100, 101, 104, 115, 256])
STAMPS = st.one_of(st.integers(0, 1 << 40), st.integers(0, (1 << 64) - 1))
PADDING = st.sampled_from([0, 0, 0, 0, 0, 0, 1, 3, 4, 5, 8, 12])


@st.composite
def objects(draw: st.DrawFn) -> bytes:
    body, version = draw(BODIES), draw(st.sampled_from([1, 1, 1, 2, 2, 0, 3]))
    more = struct.pack("<LHHQ", draw(st.sampled_from([2, 2, 1, 0])), 0, 0, draw(STAMPS))
    more += bytes(8) if version == 2 else b""
    size = 16 + len(more) + len(body) + draw(st.sampled_from([0] * 12 + [-40, -1, 1, 4, 400]))
    head = struct.pack("<4sHHLL", b"LOBJ", 32, version, max(0, size), draw(KINDS))
    return head + more + body + bytes(draw(PADDING))


@st.composite
def alike(draw: st.DrawFn) -> bytes:
    """Objects as python-can writes them, of one size."""
    frames = draw(st.lists(st.tuples(BODIES.filter(lambda body: len(body) == 16), STAMPS)))
    heads = struct.pack("<4sHHLL", b"LOBJ", 32, 1, 48, 1)
    return b"".join(
        heads + struct.pack("<LHHQ", 2, 0, 0, stamp % (1 << 50)) + body for body, stamp in frames
    )


def blf(path: Path, contents: list[bytes], count: int = 0) -> Path:
    """Write a log of containers."""
    inside = b""
    for content in contents:
        packed = zlib.compress(content)
        size = 32 + len(packed)
        inside += struct.pack("<4sHHLLH6xL4x", b"LOBJ", 16, 1, size, 10, 2, len(content))
        inside += packed + bytes(size % 4)
    sizes = 144 + len(inside), 144 + sum(map(len, contents))
    head = HEAD.pack(b"LOGG", 144, 5, 0, 0, 0, 2, 6, 8, 1, *sizes, count, 0, *STARTED, *STARTED)
    path.write_bytes(head.ljust(144, b"\0") + inside)
    return path


def read_both(path: Path) -> tuple[tuple[object, ...], tuple[object, ...]]:
    """Return frames, tally and error of the columns, and of single frames."""
    records, blocks, said = list[Record](), list[Columns](), ["", ""]
    single, whole = read_log(path), read_columns(path)
    try:
        records.extend(single)
    except LogError as error:
        said[1] = str(error)
    try:
        blocks.extend(whole)
    except LogError as error:
        said[0] = str(error)
    except NoColumnsError:
        assert any(isinstance(record.frame, FdFrame) for record in records)
        return (), ()
    rows = rows_of_records(records)
    return (rows_of(blocks), whole.tally, said[0]), (rows, single.tally, said[1])


@given(
    contents=st.lists(st.lists(objects(), max_size=6).map(b"".join) | alike(), max_size=4),
    cut=st.integers(0, 60),
)
@example(contents=[b"LOBJ"], cut=0)
def test_columns_are_what_single_frames_give(contents: list[bytes], cut: int) -> None:
    """One object may lie in two containers; sizes, padding, types and versions are by chance."""
    data = b"".join(contents)
    begin = max(0, len(data) // 2 - cut)
    with TemporaryDirectory() as folder:
        whole, single = read_both(blf(Path(folder, "run.blf"), contents))
        assert whole == single
        whole, single = read_both(blf(Path(folder, "run.blf"), [data[:begin], data[begin:]]))
        assert whole == single


@given(records=traffic())
def test_what_we_write_is_read_alike(records: list[Record]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder, "run.blf")
        writer = write_log(path)
        for record in records:
            writer.write(record)
        writer.close()
        whole, single = read_both(path)
    assert whole == single


def test_usual_containers_take_the_fast_way(tmp_path: Path) -> None:
    path = tmp_path / "run.blf"
    writer = write_log(path)
    for n in range(10_000):
        writer.write(Record(1_700_000_000_000_000 + n, "can0", CanFrame(n % 0x800, bytes(n % 9))))
    writer.close()
    found = CanLogReader(path, LogFormat.BLF).blocks(BlfBlocks(ChannelNames()))
    assert sum(one.frames for one in found if isinstance(one, BlfBlock)) == 10_000
