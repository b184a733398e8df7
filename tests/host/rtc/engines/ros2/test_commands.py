"""`tickrig rtc run --ros2`: what it refuses, and a run with a peer in another process."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.rtc.engines.ros2.extra import CYCLONE
from tests.host.rtc.engines.ros2.joined import CHAIN, DEADLINE_S, Peer, command, own_domain
from tickrig.emulators.bench.child import running
from tickrig.emulators.commands.cli import main
from tickrig.host.rtc import engines
from tickrig.host.rtc.engines import ros2

TABLE = """
[[topic]]
port = "ConsoleIn0.out"
topic = "a"
type = "std_msgs/msg/Bool"

[[topic]]
port = "ConsoleIn0.aus"
topic = "b"
type = "std_msgs/msg/Int32"

[[topic]]
port = "Later0.out"
topic = "c"
type = "std_msgs/msg/Int32"
"""

LITE = """
[[component]]
name = "Lite0"
type = "RtcLiteProxy"
active = true
"""

EDS = Path(__file__).parents[5] / "examples" / "eds"
PALETTE = f"""
nodes: [{{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, role: device}}]
bus: {{interface: virtual, channel: ros2}}
"""
SINK = """
from tickrig.rtc import InPort, ModuleSpec, OutPort, ReturnCode, RtComponent, TimedLong

class Sink(RtComponent):
    spec = ModuleSpec("Sink")
    def __init__(self, instance_name):
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedLong))
        self.out = self.add_port(OutPort("out", TimedLong))
    def on_execute(self, ec):
        while self.in_.is_new:
            self.out.write(self.in_.read())
        return ReturnCode.RTC_OK
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    Path("chain.toml").write_text(CHAIN, "utf-8")
    Path("table.toml").write_text(TABLE, "utf-8")
    Path("latin.toml").write_bytes(b"# \xe4")
    return tmp_path


def refusal(*words: str) -> str:
    result = CliRunner().invoke(main, ["rtc", "run", "chain.toml", "--control", "ctl", *words])
    assert result.exit_code == 2
    return result.output


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("--ros2-domain 5", "--ros2-domain is for --ros2"),
        ("--ros2-table table.toml", "--ros2-table is for --ros2"),
        pytest.param(
            "--ros2 --ros2-table none.toml",
            "ros2-table none.toml: No such file or directory",
            marks=CYCLONE,
        ),
        pytest.param(
            "--ros2 --ros2-table latin.toml",
            "ros2-table latin.toml: byte 2 is no UTF-8",
            marks=CYCLONE,
        ),
    ],
)
def test_what_cannot_be_joined_is_refused_in_a_line(folder: Path, words: str, error: str) -> None:
    assert refusal(*words.split()) == f"Error: {error}\n"


@CYCLONE
def test_an_interface_that_is_not_there_is_refused(folder: Path) -> None:
    text = refusal("--ros2", "--ros2-interface", "nix0")
    assert text.startswith("Error: --ros2: interface 'nix0' does not exist here: lo")


@CYCLONE
@pytest.mark.parametrize("text", ["233", "x", "-1"])
def test_a_domain_that_is_none_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    assert refusal("--ros2") == f"Error: ROS_DOMAIN_ID {text!r} is no domain 0..232\n"


@CYCLONE
def test_ports_that_do_not_fit_are_refused_with_file_and_line(folder: Path) -> None:
    assert refusal("--ros2", "--ros2-table", "table.toml").splitlines() == [
        "Error: --ros2: table.toml:2: ConsoleIn0.out carries IDL:RTC/TimedLong:1.0:"
        " std_msgs/msg/Int32, not std_msgs/msg/Bool",
        "table.toml:7: ConsoleIn0.aus: ConsoleIn0 has no port 'aus'; known: out",
    ]


def test_without_the_extra_it_is_said_what_to_install(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engines, "ros2", ros2)  # importing it again sets it
    for name in [name for name in sys.modules if ".engines.ros2" in name]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("cyclonedds", "cyclonedds.core"):
        monkeypatch.setitem(sys.modules, name, None)
    assert refusal("--ros2") == "Error: --ros2 needs Cyclone DDS: pip install 'tickrig[ros2]'\n"


@CYCLONE
@pytest.mark.realtime
def test_a_system_and_a_peer_pass_numbers_both_ways(folder: Path) -> None:
    words = ("rtc", "run", "chain.toml", "--console", "--control", "ctl", "--ros2")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with (
        own_domain() as domain,
        command("tickrig", *words, "--ros2-domain", str(domain), **pipes) as process,
    ):
        peer = Peer(domain)
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            peer.say("read ConsoleIn0/out Int32")
            end_s = time.monotonic() + DEADLINE_S
            shown_lines = b""
            while not (peer.heard("ConsoleIn0/out", 0.05) and b"\n" in shown_lines):
                assert time.monotonic() < end_s
                process.stdin.write(b"7\n")
                peer.say("write ConsoleOut0/in Int32 -5")
                if select.select([process.stdout], [], [], 0)[0]:
                    shown_lines += os.read(process.stdout.fileno(), 1_000)
            assert peer.heard("ConsoleIn0/out")[0] == {"data": 7}
            assert shown_lines.startswith(b"ConsoleOut0 -5\n")
            shown = CliRunner().invoke(main, ["rtc", "cat", "--json", "ConsoleIn0", "--at", "ctl"])
            assert "ros2:/ConsoleIn0/out" in json.dumps(json.loads(shown.output))
        finally:
            peer.end()


@CYCLONE
@pytest.mark.realtime
def test_a_device_of_rtc_lite_has_topics_by_its_proxy(folder: Path) -> None:
    Path("lite.toml").write_text(LITE, "utf-8")
    with own_domain() as domain, running("tickrig.emulators.rtc_lite.cli") as device:
        words = ("rtc", "run", "lite.toml", "--control", "ctl", "--rate", "50", "--ros2")
        options = ("--lite", f"Lite={device.link}", "--ros2-domain", str(domain))
        with command("tickrig", *words, *options):
            peer = Peer(domain)
            try:
                peer.say("read Lite0/out Int32")
                end_s = time.monotonic() + DEADLINE_S
                while not peer.heard("Lite0/out", 0.1):
                    assert time.monotonic() < end_s
                    peer.say("write Lite0/in Int32 42")
                assert peer.heard("Lite0/out")[0] == {"data": 42}
            finally:
                peer.end()


@CYCLONE
@pytest.mark.realtime
def test_a_server_of_nodes_tells_states_and_takes_velocities(folder: Path) -> None:
    Path("robot.yaml").write_text(PALETTE, "utf-8")
    Path("sink.py").write_text(SINK, "utf-8")
    with own_domain() as domain:
        words = ("robot.yaml", "--component", "Sink0=sink.py:Sink", "--ros2", "--ros2-domain")
        with command("rtc_canopen_server", *words, str(domain)):
            peer = Peer(domain)
            try:
                peer.say("read diagnostics DiagnosticArray")
                peer.say("read Sink0/out Int32")
                end_s = time.monotonic() + DEADLINE_S
                while not (_sink_is_active(peer) and peer.heard("Sink0/out")):
                    assert time.monotonic() < end_s
                    peer.say("write Sink0/in Int32 7")
                assert peer.heard("Sink0/out")[0] == {"data": 7}
            finally:
                peer.end()


def _sink_is_active(peer: Peer) -> bool:
    """Look at the latest states."""
    arrays = peer.heard("diagnostics", 0.1)
    statuses = [(each["name"], each["message"]) for each in arrays[-1]["status"]] if arrays else []
    return ("Sink0", "Active") in statuses
