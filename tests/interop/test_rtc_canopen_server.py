"""The RTC-CANopen server in one process, its nodes in another, as users start them."""

from __future__ import annotations

import json
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from click.testing import CliRunner

from tests.interop.buses import Bus
from tests.interop.slave import Slave
from tickrig.emulators.commands.ctl_cli import ctl

pytestmark = pytest.mark.realtime

PROGRAM = (
    "from tickrig.host.rtc.canopen.commands.server import main;"
    " main(prog_name='rtc-canopen-server')"
)
EXAMPLES = Path(__file__).parents[2] / "examples"
EDS = EXAMPLES / "eds"
DEFINITION = f"""
nodes:
- {{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, role: device, heartbeat_ms: 1000}}
- {{id: 32, name: Motor0, eds: {EDS}/motor-core-unit.eds, role: device, heartbeat_ms: 2000}}
pdo_links: [{{from: 16.tpdo2, to: 32.rpdo2}}]
start: {{order: [32, 16], autoactivate: true}}
"""
HEARTBEAT = "role: device\n  heartbeat_ms: 1000"
PATIENCE_S = 60.0


class Server:
    """A running server, and the events that it tells."""

    def __init__(self, bus: Bus, file: Path, *options: str) -> None:
        words = [str(file), *bus.arguments, "--quiet", "--log", "-", *options]
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-c", PROGRAM, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._lines: queue.Queue[str] = queue.Queue()
        self.seen = list[str]()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def wait_for(self, kind: str, node: int, text: str | None = None) -> None:
        seen: list[str] = []
        while True:
            try:
                seen.append(self._lines.get(timeout=PATIENCE_S))
            except queue.Empty:
                pytest.fail(f"no {kind} of node {node} in {seen}")
            event = json.loads(seen[-1])
            self.seen.append(event["event"])
            if (event["event"], event["node"]) == (kind, node) and text in (None, event["text"]):
                return

    def end(self, number: signal.Signals = signal.SIGINT) -> int:
        if self.process.poll() is None:
            self.process.send_signal(number)
        code = self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        for stream in (self.process.stdout, self.process.stderr):
            if stream is not None:
                stream.close()
        return code

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line)


@pytest.fixture
def server(bus: Bus, nodes: Slave, tmp_path: Path) -> Iterator[Server]:
    file = tmp_path / "robot.yaml"
    file.write_text(DEFINITION, "utf-8")
    server = Server(bus, file)
    yield server
    server.end(signal.SIGKILL)


def test_nodes_are_set_up_started_lost_and_found(nodes: Slave, server: Server) -> None:
    server.wait_for("PdoLinked", 32)
    server.wait_for("StateChanged", 16, "INACTIVE to ACTIVE")
    nodes.wait_for("16/state", "Operational")
    nodes.wait_for("32/state", "Operational")
    nodes.set("16/unplugged", 1)
    server.wait_for("HeartbeatLost", 16)
    server.wait_for("ProxyRemoved", 16)
    nodes.set("16/unplugged", 0)
    server.wait_for("StateChanged", 16, "INACTIVE to ACTIVE")
    assert server.end() == 0
    nodes.wait_for("32/state", "Pre-operational")


def test_processes_that_are_stopped_for_a_moment_come_back_and_are_no_twins(
    bus: Bus, nodes: Slave, tmp_path: Path
) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(
        f"nodes: [{{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, restart: 100}}]\n"
        "start: {autoactivate: true}\n",
        "utf-8",
    )
    server = Server(bus, file)
    try:
        server.wait_for("StateChanged", 16, "INACTIVE to ACTIVE")
        nodes.process.send_signal(signal.SIGSTOP)
        server.wait_for("HeartbeatLost", 16)
        nodes.process.send_signal(signal.SIGCONT)
        server.wait_for("Restarted", 16)
        server.wait_for("StateChanged", 16, "INACTIVE to ACTIVE")
        with can.Bus(**bus.keywords) as other:
            server.process.send_signal(signal.SIGSTOP)
            heartbeats = (one for one in other if one.arbitration_id == 0x710)
            first = next(heartbeats)
            assert any(one.timestamp > first.timestamp + 0.5 for one in heartbeats)
            server.process.send_signal(signal.SIGCONT)
        server.wait_for("ServerLate", 0)
    finally:
        server.end(signal.SIGKILL)
    assert "DuplicateNode" not in server.seen


def test_the_motor_of_fig_120_follows_though_the_server_is_killed(
    bus: Bus, nodes: Slave, tmp_path: Path
) -> None:
    text = (EXAMPLES / "rtc_canopen" / "fig120.yaml").read_text("utf-8")
    text = text.replace("../eds", str(EDS)).replace("role: device", HEARTBEAT)
    (tmp_path / "fig120.yaml").write_text(text, "utf-8")
    server = Server(bus, tmp_path / "fig120.yaml")
    try:
        server.wait_for("PdoLinked", 32)
        server.wait_for("StateChanged", 16, "INACTIVE to ACTIVE")
        nodes.wait_for("16/state", "Operational")
    finally:
        server.end(signal.SIGKILL)
    nodes.set("16/ai1_v", 2.5)
    nodes.wait_for("32/0x6411:1", 16_384)
    nodes.wait_for("32/0x2001", 3)  # on, reached
    assert abs(nodes.get("32/angle_deg") - 90) < 0.1


def test_a_node_is_restarted_by_hand_over_the_control_socket(
    bus: Bus, nodes: Slave, tmp_path: Path
) -> None:
    file, socket = tmp_path / "robot.yaml", tmp_path / "robot.ctl"
    file.write_text(DEFINITION, "utf-8")
    server = Server(bus, file, "--control", str(socket))
    try:
        server.wait_for("StateChanged", 16, "INACTIVE to ACTIVE")
        nodes.set("16/unplugged", 1)
        server.wait_for("HeartbeatLost", 16)
        nodes.set("16/unplugged", 0)
        result = CliRunner().invoke(ctl, [str(socket), "restart", "16"])
        assert (result.exit_code, result.output) == (0, "")
        server.wait_for("Restarted", 16, "by hand")
        server.wait_for("StateChanged", 16, "INACTIVE to ACTIVE")
        status = CliRunner().invoke(ctl, [str(socket), "status"])
        assert "node 16 name Palette0 phase ready nmt_state " in status.output
        described = CliRunner().invoke(ctl, [str(socket), "describe"])
        components = ["Motor0 ProxyRTC ACTIVE", "Palette0 ProxyRTC ACTIVE"]
        assert sorted(described.output.splitlines()) == components
        assert CliRunner().invoke(ctl, [str(socket), "stop"]).exit_code == 0
        assert server.process.wait(PATIENCE_S) == 0
    finally:
        server.end(signal.SIGKILL)
    assert not socket.exists()
