"""Rotation, limits, and how a recording ends."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.host.canmon.model.recorder.bench import (
    GAP_US,
    events,
    feed,
    frames_of,
    index_of,
    numbers,
    parts,
    record,
)
from tickrig.host.canmon.model.logs.log_file import back, gone
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.recorder.files import RecordingPlan, read_plan
from tickrig.host.canmon.model.recorder.recorder import Recorder, RecorderState

FORMATS = [
    "run.pcapng",
    "run.log",
    "run.jsonl",
    "run.csv",
    "run.asc",
    "run.trc",
    "run.blf",
    "run.log.gz",
]


def test_one_file_has_no_index(tmp_path: Path) -> None:
    recorder = Recorder(RecordingPlan(path=tmp_path / "run.log"))
    feed(recorder, [record(number) for number in range(300)])
    recorder.close()
    recorder.close()
    assert [path.name for path in tmp_path.iterdir()] == ["run.log"]
    assert numbers(read_log(tmp_path / "run.log")) == list(range(300))
    assert (recorder.messages(), recorder.state) == ([], RecorderState.ENDED)


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_is_ended_before_it_is_too_large_and_nothing_is_lost(
    name: str, tmp_path: Path
) -> None:
    plan = read_plan(tmp_path / name, rotate=["64k"])
    recorder = Recorder(plan)
    feed(recorder, [record(number) for number in range(20_000)])
    recorder.close()
    assert frames_of(plan) == list(range(20_000))
    sizes = [path.stat().st_size for path in parts(plan)]
    assert len(sizes) > 1
    in_blocks = name.endswith((".gz", ".blf"))
    assert max(sizes) <= (64 << 10) + (256 << 10 if in_blocks else 0)
    files = events(plan, "file")
    assert [said["bytes"] for said in files] == sizes
    assert sum(said["frames"] for said in files) == 20_000


def test_a_file_is_ended_at_the_first_frame_that_is_so_much_later(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", rotate=["1s"])
    recorder = Recorder(plan)
    feed(recorder, [record(number) for number in range(20_000)], batch=7_777)
    recorder.close()
    each = [numbers(read_log(path)) for path in parts(plan)]
    assert [one[0] for one in each] == [0, 8_000, 16_000]
    assert sum(map(len, each)) == 20_000
    assert [(said["from"], said["to"]) for said in events(plan, "file")][:2] == [
        (0.0, 7_999 * GAP_US / 1e6),
        (1.0, 15_999 * GAP_US / 1e6),
    ]


def test_a_clock_that_was_set_back_ends_no_file(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", rotate=["1s"])
    recorder = Recorder(plan)
    feed(recorder, [record(100_000)])
    feed(recorder, [record(number) for number in range(100)])
    recorder.close()
    assert (len(parts(plan)), len(frames_of(plan))) == (1, 101)


def test_the_oldest_files_go_where_disk_space_is_used_up(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", disk="1M", rotate=["64k"])
    recorder = Recorder(plan)
    for begin in range(0, 60_000, 2_000):
        feed(recorder, [record(number) for number in range(begin, begin + 2_000)])
        assert sum(path.stat().st_size for path in parts(plan)) <= 1 << 20
    recorder.close()
    kept = frames_of(plan)
    assert kept == list(range(60_000 - len(kept), 60_000))
    removed = [said["file"] for said in events(plan, "removed")]
    assert removed == [plan.part(number).name for number in range(1, len(removed) + 1)]
    assert f"{len(removed)} old files removed" in recorder.messages()[-1]
    assert recorder.frames == 60_000


def test_a_recording_ends_where_that_is_wanted_at_the_limit(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", disk="1M", at_limit="end")
    recorder = Recorder(plan)
    feed(recorder, [record(number) for number in range(60_000)])
    assert (recorder.state, recorder.failed) == (RecorderState.ENDED, "")
    recorder.close()
    kept = frames_of(plan)
    assert kept == list(range(len(kept)))
    assert 0 < sum(path.stat().st_size for path in parts(plan)) <= 1 << 20
    assert recorder.ended == "1048576 bytes of disk space are used up"
    assert index_of(plan)[-1]["why"] == recorder.ended


def test_a_recording_goes_on_where_it_was_ended(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", disk="1M", rotate=["64k"])
    for begin in (0, 10_000, 20_000, 30_000):
        recorder = Recorder(plan)
        feed(recorder, [record(number) for number in range(begin, begin + 10_000)])
        recorder.close()
    kept = frames_of(plan)
    assert kept == list(range(40_000 - len(kept), 40_000))
    assert sum(path.stat().st_size for path in parts(plan)) <= 1 << 20
    assert len(events(plan, "end")) == 4


def test_a_file_that_is_in_no_index_is_not_overwritten(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", rotate=["64k"])
    plan.part(7).write_text("precious")
    recorder = Recorder(plan)
    feed(recorder, [record(1)])
    recorder.close()
    assert plan.part(7).read_text() == "precious"
    assert frames_of(plan) == [1]
    assert plan.part(8).exists()


@pytest.mark.parametrize("name", ["run.log", "run.log.gz", "run.blf", "run.jsonl.gz"])
def test_what_a_killed_recorder_wrote_is_put_into_the_index(name: str, tmp_path: Path) -> None:
    plan = read_plan(tmp_path / name, rotate=["1G"])
    child = os.fork()
    if not child:
        feed(Recorder(plan), [record(number) for number in range(20_000)])
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    with plan.index.open("a") as index:
        index.write('{"v":1,"ev":"ga')
    recorder = Recorder(plan)
    (said,) = [said for said in _sound(plan) if said["ev"] == "file"]
    assert said["cut"] is True
    assert 20_000 - 8_001 <= said["frames"] <= 20_000
    assert recorder.messages()[0].startswith(
        f"{plan.part(1).name} was not ended by its recorder: {said['frames']} frames can be read"
    )
    feed(recorder, [record(20_000)])
    recorder.close()
    assert numbers(read_log(plan.part(2))) == [20_000]


def test_a_large_file_that_was_not_ended_is_not_read(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", rotate=["1G"])
    plan.index.write_text('{"v":1,"ev":"open","t":0,"file":"run-00001.log"}\n')
    with plan.part(1).open("wb") as file:
        file.truncate(40 << 20)
    recorder = Recorder(plan)
    recorder.close()
    assert recorder.messages()[0] == (
        "run-00001.log was not ended by its recorder: it has 41943040 bytes;"
        " what came behind them is missing"
    )
    (said,) = events(plan, "file")
    assert (said["frames"], said["bytes"]) == (None, 40 << 20)


def test_an_empty_file_that_was_not_ended_is_told(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", rotate=["1G"])
    plan.index.write_text('{"v":1,"ev":"open","t":0,"file":"run-00001.log"}\n')
    plan.part(1).touch()
    recorder = Recorder(plan)
    recorder.close()
    assert recorder.messages()[0].endswith(": 0 frames can be read; what came behind is missing")


def _sound(plan: RecordingPlan) -> list[dict[str, Any]]:
    lines = plan.index.read_text("utf-8").splitlines()
    return [json.loads(line) for line in lines if line.endswith("}")]


@pytest.mark.parametrize("text", ["", "\0\n", "[]\n3\n", '{"ev":"open","file":"../../x"}\n' * 2])
def test_an_index_may_hold_anything(text: str, tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "sub" / "run.log", disk="1M")
    plan.path.parent.mkdir()
    (tmp_path / "x").write_text("precious")
    plan.index.write_text(text + '{"ev":"file","file":"../x","bytes":2000000}\n')
    recorder = Recorder(plan)
    feed(recorder, [record(1)])
    recorder.close()
    assert frames_of(plan) == [1]
    assert (tmp_path / "x").read_text() == "precious"


def test_losses_and_gaps_stand_at_their_place_and_in_the_index(tmp_path: Path) -> None:
    plan = read_plan(tmp_path / "run.log", rotate=["1G"])
    recorder = Recorder(plan)
    feed(recorder, [record(1)])
    feed(recorder, [record(2)], lost=12, marks=[gone(5, "can0", "x"), back(6, "can0", 1_000_000)])
    feed(recorder, [record(3)], lost=12)
    recorder.close()
    lines = plan.part(1).read_text().splitlines()
    assert [line[:5] for line in lines] == ["(0000", "(0000", "# 12 ", "# can", "# can", "(0000"]
    (drop,), (away,), (file,) = (events(plan, kind) for kind in ("drop", "back", "file"))
    assert (drop["n"], drop["file"]) == (12, "run-00001.log")
    assert (away["ch"], away["away"]) == ("can0", 1.0)
    assert (file["lost"], file["gaps"]) == (12, 1)


def test_after_an_error_what_is_whole_stays_and_the_rest_is_counted(tmp_path: Path) -> None:
    """The operating system takes half of a block."""
    plan = read_plan(tmp_path / "run.log", rotate=["1G"])
    recorder = Recorder(plan)
    feed(recorder, [record(number) for number in range(1_000)])
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    size = plan.part(1).stat().st_size
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size + 1_000, before[1]))
        feed(recorder, [record(number) for number in range(1_000, 1_100)])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert recorder.failed == f"{plan.part(1)}: File too large"
    feed(recorder, [record(1_100)])
    recorder.close()
    assert (recorder.state, recorder.frames, recorder.missing) == (RecorderState.FAILED, 1_000, 101)
    assert numbers(reader := read_log(plan.part(1))) == list(range(1_000))
    assert reader.tally.unread == 0
    assert recorder.messages() == [
        f"1000 frames in 1 file; 101 that came are missing; {plan.index}"
    ]
    assert [said["ev"] for said in index_of(plan)] == ["open", "file", "end"]


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 1 MiB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("only root mounts a disk")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("name", ["run.log", "run.blf", "run.log.gz"])
def test_a_full_disk_ends_it_in_good_order(small_disk: Path, name: str) -> None:
    plan = read_plan(small_disk / name, rotate=["128k"])
    recorder, count = Recorder(plan), 0
    while not recorder.failed:
        assert count < 1_000_000
        feed(recorder, [record(number) for number in range(count, count + 2_000)], batch=2_000)
        count += 2_000
    recorder.close()
    assert recorder.failed == f"{parts(plan)[-1]}: 256 KiB are left on the disk"
    missing = f"{recorder.missing} that came are" if recorder.missing else "none that came is"
    assert f"; {missing} missing; " in recorder.messages()[-1]
    assert frames_of(plan) == list(range(recorder.frames))
    assert recorder.frames + recorder.missing == count
    assert events(plan, "file")[-1]["frames"] == recorder.frames - sum(
        said["frames"] for said in events(plan, "file")[:-1]
    )


def test_where_others_fill_the_disk_the_oldest_files_go(small_disk: Path) -> None:
    plan = read_plan(small_disk / "run.log", rotate=["64k"], disk="4M")
    recorder = Recorder(plan)
    feed(recorder, [record(number) for number in range(50_000)], batch=1_000)
    (small_disk / "other").write_bytes(bytes(150 << 10))
    feed(recorder, [record(number) for number in range(50_000, 60_000)], batch=1_000)
    recorder.close()
    assert recorder.failed == ""
    kept = frames_of(plan)
    assert kept == list(range(60_000 - len(kept), 60_000))
