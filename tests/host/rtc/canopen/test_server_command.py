"""The command line of the server."""

from __future__ import annotations

import json
from pathlib import Path

import can
import pytest
from click.testing import CliRunner, Result

from tests.host.rtc.canopen.bench import EDS, SYSTEMS
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.commands.opening import add_components
from tickrig.host.rtc.canopen.commands.server import main
from tickrig.host.rtc.canopen.serve import open_server

PALETTE = f"nodes: [{{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, role: device}}]\n"


def run(file: Path, *words: str) -> Result:
    return CliRunner().invoke(main, [str(file), *words])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "robot.yaml"
    path.write_text(PALETTE, "utf-8")
    return path


def test_a_file_is_checked_without_a_bus(file: Path) -> None:
    result = run(file, "--check")
    assert (result.exit_code, result.output) == (0, f"{file}: 1 nodes, no mistake found\n")


def test_what_is_wrong_in_an_eds_and_not_used_is_said(tmp_path: Path) -> None:
    file, eds = tmp_path / "robot.yaml", tmp_path / "odd.eds"
    text = (EDS / "f-palette.eds").read_text("utf-8")
    eds.write_text(f"{text}[5000]\nParameterName=x\n", "utf-8")
    file.write_text("nodes: [{id: 16, name: A, eds: odd.eds, role: device}]\n", "utf-8")
    result = run(file, "--check")
    assert result.exit_code == 0
    line = len(text.splitlines()) + 1
    assert result.stderr.splitlines() == [
        f"{eds}:{line}: [5000] DataType is missing: DOMAIN is taken (data-type-missing)",
        f"{eds}:{line}: [5000] AccessType is missing: rw is taken (access-missing)",
    ]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"nodes: [{id: 200, name: A, eds: a.eds}]", "line 1: id: 200 is not a whole number"),
        (b"nodes: [{id: 1, name: A, eds: a.eds}]", "a.eds: No such file or directory"),
        (b"\xff", "byte 0 is not UTF-8"),
        (
            PALETTE.replace("device}", "device, ports: {tpdo9: ai}}").encode(),
            "16.tpdo9: the EDS of node 16 has no 1808h",
        ),
        (None, "No such file or directory"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(
    tmp_path: Path, content: bytes | None, reason: str
) -> None:
    path = tmp_path / "robot.yaml"
    if content is not None:
        path.write_bytes(content)
    result = run(path, "--check")
    assert result.exit_code == 2
    assert reason in result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--for", "soon"), "--for: 'soon' is not a time: write 1.5s, 200ms or 250us"),
        (("--component", "Logger0"), "--component 'Logger0' is not NAME=FILE.py:Class"),
        (("--component", "A=none.py:B"), "--component A: none.py: No such file or directory"),
        (("-i", "carrier-pigeon"), "-i 'carrier-pigeon' is not an interface of python-can"),
        (("-i", "virtual", "-c", "x", "--log", "/none/x"), "--log /none/x: No such file"),
    ],
)
def test_an_option_that_cannot_be_is_one_line(
    file: Path, words: tuple[str, ...], reason: str
) -> None:
    result = run(file, *words)
    assert result.exit_code == 2
    assert reason in result.stderr


@pytest.mark.realtime
def test_it_looks_for_its_nodes_on_the_bus_of_the_file(file: Path, tmp_path: Path) -> None:
    file.write_text(f"{PALETTE}bus: {{interface: virtual, channel: rtc}}\n", "utf-8")
    log = tmp_path / "events.jsonl"
    with can.Bus(interface="virtual", channel="rtc") as other:
        other.send(can.Message(arbitration_id=0x77F, data=[5], is_extended_id=False))
        result = run(file, "--for", "50ms", "--start", "--log", str(log))
        assert result.exit_code == 0, result.output
        heard = [other.recv(1) for _ in range(3)]
    assert [message.arbitration_id for message in heard if message] == [0x77F, 0x610, 0x000]
    assert "1 nodes on virtual rtc. Ctrl-C ends." in result.stderr
    assert all(json.loads(line)["event"] for line in log.read_text("utf-8").splitlines())


PARTS = """
from tickrig.host.rtc.canopen.robots import Joystick as Stick

class Broken(Stick):
    def on_initialize(self):
        raise OSError("no stick")
"""


def test_components_of_a_file_run_beside_the_proxies(tmp_path: Path) -> None:
    parts = tmp_path / "parts.py"
    parts.write_text(PARTS, "utf-8")
    server = open_server(SYSTEMS / "fig120.yaml")
    add_components(server, [f"Stick0={parts}:Stick", f"Stick1={parts}:Stick"])
    server.tick(20_000, ())
    server.tick(40_000, ())
    states = [server.manager.state_of(name) for name in ("Stick0", "Stick1")]
    assert states == [LifeCycleState.ACTIVE] * 2
    with pytest.raises(ValueError, match="--component Stick0: a component 'Stick0' is there"):
        add_components(server, [f"Stick0={parts}:Stick"])
    with pytest.raises(ValueError, match="--component Stick2: on_initialize of Stick2 returned"):
        add_components(server, [f"Stick2={parts}:Broken"])
