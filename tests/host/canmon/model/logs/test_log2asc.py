"""What log2asc of can-utils makes of candump logs, in all spellings, read as the same frames."""

from __future__ import annotations

import random
import shutil
import subprocess
from pathlib import Path

import pytest

from tickrig.host.canmon.model.frames import AnyFrame, Record
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.wire.can import FD_LENGTHS, CanFrame, ErrorFrame, FdFrame

BUS_ERROR = ErrorFrame(0x80)
START_US = 1_500_000_000_000_000

pytestmark = pytest.mark.skipif(
    not (shutil.which("log2asc") and shutil.which("asc2log")),
    reason="no log2asc: apt-get install can-utils",
)


def mixed() -> list[Record]:
    chance = random.Random(18)
    frames: list[AnyFrame] = [CanFrame(n, chance.randbytes(n)) for n in range(9)]
    frames += [CanFrame(n << 20, chance.randbytes(n), False, True) for n in range(9)]
    frames += [CanFrame(n, b"", True, n % 2 == 0, n) for n in range(9)]
    frames += [
        FdFrame(0x700 + flags, chance.randbytes(length), length % 3 == 0, flags)
        for length in FD_LENGTHS
        for flags in range(4)
    ]
    chance.shuffle(frames)
    return [
        Record(START_US + 12_300 * n, chance.choice(("can0", "can1")), frame, chance.random() < 0.3)
        for n, frame in enumerate(frames)
    ]


def made(folder: Path, records: list[Record], *options: str) -> Path:
    log = write_log(folder / "run.log")
    for record in records:
        log.write(record)
    log.close()
    files = ("-I", folder / "run.log", "-O", folder / "run.asc")
    subprocess.run(["log2asc", *options, *files, "can0", "can1"], check=True)
    return folder / "run.asc"


@pytest.mark.parametrize("options", [(), ("-f",), ("-4",), ("-n",), ("-f", "-n")])
def test_its_files_are_read_frame_by_frame(options: tuple[str, ...], tmp_path: Path) -> None:
    reader = read_log(made(tmp_path, mixed(), *options))
    assert list(reader) == mixed()
    assert reader.tally.messages("run.asc") == []


def test_remote_frames_without_a_length_are_read(tmp_path: Path) -> None:
    expected = [
        one._replace(frame=one.frame._replace(remote_length=0))
        if isinstance(one.frame, CanFrame)
        else one
        for one in mixed()
    ]
    assert list(read_log(made(tmp_path, mixed(), "-r"))) == expected


def test_error_frames_have_no_class(tmp_path: Path) -> None:
    frames: list[AnyFrame] = [CanFrame(1), ErrorFrame(0x88, b"\0\0\1\0\0\0\0\0"), CanFrame(2)]
    records = [Record(START_US + 100 * n, "can0", frame) for n, frame in enumerate(frames)]
    read = [one.frame for one in read_log(made(tmp_path, records))]
    assert read == [CanFrame(1), BUS_ERROR, CanFrame(2)]


def test_asc2log_reads_what_we_write(tmp_path: Path) -> None:
    log = write_log(tmp_path / "ours.asc")
    for record in mixed():
        log.write(record)
    log.close()
    files = ("-I", tmp_path / "ours.asc", "-O", tmp_path / "theirs.log")
    subprocess.run(["asc2log", *files], check=True, stderr=subprocess.DEVNULL)
    read = list(read_log(tmp_path / "theirs.log"))
    assert [(one.channel, one.frame, one.sent) for one in read] == [
        (one.channel, one.frame, one.sent) for one in mixed()
    ]
