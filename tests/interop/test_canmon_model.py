"""The verbs of canmon that count and judge, on real SocketCAN."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.host.canmon.terminal import Terminal
from tests.interop.buses import Bus
from tests.interop.slave import EDS, running
from tests.interop.test_canmon import CANMON, listening, run, wait

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(not shutil.which("cangen"), reason="no cangen: apt-get install can-utils"),
]

FRAMES = 200


def log_of(folder: Path, lines: list[str]) -> str:
    path = folder / "run.log"
    path.write_text("".join(f"(1600000000.{n:06d}) vcan9 {text}\n" for n, text in enumerate(lines)))
    return str(path)


def test_top_counts_what_cangen_sends(vcan: Bus) -> None:
    top = Terminal("top", vcan.channel, "-b", "1000000")
    top.wait_for("0 identifiers")
    run("cangen", vcan.channel, "-I", "123", "-L", "8", "-n", str(FRAMES), "-g", "1")
    top.wait_for(f"{vcan.channel}: {FRAMES} frames")
    top.wait_for("123 ")
    top.child.send("q")
    assert top.end() == 0


def test_check_finds_what_canplayer_brings(vcan: Bus, tmp_path: Path) -> None:
    log = log_of(tmp_path, ["705#05"] * 20 + ["085#3081110000000000", "605#8000100002000106"])
    words = ["check", vcan.channel, "--no-emcy", "--no-sdo-abort", "--known", "705,085,605"]
    words += ["--for", "60s"]
    with listening([*CANMON, *words], tmp_path, "check") as canmon:
        run("canplayer", "-I", log, f"{vcan.channel}=vcan9")
        run("cansend", vcan.channel, "7FF#")
        wait(lambda: any(" known: " in line for line in canmon.lines))
        assert canmon.end() == 1
        rules = [line.split()[1] for line in canmon.lines]
    assert rules == ["no-emcy:", "no-sdo-abort:", "known:"]


def test_check_finds_nothing_wrong_with_our_slave(vcan: Bus, tmp_path: Path) -> None:
    words = ["check", vcan.channel, "--no-emcy", "--no-error-frames", "--nodes", "5"]
    words += ["--for", "60s"]  # of a bus it takes 5 s, in which a slow machine starts no slave
    with (
        listening([*CANMON, *words, "--known", "585-705"], tmp_path, "check") as canmon,
        running(vcan, "--eds", str(EDS), "--node-id", "5"),
    ):
        run("cansend", vcan.channel, "605#4000100000000000")
        run("cansend", vcan.channel, "7FF#")
        wait(lambda: bool(canmon.lines))  # all that came before was judged
        assert canmon.end() == 1
    assert [line.split()[1] for line in canmon.lines] == ["known:"]


def test_nodes_shows_our_slave(vcan: Bus) -> None:
    nodes = Terminal("nodes", vcan.channel)
    nodes.wait_for("no node has sent a frame")
    with running(vcan, "--eds", str(EDS), "--node-id", "5"):
        nodes.wait_for("pre-operational")
        run("cansend", vcan.channel, "000#0105")
        run("cansend", vcan.channel, "605#2B17100064000000")
        nodes.wait_for("operational ")
    nodes.child.send("q")
    assert nodes.end() == 0
