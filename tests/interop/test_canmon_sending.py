"""The verbs of canmon that send, on real SocketCAN."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.interop.buses import Bus
from tests.interop.slave import EDS, running
from tests.interop.test_can_utils import candump
from tickrig.host.canmon.cli import main

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(not shutil.which("candump"), reason="no candump: apt-get install can-utils"),
]

START = """
[[step]]
send = "605#4000100000000000"
[[step]]
expect = "node=5 and device_type=0xF0191"
[[step]] # 1017h: a heartbeat each 100 ms
send = "605#2B17100064000000"
[[step]]
expect = "585#60171000*"
[[step]]
send = "000#0105"
[[step]]
expect = "705#05"
within = "5s"
"""


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words, catch_exceptions=False)


def test_candump_sees_what_canmon_sends(vcan: Bus, tmp_path: Path) -> None:
    with candump(vcan, tmp_path) as dump:
        result = canmon("send", vcan.channel, "123#DEADBEEF", "00000605#40", "705#R")
        assert result.exit_code == 0, result.output
        dump.wait_for("705#R")
        assert dump.frames == ["123#DEADBEEF", "00000605#40", "705#R"]


def test_candump_sees_a_frame_again_and_again(vcan: Bus, tmp_path: Path) -> None:
    words = ("--every", "1ms", "--count", "50", "--counter", "0:1..50")
    with candump(vcan, tmp_path) as dump:
        canmon("send", vcan.channel, "080#00", *words)
        dump.wait_for("080#32")
        assert dump.frames == [f"080#{n:02X}" for n in range(1, 51)]


def test_a_sequence_starts_our_slave(vcan: Bus, tmp_path: Path) -> None:
    path = tmp_path / "start.toml"
    path.write_text(START)
    with running(vcan, "--eds", str(EDS), "--node-id", "5"):
        result = canmon("seq", vcan.channel, str(path), "--eds", f"5={EDS}")
    assert result.exit_code == 0, result.output


def test_candump_sees_a_log_of_its_own_again(vcan: Bus, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    lines = [f"(1600000000.{n:03d}000) vcan9 {0x181 + n % 50:03X}#{n:08X}\n" for n in range(200)]
    log.write_text("".join(lines))
    with candump(vcan, tmp_path) as dump:
        result = canmon("play", str(log), f"{vcan.channel}=vcan9")
        assert result.exit_code == 0, result.output
        dump.wait_for("1B2#000000C7")
        assert dump.frames == [line.split()[-1] for line in lines]
