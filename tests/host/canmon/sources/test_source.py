from __future__ import annotations

import gzip
import os
from pathlib import Path

import pytest

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.sources.source import Source, StdinSource, open_source
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.wire.can import CanFrame, parse_log

LOG = """\
(0000000000.010000) can0 705#7F
(0000000000.020000) can0 185#3702R
(0000000000.030000) can0 080#
"""


def drained(source: Source) -> list[Record]:
    records: list[Record] = []
    while not source.ended:
        records += source.poll(0)
    return records


def log(folder: Path, text: str, name: str = "run.log") -> str:
    path = folder / name
    path.write_text(text, "ascii")
    return str(path)


def test_a_file_gives_its_frames_and_says_which_lines_are_none(tmp_path: Path) -> None:
    source = open_source([log(tmp_path, LOG)])
    assert [str(record.frame) for record in drained(source)] == ["705#7F", "080#"]
    assert source.messages() == [
        f"{tmp_path}/run.log: line 2 is no frame: '(0000000000.020000) can0 185#3702R'"
    ]
    assert not source.live


def test_a_compressed_file_is_read_like_a_plain_one(tmp_path: Path) -> None:
    path = tmp_path / "run.log.gz"
    path.write_bytes(gzip.compress(LOG.encode()))
    assert len(drained(open_source([str(path)]))) == 2


def test_a_compressed_file_that_was_cut_fails_with_what_it_held(tmp_path: Path) -> None:
    path = tmp_path / "run.log.gz"
    path.write_bytes(gzip.compress(LOG.encode())[:-10])
    source = open_source([str(path)])
    drained(source)
    assert source.failed.startswith(f"{path}: ")


def test_files_are_merged_by_time(tmp_path: Path) -> None:
    one = log(tmp_path, "(0000000001.000000) a 001#\n(0000000003.000000) a 003#\n", "one.log")
    two = log(tmp_path, "(0000000002.000000) b 002#\n", "two.log")
    assert [record.channel for record in drained(open_source([one, two]))] == ["a", "b", "a"]


def test_filters_of_candump_hold_for_files(tmp_path: Path) -> None:
    source = open_source([log(tmp_path, LOG) + ",080:7FF"])
    assert [str(record.frame) for record in drained(source)] == ["080#"]


def test_a_line_that_comes_in_pieces_is_one_line() -> None:
    read, write = os.pipe()
    source = StdinSource(read)
    assert source.poll(0) == []
    for piece in (LOG[:20], LOG[20:40]):
        os.write(write, piece.encode())
        records = source.poll(0)
    (line,) = parse_log(LOG[:32])
    assert records == [Record(line.at_us, line.channel, CanFrame(0x705, b"\x7f"))]
    os.close(write)
    assert source.poll(0) == []
    assert source.ended
    os.close(read)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "no SOURCE"),
        (["run.log", "can0"], "cannot be mixed: run.log can0"),
        (["can0,12"], "'12' is no filter like 123:7FF"),
        (["run.gz"], "a log's name ends in"),
        ([""], "is not a bus"),
        (["/"], "'/' is a folder"),
        (["can0@fast"], "is not a bus"),
    ],
)
def test_words_that_name_nothing_are_refused(words: list[str], said: str) -> None:
    with pytest.raises(Refused, match=said):
        open_source(words)


def test_a_file_that_is_not_there_fails() -> None:
    with pytest.raises(SourceFailed, match=r"nowhere\.log: No such file"):
        open_source(["nowhere.log"])


def test_standard_input_that_cannot_be_read_fails() -> None:
    folder = os.open("/", os.O_RDONLY)
    source = StdinSource(folder)
    assert source.poll(0) == []
    assert (source.ended, source.failed) == (True, "standard input: Is a directory")
    os.close(folder)


def test_standard_input_tells_of_bad_lines_and_losses() -> None:
    read, write = os.pipe()
    source = StdinSource(read)
    os.write(write, b'noise\n{"v":1,"ev":"drop","n":3}\n')
    assert source.poll(0) == []
    source.close()
    assert (source.lost, source.ended, source.live) == (3, True, True)
    assert source.messages() == [
        "standard input: line 1 is no frame: 'noise'",
        "standard input: its recorder lost 3 frames",
    ]
    os.close(read)
    os.close(write)


def test_joined_filters_must_all_hold(tmp_path: Path) -> None:
    source = open_source([log(tmp_path, LOG) + ",700:700,705~7FF,j"])
    assert drained(source) == []
    source = open_source([log(tmp_path, LOG) + ",00000705:DFFFFFFF"])
    assert drained(source) == []


def test_error_frames_pass_by_their_mask_alone(tmp_path: Path) -> None:
    text = "(0.1) can0 20000088#\n(0.2) can0 20000004#\n(0.3) can0 123#\n"
    source = open_source([log(tmp_path, text) + ",7FF:7FF,#80"])
    assert [str(record.frame) for record in drained(source)] == ["20000088#0000000000000000"]
