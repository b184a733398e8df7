"""canmon on real SocketCAN, fed by the can-utils and by our slaves."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.interop.buses import Bus
from tests.interop.slave import EDS, running
from tickrig.host.canmon.model.logs.log_reader import read_log

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(not shutil.which("cangen"), reason="no cangen: apt-get install can-utils"),
]

CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")
PATIENCE_S = 20.0
BURST = 20_000


class Listener:
    """A program that listens on a bus, and what it has said."""

    def __init__(self, words: list[str], folder: Path, name: str) -> None:
        self._out, self._err = folder / f"{name}.out", folder / f"{name}.err"
        self._before = listeners()
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(words, stdout=out, stderr=err)
        try:
            wait(lambda: listeners() > self._before or self.process.poll() is not None)
            assert self.process.poll() is None, self.said
        except BaseException:
            self.process.kill()
            self.process.wait()
            raise

    @property
    def lines(self) -> list[str]:
        return self._out.read_text("ascii").splitlines()

    @property
    def said(self) -> str:
        return self._err.read_text("utf-8")

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(PATIENCE_S)


def listeners() -> int:
    """The kernel lists who reads all of a bus."""
    return len(re.findall(r"^ +vcan", Path("/proc/net/can/rcvlist_all").read_text(), re.MULTILINE))


def wait(done: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@contextmanager
def listening(words: list[str], folder: Path, name: str) -> Iterator[Listener]:
    listener = Listener(words, folder, name)
    try:
        yield listener
    finally:
        listener.process.kill()
        listener.process.wait()


def run(*words: str) -> None:
    subprocess.run(words, check=True, timeout=PATIENCE_S)


def test_its_lines_are_those_of_candump(vcan: Bus, tmp_path: Path) -> None:
    for options in ("-t a", "-x -t a", "-L"):
        theirs = ["candump", *options.split(), vcan.channel]
        ours = [*CANMON, "dump", *options.split(), vcan.channel, *raw(options)]
        with (
            listening(theirs, tmp_path, "theirs") as candump,
            listening(ours, tmp_path, "ours") as canmon,
        ):
            for words in (["-I", "i"], ["-e"], ["-R"], ["-e", "-R"], ["-L", "0"], ["-L", "8"]):
                run("cangen", vcan.channel, "-n", "20", "-g", "1", *words)
            wait(lambda: len(candump.lines) == len(canmon.lines) == 120)
            lines = canmon.lines
            assert [without_tx(line) for line in candump.lines] == lines


def raw(options: str) -> list[str]:
    """`-L` writes only bytes, and refuses the option."""
    return [] if options == "-L" else ["--raw"]


def without_tx(line: str) -> str:
    """Other programs on this machine sent it, not candump: TX and T are ours alone."""
    return line.replace("  TX ", "  RX ").removesuffix(" T")


@pytest.mark.parametrize("form", ["-L", "-l"])
def test_nothing_of_a_burst_is_lost_uncounted(vcan: Bus, form: str, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    words = [*CANMON, "dump", vcan.channel, *([form, str(log)] if form == "-l" else [form])]
    with listening(words, tmp_path, "dump") as canmon:
        run("cangen", vcan.channel, "-g", "0", "-n", str(BURST), "-I", "123", "-L", "8", "-D", "i")
        run("cansend", vcan.channel, "7FF#")
        wait(lambda: any(line.endswith("7FF#") for line in shown(canmon, log)))
        assert canmon.end() == 0
        came = len(shown(canmon, log)) - 1
        lost = sum(int(count) for count in re.findall(r"([0-9]+) frames", canmon.said))
    assert came + lost == BURST
    assert came > 0


def shown(canmon: Listener, log: Path) -> list[str]:
    lines = log.read_text("ascii").splitlines() if log.exists() else canmon.lines
    return [line for line in lines if not line.startswith("#")]  # a mark of what was lost


def test_a_reader_that_is_stopped_counts_what_the_kernel_dropped(vcan: Bus, tmp_path: Path) -> None:
    words = [*CANMON, "dump", vcan.channel, "--jsonl", "--strict"]
    with listening(words, tmp_path, "dump") as canmon:
        canmon.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, canmon.process.pid, os.WSTOPPED)
        run("cangen", vcan.channel, "-g", "0", "-n", str(BURST), "-I", "123", "-L", "8")
        canmon.process.send_signal(signal.SIGCONT)
        wait(lambda: bool(canmon.lines))
        run("cansend", vcan.channel, "7FF#")
        wait(lambda: any('"id":2047' in line for line in canmon.lines))
        assert canmon.end() == 4
        drops = [int(n) for n in re.findall(r'"ev":"drop","n":([0-9]+)', "\n".join(canmon.lines))]
        came = sum('"id":291' in line for line in canmon.lines)
    assert came + sum(drops) == BURST
    assert sum(drops) > 0


@pytest.mark.parametrize("options", ["-t a", "-x -t a", "-L"])
def test_can_fd_frames_are_those_of_candump(vcan: Bus, options: str, tmp_path: Path) -> None:
    theirs = ["candump", *options.split(), vcan.channel]
    ours = [*CANMON, "dump", *options.split(), vcan.channel, *raw(options)]
    with (
        listening(theirs, tmp_path, "theirs") as candump,
        listening(ours, tmp_path, "ours") as canmon,
    ):
        run("cansend", vcan.channel, "123##3AA")
        for words in (["-f"], ["-f", "-b"], ["-m", "-f"], ["-f", "-b", "-e", "-L", "64"]):
            run("cangen", vcan.channel, "-n", "20", "-g", "1", *words)
        wait(lambda: len(candump.lines) == len(canmon.lines) == 81)
        lines = canmon.lines
    assert [without_fdf(without_tx(line)) for line in candump.lines] == lines


def test_candump_hears_the_can_fd_that_we_send_and_play(vcan: Bus, tmp_path: Path) -> None:
    frames = ["123##1AABB", "00000123##3" + "5A" * 64, "7FF##0", "123#AABB"]
    log = tmp_path / "run.log"
    log.write_text("".join(f"(1.{n:06d}) can0 {frame}\n" for n, frame in enumerate(frames)))
    with listening(["candump", "-L", vcan.channel], tmp_path, "theirs") as candump:
        run(*CANMON, "send", vcan.channel, *frames)
        run(*CANMON, "play", str(log), vcan.channel)
        wait(lambda: len(candump.lines) == 2 * len(frames))
        lines = [without_fdf(without_tx(line)) for line in candump.lines]
    assert [line.split()[-1] for line in lines] == frames * 2


def without_fdf(line: str) -> str:
    """The flag that a frame is of CAN FD, which newer kernels set, says no more than its ##."""
    return re.sub("##([4-7])", lambda found: f"##{int(found[1]) & 3}", line)


def test_what_our_slave_says_is_decoded(vcan: Bus, tmp_path: Path) -> None:
    words = [*CANMON, "dump", vcan.channel, "--eds", f"5={EDS}", "-F", "sdo"]
    with (
        listening(words, tmp_path, "dump") as canmon,
        running(vcan, "--eds", str(EDS), "--node-id", "5"),
    ):
        run("cansend", vcan.channel, "605#4000100000000000")
        wait(lambda: len(canmon.lines) == 2)
        assert "5 sdo upload 1000h:00" in canmon.lines[1]
        canmon.end()


def test_a_bus_that_goes_down_ends_it_with_status_3(vcan: Bus, tmp_path: Path) -> None:
    if subprocess.run(
        ["ip", "link", "add", "dev", "vcan9", "type", "vcan"], check=False
    ).returncode:
        pytest.skip("only root makes buses")
    run("ip", "link", "set", "vcan9", "up")
    with listening([*CANMON, "dump", "vcan9"], tmp_path, "dump") as canmon:
        run("ip", "link", "set", "vcan9", "down")
        status = canmon.process.wait(PATIENCE_S)
        said = canmon.said
    run("ip", "link", "delete", "vcan9")
    assert (status, said) == (3, "Error: vcan9: Network is down\n")


@pytest.mark.parametrize("verb", ["dump", "top", "check"])
def test_a_bus_that_was_removed_and_made_again_is_opened_again(
    vcan: Bus, verb: str, tmp_path: Path
) -> None:
    add = ["ip", "link", "add", "dev", "vcan9", "type", "vcan"]
    if subprocess.run(add, check=False).returncode:
        pytest.skip("only root makes buses")
    words = {"dump": ["-L"], "top": ["--for", "600s"], "check": ["--no-loss", "--for", "600s"]}
    run("ip", "link", "set", "vcan9", "up")
    with listening([*CANMON, verb, "vcan9", *words[verb], "--reopen"], tmp_path, verb) as canmon:
        run("cansend", "vcan9", "701#00")
        run("ip", "link", "set", "vcan9", "down")
        wait(lambda: "vcan9 is gone: Network is down" in canmon.said)
        run("ip", "link", "delete", "vcan9")
        run(*add)
        run("ip", "link", "set", "vcan9", "up")
        wait(lambda: "vcan9 is back after" in canmon.said)
        run("cansend", "vcan9", "702#00")
        if verb == "dump":
            wait(lambda: any(line.endswith("702#00") for line in canmon.lines))
            assert canmon.lines[0].endswith("701#00")
        assert canmon.end() == (1 if verb == "check" else 0)
        assert "vcan9: it was away once, " in canmon.said + "".join(canmon.lines)
    run("ip", "link", "delete", "vcan9")


def test_a_recorder_goes_on_when_its_bus_is_back(vcan: Bus, tmp_path: Path) -> None:
    add = ["ip", "link", "add", "dev", "vcan9", "type", "vcan"]
    if subprocess.run(add, check=False).returncode:
        pytest.skip("only root makes buses")
    run("ip", "link", "set", "vcan9", "up")
    words = ["dump", "vcan9", "-l", str(tmp_path / "run.log"), "--rotate", "1M", "--strict"]
    part = tmp_path / "run-00001.log"
    with listening([*CANMON, *words], tmp_path, "dump") as canmon:
        run("cangen", "vcan9", "-g", "0", "-n", "500", "-I", "123", "-L", "8", "-D", "i")
        wait(lambda: part.exists() and part.read_text("ascii").count(" 123#") == 500)
        run("ip", "link", "delete", "vcan9")
        wait(lambda: "# vcan9 is gone: " in part.read_text("ascii"))
        run(*add)
        run("ip", "link", "set", "vcan9", "up")
        wait(lambda: "# vcan9 is back after " in part.read_text("ascii"))
        run("cansend", "vcan9", "7FF#")
        wait(lambda: part.read_text("ascii").endswith(" 7FF#\n"))
        assert canmon.end() == 4
        assert canmon.said.endswith("Error: a bus was away 1 time\n")
    run("ip", "link", "delete", "vcan9")
    assert len(list(read_log(part))) == 501
    index = (tmp_path / "run.index.jsonl").read_text("ascii")
    assert re.findall(r'"ev":"(\w+)"', index) == ["open", "gone", "back", "file", "end"]


def test_candump_reads_what_it_logs(vcan: Bus, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    with listening([*CANMON, "dump", vcan.channel, "-l", str(log)], tmp_path, "dump") as canmon:
        run("cangen", vcan.channel, "-n", "50", "-g", "1")
        wait(lambda: len(shown(canmon, log)) == 50)
        canmon.end()
    lines = log.read_text("ascii").splitlines(keepends=True)
    log.write_text("".join([*lines[:10], "# 12 frames were lost\n", *lines[10:]]), "ascii")
    with listening(["candump", "-L", vcan.channel], tmp_path, "candump") as candump:
        run("canplayer", "-I", str(log))
        wait(lambda: len(candump.lines) == 50)
        frames = [line.split()[2] for line in candump.lines]
    assert frames == [str(record.frame) for record in read_log(log)]
