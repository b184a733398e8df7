"""docs/howto/ros2.md: its commands are run, with a peer in another process; its table is read."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.host.rtc.engines.ros2.extra import CYCLONE
from tests.host.rtc.engines.ros2.joined import DEADLINE_S, Peer, own_domain
from tickrig.host.rtc.engines.ros2.conversions import MESSAGES
from tickrig.host.rtc.engines.ros2.table_reader import parse_table

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/howto/ros2.md").read_text("utf-8")
COMMANDS = re.findall(r"^ *\$ (.*)$", PAGE, re.MULTILINE)


def test_the_table_of_the_page_can_be_read() -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    entries = parse_table(text, "page").entries or ()
    assert [entry.topic for entry in entries] == ["cmd_vel", "odom"]
    assert entries[0].stop_after_us == 300_000


def test_every_message_stands_in_the_page() -> None:
    for name in MESSAGES:
        short = name.rpartition("/")[2]
        assert short in PAGE or short.endswith("MultiArray"), name


@CYCLONE
@pytest.mark.realtime
@pytest.mark.parametrize("line", COMMANDS)
def test_the_commands_of_the_page_tell_their_states(line: str, tmp_path: Path) -> None:
    name, *words = line.split()
    program = f"from tickrig.commands import {name}; {name}()"
    with own_domain() as domain:
        environment = {"ROS_DOMAIN_ID": str(domain), "TICKRIG_RTC": str(tmp_path / "ctl")}
        process = subprocess.Popen(
            [sys.executable, "-c", program, *words],
            cwd=ROOT,
            env={**os.environ, **environment},
            stderr=subprocess.PIPE,
        )
        peer = Peer(domain)
        try:
            peer.say("read diagnostics DiagnosticArray")
            end_s = time.monotonic() + DEADLINE_S
            while not peer.heard("diagnostics", 0.1):
                assert time.monotonic() < end_s
        finally:
            process.send_signal(signal.SIGTERM)
            _, said = process.communicate(timeout=DEADLINE_S)
            peer.end()
    assert process.returncode == 0, said
    assert b"Traceback" not in said
