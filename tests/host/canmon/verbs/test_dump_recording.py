"""`canmon dump -l` with rotation, limits and triggers."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.output.recording import LogFile
from tickrig.host.canmon.verbs import dump

CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")
PATIENCE_S = 20.0


def line(number: int, ident: str = "181") -> str:
    at_us = 1_700_000_000_000_000 + number * 125
    return f"({at_us // 1_000_000}.{at_us % 1_000_000:06d}) can0 {ident}#{number:016X}\n"


def write_run(folder: Path, count: int, *emcys: int) -> str:
    path = folder / "in.log"
    lines = (line(number, "085" if number in emcys else "181") for number in range(count))
    path.write_text("".join(lines), "ascii")
    return str(path)


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words)


def numbers(folder: Path, pattern: str) -> list[int]:
    paths = sorted(path for path in folder.glob(pattern) if "index" not in path.name)
    return [int.from_bytes(one.frame.data, "big") for path in paths for one in read_log(path)]


def index_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(text) for text in path.read_text("utf-8").splitlines()]


def test_a_log_is_recorded_in_parts(tmp_path: Path) -> None:
    source, out = write_run(tmp_path, 20_000), tmp_path / "run.log"
    result = canmon("dump", source, "-l", str(out), "--rotate", "256k", "--rotate", "1s")
    assert (result.exit_code, result.stdout) == (0, "")
    assert numbers(tmp_path, "run-*.log") == list(range(20_000))
    index = tmp_path / "run.index.jsonl"
    files = [said["file"] for said in index_of(index) if said["ev"] == "file"]
    assert result.stderr == f"20000 frames in {len(files)} files; {index}\n"
    assert files == [path.name for path in sorted(tmp_path.glob("run-*.log"))]


def test_the_parts_are_one_log_again(tmp_path: Path) -> None:
    source, out = write_run(tmp_path, 5_000), tmp_path / "run.log"
    canmon("dump", source, "-l", str(out), "--rotate", "64k")
    parts = [str(path) for path in sorted(tmp_path.glob("run-*.log"))]
    assert len(parts) > 1
    assert canmon("dump", *parts, "-L").stdout == Path(source).read_text("ascii")


def test_what_is_around_a_fault_is_recorded(tmp_path: Path) -> None:
    source, out = write_run(tmp_path, 3_000, 1_000), tmp_path / "run.log"
    rules = tmp_path / "rules.toml"
    rules.write_text('known = ["181", "085"]\n')
    words = ["--trigger", "085", "--trigger", str(rules), "--pre", "10", "--post", "2ms"]
    result = canmon("dump", source, "-l", str(out), *words)
    assert result.exit_code == 0, result.output
    assert numbers(tmp_path, "run-*.log") == list(range(990, 1_017))
    assert "27 frames in 1 file, 1 trigger; " in result.stderr


@pytest.mark.parametrize(("trigger", "kept"), [("emcy", 2), ("emcy and code = 0", 1), ("083", 3)])
def test_the_end_of_an_error_is_no_trigger(tmp_path: Path, trigger: str, kept: int) -> None:
    source = tmp_path / "in.log"
    codes = ("3081", "1023", "0000")
    lines = [f"({n}.000000) can0 083#{code}000000000000\n" for n, code in enumerate(codes)]
    source.write_text("".join(lines))
    words = ["-l", str(tmp_path / "run.log"), "--pre", "0", "--post", "0"]
    canmon("dump", str(source), *words, "--trigger", trigger)
    assert len(list(tmp_path.glob("run-*.log"))) == kept
    assert canmon("dump", str(source), "-F", "emcy", "-L").stdout.count("083#") == 3


def test_a_rule_that_is_written_out_is_a_trigger(tmp_path: Path) -> None:
    source, rules = tmp_path / "in.log", tmp_path / "rules.toml"
    source.write_text("(1.0) can0 703#05\n(2.0) can0 083#3081110000000000\n(3.0) can0 703#05\n")
    rules.write_text('rule = ["emcy never"]\n')
    words = ["-l", str(tmp_path / "run.log"), "--pre", "1", "--post", "0"]
    result = canmon("dump", str(source), *words, "--trigger", str(rules))
    assert "2 frames in 1 file, 1 trigger; " in result.stderr
    (part,) = tmp_path.glob("run-*.log")
    assert "# trigger: emcy never: emcy of node 3: 8130h" in part.read_text()


def test_a_filter_says_what_is_recorded_and_a_trigger_when(tmp_path: Path) -> None:
    source, out = write_run(tmp_path, 300, 100), tmp_path / "run.log"
    words = ["--trigger", "085", "-F", "181", "--pre", "3", "--post", "3"]
    assert canmon("dump", source, "-l", str(out), *words).exit_code == 0
    assert numbers(tmp_path, "run-*.log") == [96, 97, 98, 99, 101, 102, 103]


def test_the_recording_ends_at_its_limit_and_nothing_is_wrong(tmp_path: Path) -> None:
    source, out = write_run(tmp_path, 60_000), tmp_path / "run.log"
    result = canmon("dump", source, "-l", str(out), "--disk", "1M", "--at-limit", "end")
    kept = numbers(tmp_path, "run-*.log")
    assert (result.exit_code, kept) == (0, list(range(len(kept))))
    assert "; 1048576 bytes of disk space are used up; " in result.stderr


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["--rotate", "0M"], 2, "--rotate '0M' is too small: at least 64k"),
        (["--rotate", "9 elephants"], 2, "--rotate '9 elephants' is neither a size"),
        (["--disk", "0k"], 2, "--disk '0k' is too small"),
        (["--disk", "1T"], 2, "--disk '1T' is no size"),
        (["--at-limit", "end"], 2, "--at-limit goes with disk"),
        (["--trigger", "emcy and"], 2, "--trigger: filter 'emcy and', column"),
        (["--trigger", "none.toml"], 2, "--trigger none.toml: No such file"),
        (
            ["--trigger", "{folder}/wrong.toml"],
            2,
            "wrong.toml: line 1: rule 'colour' is not one of",
        ),
        (["--trigger", "{folder}/load.toml"], 2, "load.toml: a limit of the load needs"),
        (["--pre", "1 moment"], 2, "--pre '1 moment' is neither frames"),
        (["--rotate", "1M", "-l", "{folder}/no/run.log"], 3, "run.index.jsonl: No such file"),
        (["--rotate", "1M", "-l", "{folder}/run.xyz"], 2, "a log's name ends in"),
        (["--rotate", "1M", "-l", "{folder}/run.mf4"], 2, "mf4 is written as a whole"),
        (["--rotate", "1M", "-l", "{folder}/run.pcap"], 2, "pcap is read alone"),
        (["--rotate", "1M", "-l", "{folder}/run.blf.gz"], 2, "blf is compressed by itself"),
    ],
)
def test_mistakes_are_one_line(tmp_path: Path, words: list[str], status: int, said: str) -> None:
    (tmp_path / "wrong.toml").write_text('colour = "red"\n')
    (tmp_path / "load.toml").write_text("max_load = 50\n")
    source = write_run(tmp_path, 10)
    given = [word.replace("{folder}", str(tmp_path)) for word in words]
    file = [] if "-l" in words else ["-l", str(tmp_path / "run.log")]
    result = canmon("dump", source, *file, *given)
    assert (result.exit_code, said in result.stderr) == (status, True), result.output
    assert result.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.glob("run*")) == []


@pytest.mark.parametrize("option", ["--rotate", "--disk", "--trigger", "--pre", "--post"])
def test_they_go_with_a_file(tmp_path: Path, option: str) -> None:
    result = canmon("dump", write_run(tmp_path, 1), option, "1M")
    assert (result.exit_code, result.stderr) == (2, f"Error: {option} goes with -l FILE\n")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_takes_no_file_is_one_line(tmp_path: Path) -> None:
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o555)
    words = ["-l", str(folder / "run.log"), "--rotate", "1M"]
    result = canmon("dump", write_run(tmp_path, 1), *words)
    assert (result.exit_code, result.stderr.count("\n")) == (3, 1)


def test_a_file_that_cannot_grow_ends_it_and_the_rest_is_counted(tmp_path: Path) -> None:
    source, out = write_run(tmp_path, 20_000), tmp_path / "run.log"
    words = [*CANMON, "dump", source, "-l", str(out), "--rotate", "1M"]

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))

    env = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}  # else compiled modules are cut, too
    done = subprocess.run(
        words, capture_output=True, text=True, check=False, preexec_fn=limit, env=env
    )
    assert done.returncode == 3
    part = tmp_path / "run-00001.log"
    kept = numbers(tmp_path, part.name)
    summary, error = done.stderr.splitlines()
    assert error == f"Error: {part}: File too large"
    assert kept == list(range(len(kept)))
    assert summary.startswith(f"{len(kept)} frames in 1 file; ")
    assert " that came are missing; " in summary
    assert part.read_bytes().endswith(b"\n")


class Feeding:
    """A recorder that a test feeds over a pipe."""

    def __init__(self, folder: Path, *words: str) -> None:
        self._err = folder / "err"
        command = [*CANMON, "dump", "-", *words]
        with self._err.open("wb") as err:
            self.child = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=err)

    def feed(self, *lines: str) -> None:
        assert self.child.stdin is not None
        self.child.stdin.write("".join(lines).encode())
        self.child.stdin.flush()

    @property
    def said(self) -> str:
        return self._err.read_text("utf-8")

    def end(self) -> int:
        assert self.child.stdin is not None
        self.child.stdin.close()
        return self.child.wait(PATIENCE_S)


@pytest.fixture
def feeding(tmp_path: Path) -> Iterator[Callable[..., Feeding]]:
    made: list[Feeding] = []

    def make(*words: str) -> Feeding:
        made.append(Feeding(tmp_path, *words))
        return made[-1]

    yield make
    for one in made:
        one.child.kill()
        one.child.communicate()


def wait(done: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def readable(path: Path) -> int:
    count = 0
    try:
        for count, _ in enumerate(read_log(path), 1):  # noqa: B007 - counted
            pass
    except (LogError, OSError):
        return count
    return count


@pytest.mark.realtime
@pytest.mark.parametrize("name", ["run.log", "run.log.gz", "run.blf", "run.asc"])
def test_a_killed_recorder_leaves_what_it_wrote_and_the_next_says_what_is_missing(
    feeding: Callable[..., Feeding], tmp_path: Path, name: str
) -> None:
    words = ["-l", str(tmp_path / name), "--rotate", "1G"]
    recorder = feeding(*words)
    recorder.feed(*map(line, range(10_000)))
    part = tmp_path / name.replace("run", "run-00001")
    # a frame of a later second has the block of those before it written
    recorder.feed(line(100_000), line(200_000))
    wait(lambda: readable(part) >= 10_001)
    recorder.child.send_signal(signal.SIGKILL)
    recorder.child.wait()
    count = readable(part)
    again = feeding(*words)
    again.feed(line(300_000))
    assert again.end() == 0
    assert again.said.startswith(
        f"{part.name} was not ended by its recorder: {count} frames can be read, the last of "
    )
    assert "; what came behind is missing" in again.said
    assert readable(tmp_path / name.replace("run", "run-00002")) == 1


@pytest.mark.realtime
def test_a_signal_is_a_trigger(feeding: Callable[..., Feeding], tmp_path: Path) -> None:
    recorder = feeding("-l", str(tmp_path / "run.log"), "--pre", "5", "--post", "1h")
    recorder.feed(*map(line, range(1_000)))
    index = tmp_path / "run.index.jsonl"
    wait(index.exists)

    def triggered() -> bool:
        recorder.child.send_signal(signal.SIGUSR1)
        return '"ev":"trigger"' in index.read_text()

    wait(triggered)
    recorder.feed(*map(line, range(1_000, 1_010)))
    assert recorder.end() == 0
    assert numbers(tmp_path, "run-*.log") == list(range(994, 1_010))
    assert "trigger: SIGUSR1" in (tmp_path / "run-00001.log").read_text()


def test_a_signal_may_come_as_soon_as_there_is_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Signalled(LogFile):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            signal.raise_signal(signal.SIGUSR1)

    monkeypatch.setattr(dump, "LogFile", Signalled)
    words = ["-l", str(tmp_path / "run.log"), "--pre", "5", "--post", "1h"]
    before = signal.signal(signal.SIGUSR1, signal.SIG_IGN)  # a signal that came too early
    try:
        assert canmon("dump", write_run(tmp_path, 10), *words).exit_code == 0
    finally:
        signal.signal(signal.SIGUSR1, before)
    marks = index_of(tmp_path / "run.index.jsonl")
    assert [mark["text"] for mark in marks if mark["ev"] == "trigger"] == ["trigger: SIGUSR1"]


@pytest.mark.realtime
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("name", ["run.log", "run.blf"])
def test_a_recorder_that_is_interrupted_writes_its_block_whole(
    feeding: Callable[..., Feeding], tmp_path: Path, name: str, number: int
) -> None:
    recorder = feeding("-l", str(tmp_path / name), "--rotate", "1G")
    part = tmp_path / name.replace("run", "run-00001")
    recorder.feed(*map(line, range(5_000)))
    wait(part.exists)
    recorder.child.send_signal(number)
    with suppress(BrokenPipeError):
        recorder.feed(*map(line, range(5_000, 20_000)))
    assert recorder.child.wait(PATIENCE_S) == 0
    (said,) = [said for said in index_of(tmp_path / "run.index.jsonl") if said["ev"] == "file"]
    assert numbers(tmp_path, part.name) == list(range(said["frames"]))
    assert "cut" not in said


def test_nothing_is_missing_of_many_frames_and_memory_stays_small(tmp_path: Path) -> None:
    """`tools/soak-record` does so with ten million."""
    tool = Path(__file__).parents[4] / "tools" / "soak-record"
    words = ["--frames", "100000", "--rotate", "1M", "--dir", str(tmp_path)]
    done = subprocess.run(
        [sys.executable, tool, *words], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "none is missing"), done.stderr
