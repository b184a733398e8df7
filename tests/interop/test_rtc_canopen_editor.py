"""The System Editor in a terminal, its nodes in another process, as users start them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.terminal import Terminal
from tests.interop.buses import Bus
from tests.interop.slave import Slave

pytestmark = pytest.mark.realtime

PROGRAM = "from tickrig.host.rtc.canopen.commands.editor import main; main()"
EDS = Path(__file__).parents[2] / "examples" / "eds"
DEFINITION = f"""
nodes:
- {{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, role: device, heartbeat_ms: 1000}}
- {{id: 32, name: Motor0, eds: {EDS}/motor-core-unit.eds, role: device, heartbeat_ms: 1000}}
"""


def test_nodes_are_activated_linked_read_and_left(bus: Bus, nodes: Slave, tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(DEFINITION, "utf-8")
    terminal = Terminal(
        str(file), *bus.arguments, "--log", str(tmp_path / "log"), program=PROGRAM, lines=40
    )
    terminal.wait_for("2 of 2 nodes ready")
    terminal.child.send("S")
    terminal.wait_for("2 active")
    nodes.wait_for("32/state", "Operational")
    terminal.wait_for("device_type")
    terminal.wait_for("459153")  # 0007 0191h
    terminal.child.send("q")
    assert terminal.end() == 0
    nodes.wait_for("32/state", "Pre-operational")
    assert "ProxyMade" in (tmp_path / "log").read_text("utf-8")


def test_a_signal_ends_it_and_leaves_the_nodes(bus: Bus, nodes: Slave, tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(DEFINITION, "utf-8")
    terminal = Terminal(str(file), *bus.arguments, "--start", program=PROGRAM, lines=40)
    terminal.wait_for("2 active")
    terminal.child.kill(15)
    assert terminal.end() == 0
    nodes.wait_for("16/state", "Pre-operational")
