from __future__ import annotations

import struct
import time
import zlib
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.logs.test_log_lines import FRAMES
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogError, LogFormatError, log_format
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.canmon.model.logs.notation import parse_frame
from tickrig.wire.can import CanFrame, ErrorFrame

START_US = 1_436_509_052_249_713
ASAMMDF = find_spec("asammdf") is not None
GAPS = st.integers(0, 100_000_000)

ASC = """\
date Fri Jul 10 06:17:32.249 AM 2015
base hex  timestamps absolute
internal events logged
Begin Triggerblock Fri Jul 10 06:17:32.249 AM 2015
   0.000000 Start of measurement
   0.000100 1  705             Rx   d 1 7F
   0.000200 CAN 1 Status:chip status error active
   0.000300 1  705             Rx   d 1 ZZ
   0.000400 2  605x            Tx   d 2 01 02
   0.000500 CANFD   1 Rx        123                                  1 0 9 12 00 01 02 03 04 05 06 07 08 09 0A 0B        0    0     1000        0        0        0        0        0
   0.000600 1  123             Rx   r 5
End TriggerBlock
"""  # noqa: E501 - as python-can writes it
TRC = """\
;$FILEVERSION=1.1
;$STARTTIME=43474.9876543210
;   Message Number
     1)      1841.0  Rx         0705  1  7F
     2)      1842.0  Warng  FFFFFFFF  4  00 00 00 04
     3)      1843.0  Rx         0705  Z
     4)      1844.0  Tx     00000605  2  01 02
"""
CSV = """\
timestamp,arbitration_id,extended,remote,error,dlc,data
1.5,0x705,0,0,0,1,fw==
oops
1.6,0x605,1,0,0,2,AQI=
"""


def log(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, "ascii")
    return path


def records(gaps: list[tuple[int, CanFrame | ErrorFrame, bool]]) -> list[Record]:
    at_us, found = START_US, []
    for gap_us, frame, sent in gaps:
        at_us += gap_us
        found.append(Record(at_us, "can0", frame, sent))
    return found


@given(st.lists(st.tuples(GAPS, FRAMES, st.booleans()), min_size=1, max_size=8))
def test_blf_holds_all_there_is(gaps: list[tuple[int, CanFrame | ErrorFrame, bool]]) -> None:
    with TemporaryDirectory() as folder:
        writer = write_log(path := Path(folder, "all.blf"))
        for record in records(gaps):
            writer.write(record)
        writer.close()
        kept = [one._replace(sent=False) if error(one) else one for one in records(gaps)]
        assert list(read_log(path)) == kept


def error(record: Record) -> bool:
    """BLF does not say who made an error frame."""
    return isinstance(record.frame, ErrorFrame)


@pytest.mark.parametrize("name", ["run.asc", "run.asc.gz", "run.trc", "run.csv"])
def test_text_formats_hold_data_frames(name: str, tmp_path: Path) -> None:
    frames = [
        Record(START_US, "can0", CanFrame.parse("705#7F")),
        Record(START_US + 1, "can1", CanFrame.parse("00000605#0011223344556677")),
        Record(START_US + 2_000_000, "can0", CanFrame.parse("123#")),
    ]
    path = tmp_path / name
    writer = write_log(path)
    for record in frames:
        writer.write(record)
    writer.close()
    writer.close()
    read = list(read_log(path))
    assert [record.frame for record in read] == [record.frame for record in frames]
    assert [record.at_us for record in read] == [record.at_us for record in frames]
    channels = ["can0"] * 3 if name == "run.csv" else ["can0", "can1", "can0"]
    assert [record.channel for record in read] == channels


TIMES = st.one_of(
    st.integers(0, 4_000_000_000_000_000),
    st.integers(1_700_000_000_000_000, 1_700_000_000_200_000),
    st.integers(0, 2_000_000),
)


def through(folder: Path, name: str, times: list[int]) -> list[int]:
    writer = write_log(path := folder / name)
    for at_us in times:
        writer.write(Record(at_us, "can0", CanFrame.parse("705#7F")))
    writer.close()
    return [record.at_us for record in read_log(path)]


@given(times=st.lists(TIMES, min_size=1, max_size=6))
def test_each_format_keeps_each_microsecond(times: list[int]) -> None:
    with TemporaryDirectory() as folder:
        for suffix in ("asc", "trc", "csv", "log", "jsonl"):
            assert through(Path(folder), f"run.{suffix}", times) == times
        first_us = min(times)  # python-can writes nanoseconds of a log as a float: 104 days
        times = sorted(at_us for at_us in times if at_us - first_us < (1 << 53) // 1_000)
        assert through(Path(folder), "run.blf", times) == times


@pytest.mark.parametrize("start_us", [1_700_000_000_005_000, 1_700_000_000_099_999, 5_000])
def test_a_log_that_starts_early_in_a_second_is_not_shifted(start_us: int, tmp_path: Path) -> None:
    times = [start_us, start_us + 1_234_567]
    assert through(tmp_path, "run.asc", times) == times
    with can.ASCReader(tmp_path / "run.asc", relative_timestamp=False) as reader:
        assert [round(message.timestamp * 1e6) for message in reader] == times


def test_an_asc_log_is_dated_by_its_first_frame_not_by_its_writing(tmp_path: Path) -> None:
    assert through(tmp_path, "run.asc", [START_US]) == [START_US]
    date, *_, block, start, _, _ = (tmp_path / "run.asc").read_text("ascii").splitlines()
    assert date.removeprefix("date ") == block.removeprefix("Begin Triggerblock ")
    assert start == "   0.000000 Start of measurement"
    write_log(tmp_path / "empty.asc").close()
    assert list(read_log(tmp_path / "empty.asc")) == []


@pytest.fixture
def berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with monkeypatch.context() as patched:
        patched.setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3")
        time.tzset()
        yield
    time.tzset()


@pytest.mark.usefixtures("berlin")
def test_an_hour_that_the_clock_shows_twice_is_kept_in_asc(tmp_path: Path) -> None:
    end_of_summer_us = 1_761_440_400_000_000  # 2025-10-26, 01:00 UTC
    times = [end_of_summer_us + minutes * 60_000_000 for minutes in (30, 70, -30)]
    assert through(tmp_path, "run.asc", times) == times


def test_frames_before_a_blf_log_begins_are_said(tmp_path: Path) -> None:
    writer = write_log(tmp_path / "run.blf")
    for at_us in (START_US, START_US - 100_000, START_US - 2_000_000):
        writer.write(Record(at_us, "can0", CanFrame.parse("705#7F")))
    writer.close()
    assert writer.messages() == ["run.blf: 1 frames from before its start moved there"]
    begin_us = START_US // 1_000_000 * 1_000_000
    read = [record.at_us for record in read_log(tmp_path / "run.blf")]
    assert read == [START_US, START_US - 100_000, begin_us]


@pytest.mark.parametrize("name", ["run.asc", "run.blf", "run.trc"])
def test_frames_of_no_date_are_left_out_and_said(name: str, tmp_path: Path) -> None:
    writer = write_log(tmp_path / name)
    writer.write(Record(999_999_999_999_000_000, "can0", CanFrame.parse("705#7F")))
    writer.close()
    assert writer.messages() == [f"{name}: 1 frames of the year 2500 and later left out"]


@pytest.mark.parametrize("stamp", ["inf", "nan", "-1.0", "1e12"])
@pytest.mark.parametrize("name", ["run.csv", "run.trc"])
def test_what_is_no_time_is_no_frame(name: str, stamp: str, tmp_path: Path) -> None:
    text = CSV.replace("1.5", stamp) if name == "run.csv" else TRC.replace("1841.0", stamp)
    text = text.replace(";$STARTTIME=43474.9876543210", ";$STARTTIME=25569").replace("1e12", "1e15")
    reader = read_log(log(tmp_path, name, text))
    assert [str(record.frame) for record in reader] == ["00000605#0102"]
    assert reader.tally.unread == 2


def test_bad_lines_of_asc_are_counted_and_reading_goes_on(tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, "run.asc", ASC))
    assert [str(record.frame) for record in reader] == [
        "705#7F",
        "00000605#0102",
        "123##1000102030405060708090A0B",
        "123#R5",
    ]
    assert reader.tally.bad_lines.first == [(8, "   0.000300 1  705             Rx   d 1 ZZ")]
    assert reader.tally.passed_over == {"lines with other events": 1}


@pytest.mark.parametrize(
    ("name", "text", "bad"),
    [
        ("run.asc", "   0.000700 1  705             Ry   d 1 7F\n", 1),
        ("run.asc", "   0.000700 CANFD   1 R\n", 1),
        ("run.asc", "\x01noise\n", 1),
        ("run.asc", "   0.000700 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n", 0),
        ("run.trc", "     5)      1845.0  Ry         0705  1  7F\n", 1),
        ("run.trc", "     5)      1845.0  Warng  FFFFFFFF  4  00 00 00 08  BUSHEAVY\n", 0),
    ],
)
def test_a_line_that_its_reader_passes_over_is_bad_unless_it_is_an_event(
    name: str, text: str, bad: int, tmp_path: Path
) -> None:
    head = ASC if name == "run.asc" else TRC
    reader = read_log(log(tmp_path, name, head + text))
    assert len(list(reader)) == len(list(read_log(log(tmp_path, name, head))))
    reader = read_log(log(tmp_path, name, head + text))
    list(reader)
    assert reader.tally.bad_lines.count == 1 + bad
    assert reader.tally.passed_over["lines with other events"] == 2 - bad


def test_bad_lines_of_trc_are_counted_and_reading_goes_on(tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, "run.trc", TRC))
    assert [str(record.frame) for record in reader] == ["705#7F", "00000605#0102"]
    assert [number for number, _ in reader.tally.bad_lines.first] == [6]
    assert reader.tally.passed_over == {"lines with other events": 1}


def test_a_trc_log_whose_head_does_not_tell_the_columns_is_none(tmp_path: Path) -> None:
    head = ";$FILEVERSION=2.1\n;$STARTTIME=43474.5\n"
    path = log(tmp_path, "run.trc", f"{head}     1)      1841.0  Rx         0705  1  7F\n")
    with pytest.raises(LogError, match=r"run\.trc is no trc log: File has no column"):
        list(read_log(path))


def test_bad_lines_of_csv_are_counted_and_reading_goes_on(tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, "run.csv", CSV))
    assert [str(record.frame) for record in reader] == ["705#7F", "00000605#0102"]
    assert reader.tally.bad_lines.first == [(3, "oops")]


def test_a_reader_reads_from_the_beginning_each_time(tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, "run.csv", CSV))
    assert list(reader) == list(reader)
    assert reader.tally.bad_lines.count == 1


def test_objects_of_blf_that_are_no_frames_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "run.blf"
    with can.BLFWriter(path) as writer:
        writer.log_event("a marker", 1_436_509_052.0)
        writer.on_message_received(can.Message(timestamp=1_436_509_053, arbitration_id=1))
    reader = read_log(path)
    assert len(list(reader)) == 1
    assert reader.tally.messages("run.blf") == ["run.blf: 1 objects that are no frames passed over"]


def blf(path: Path, frames: int) -> bytes:
    with can.BLFWriter(path, max_container_size=500) as writer:
        writer.log_event("a marker", 1_436_509_052.0)
        for n in range(frames):
            writer.on_message_received(can.Message(timestamp=1_436_509_053 + n, data=[n]))
    return path.read_bytes()


def test_a_blf_log_that_was_cut_anywhere_says_so(tmp_path: Path) -> None:
    whole = blf(tmp_path / "run.blf", 60)
    assert len(list(read_log(tmp_path / "run.blf"))) == 60
    for length in range(145, len(whole), 3):
        (tmp_path / "cut.blf").write_bytes(whole[:length])
        with pytest.raises(LogError, match=r"cut\.blf"):
            list(read_log(tmp_path / "cut.blf"))


@pytest.mark.parametrize("kind", [1, 10, 96])
def test_a_blf_log_with_an_object_of_no_size_is_none(kind: int, tmp_path: Path) -> None:
    head = blf(tmp_path / "run.blf", 1)[:144]
    empty = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 0, kind) + bytes(32)
    container = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 32 + len(empty), 10) + bytes(16) + empty
    (tmp_path / "run.blf").write_bytes(head + container)
    with pytest.raises(LogError, match="an object of 0 bytes"):
        list(read_log(tmp_path / "run.blf"))


def test_a_blf_log_that_was_never_ended_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    whole = bytearray(blf(tmp_path / "run.blf", 60))
    whole[32:36] = bytes(4)  # its header is written with the end
    (tmp_path / "run.blf").write_bytes(whole)
    assert len(list(read_log(tmp_path / "run.blf"))) == 60
    (tmp_path / "run.blf").write_bytes(whole[:-30])
    with pytest.raises(LogError, match=r"it is cut after [0-9]+ objects"):
        list(read_log(tmp_path / "run.blf"))


def test_error_frames_of_asc_are_bus_errors(tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, "run.asc", ASC + "   0.000700 1  ErrorFrame\n"))
    assert str(list(reader)[-1].frame) == "20000080#0000000000000000"


@pytest.mark.parametrize("content", [b"", b"LOGG", b"x" * 400, b"LOGG" + bytes(300)])
def test_what_is_no_blf_says_so(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "run.blf"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"run\.blf is no blf log"):
        list(read_log(path))


@given(st.binary(max_size=400))
def test_noise_never_raises_anything_else(noise: bytes) -> None:
    with TemporaryDirectory() as folder:
        for suffix in ("asc", "blf", "trc", "csv", "log", "jsonl", "log.gz"):
            path = Path(folder, f"noise.{suffix}")
            path.write_bytes(noise)
            with suppress(LogError, OSError):
                list(read_log(path))


@pytest.mark.skipif(not ASAMMDF, reason="no asammdf here: pip install python-can[mf4]")
def test_mf4_holds_all_there_is(tmp_path: Path) -> None:
    words = ("705#7F", "00000605#0011223344556677", "123#R5", "123#", "123##3" + "11" * 64)
    frames = [
        *(Record(START_US + 10 * n, "can1", parse_frame(word)) for n, word in enumerate(words)),
        Record(START_US + 2_000_000, "can0", ErrorFrame(0x88, bytes(8))),
    ]
    writer = write_log(tmp_path / "run.mf4")
    for record in frames:
        writer.write(record)
    writer.close()
    assert list(read_log(tmp_path / "run.mf4")) == frames


@pytest.mark.skipif(ASAMMDF, reason="asammdf is here")
def test_mf4_without_its_library_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mf4"
    said = r"run\.mf4: MF4 needs asammdf: pip install 'python-can\[mf4\]'$"
    with pytest.raises(LogError, match=said):
        write_log(path)
    assert not path.exists()
    path.write_bytes(b"MDF     4.10")
    with pytest.raises(LogError, match=said):
        list(read_log(path))


def test_blf_is_not_compressed_twice(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"not written with \.gz"):
        write_log(tmp_path / "run.blf.gz")


def test_a_name_without_a_format_is_refused() -> None:
    with pytest.raises(LogFormatError, match=r"\.log, \.candump"):
        log_format(Path("run.dat"))


def blf_object(kind: int, body: bytes, at_ns: int = 0, version: int = 1) -> bytes:
    """Return an object as Vector's tools write it."""
    head = (
        struct.pack("<LHHQ", 2, 0, 0, at_ns)
        if version == 1
        else bytes(8) + at_ns.to_bytes(16, "little")
    )
    size = 16 + len(head) + len(body)
    return (
        struct.pack("<4sHHLL", b"LOBJ", 16 + len(head), version, size, kind)
        + head
        + body
        + bytes(size % 4)
    )


def blf_with(path: Path, *objects: bytes) -> Path:
    """Write a log of one frame, then put objects before and behind it."""
    with can.BLFWriter(path) as writer:
        writer.on_message_received(can.Message(timestamp=1_436_509_053, data=[1]))
    data = path.read_bytes()
    packed = zlib.decompress(data[144 + 32 :])
    body = zlib.compress(b"".join([*objects[:1], packed, *objects[1:]]))
    head = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 32 + len(body), 10)
    path.write_bytes(data[:144] + head + struct.pack("<H6xL4x", 2, 0) + body)
    return path


@pytest.mark.parametrize("version", [1, 2])
def test_error_frames_that_python_can_passes_over_are_read(version: int, tmp_path: Path) -> None:
    path = blf_with(
        tmp_path / "run.blf",
        blf_object(2, struct.pack("<HHL", 2, 6, 0), 1_000, version),
        blf_object(104, struct.pack("<BBBB", 1, 8, 8, 0) + bytes(40), 2_000_000, version),
    )
    assert len(list(can.BLFReader(path))) == 1
    assert [(one.channel, str(one.frame)) for one in read_log(path)] == [
        ("can1", "20000080#0000000000000000"),
        ("can0", "00000000#01"),
        ("can0", "20000080#0000000000000000"),
    ]
    first, _, last = read_log(path)
    assert last.at_us - first.at_us == 1_999


def test_what_objects_of_blf_tell_of_errors_is_kept(tmp_path: Path) -> None:
    counts = [struct.pack("<HH6L", 1, 0, 9, 0, 0, 0, errors, 0) for errors in (0, 3)]
    path = blf_with(
        tmp_path / "run.blf",
        *(blf_object(4, body) for body in counts),
        *(blf_object(31, struct.pack("<HBBL", 1, sent, 0, 0)) for sent in (0, 8)),
    )
    reader = read_log(path)
    assert len(list(reader)) == 1
    assert reader.tally.errors("x") == [
        "x: it says that error frames were counted: 1 time",
        "x: it says that error counters are above 0: 1 time",
    ]
