"""The command `tkernel-emu` in real time, with a reader, a range finder and a service."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.ucode.bench import DOOR
from tickrig.emulators.bench.child import Child, running
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.tkernel.commands.node_cli import main as tkernel_emu
from tickrig.emulators.tkernel.ucode_table import EXAMPLE

DEADLINE_S = 60.0
NODE = "tickrig.emulators.tkernel.commands.node_cli"


def run(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(tickrig, [str(word) for word in words])
    return result.exit_code, result.output


def until(done: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while not done():
        assert time.monotonic() < deadline_s


@pytest.fixture
def node(tmp_path: Path) -> Iterator[tuple[Child, Path]]:
    """A node with both applications, and the control socket of its board."""
    table, board = tmp_path / "places.toml", tmp_path / "board"
    table.write_text(EXAMPLE)
    with ExitStack() as stack:
        urg = stack.enter_context(running("tickrig.emulators.urg.cli", "--room", "4,3"))
        marker = ("--marker", f"{DOOR},1,0")
        reader = stack.enter_context(running("tickrig.emulators.tkernel.reader.cli", *marker))
        resolver = "tickrig.emulators.tkernel.commands.resolver_cli"
        service = stack.enter_context(running(resolver, str(table), "--port", "0", linked=False))
        url = service.log.read_text().split("\n")[0]
        words = ["--urg", str(urg.link), "--ucode", str(reader.link), "--service", url]
        words += ["--board", str(board), "--boot", "200ms", "--connectors", "3"]
        yield stack.enter_context(running(NODE, *words, linked=False)), board


@pytest.mark.realtime
def test_it_finds_its_place_and_its_surroundings(node: tuple[Child, Path]) -> None:
    child, board = node
    at = ("--at", child.control)
    code, listed = run("rtc", "ls", "-l", *at)
    assert (code, listed.count("100Hz")) == (0, 4)
    code, places = run("rtc", "print", "ContentsInterpretation0.position", "-n", 1, *at)
    assert '{"x": 1.0, "y": 0.0}' in places
    code, ranges = run("rtc", "print", "LRFCapture_URG0.ranges", "-n", 1, "--json", *at)
    assert (code, '"ranges"' in ranges) == (0, True)
    code, refused = run("rtc", "create", "ConsoleIn", "--rate", 1_000, *at)
    assert code == 2
    assert "its period of 1 ms is no multiple of the cyclic handler's 10 ms" in refused
    run("rtc", "create", "UcodeSettlement", "Other0", "--rate", 10, *at)
    con = ("rtc", "con", "InfraredRaysReader0.ucodes", "Other0.ucodes", *at)
    assert run(*con)[0] == 0
    code, refused = run("rtc", "con", "Other0.addresses", "ContentsInterpretation0.addresses", *at)
    assert (code, "3 connectors are all that this node has" in refused) == (2, True)
    assert "refused_connectors 1" in run("ctl", board, "get")[1]
    child.process.send_signal(signal.SIGINT)
    assert child.process.wait(DEADLINE_S) == 0
    told = child.log.read_text()
    assert "refused, a limit of the node: ConsoleIn0: its period of 1 ms" in told
    assert "boots: 1; refused by a limit: 2; late ticks: " in told
    assert "Traceback" not in told


@pytest.mark.realtime
def test_it_loses_all_with_its_supply_and_boots_again(node: tuple[Child, Path]) -> None:
    child, board = node
    run("rtc", "create", "ConsoleIn", "--rate", 10, "--at", child.control)
    assert "components 5" in run("ctl", board, "get", "components")[1]
    assert run("ctl", board, "fault", "power_cut")[0] == 0
    until(lambda: not child.control.exists())
    code, told = run("rtc", "ls", "--at", child.control)
    assert (code, "No such file or directory" in told) == (2, True)
    assert run("ctl", board, "clear", "power_cut")[0] == 0
    until(child.control.exists)
    assert "components 4" in run("ctl", board, "get", "components")[1]
    code, places = run(
        "rtc", "print", "ContentsInterpretation0.position", "-n", 1, "--at", child.control
    )
    assert '{"x": 1.0, "y": 0.0}' in places
    assert "late_ticks" in run("ctl", board, "status")[1]


def test_mistakes_are_one_line(tmp_path: Path) -> None:
    system = tmp_path / "fast.toml"
    system.write_text('[[component]]\nname = "A0"\ntype = "ConsoleIn"\nrate_hz = 1000\n')
    for words, told in {
        ("--connectors", "0"): "connectors 0 is not in 1..1000",
        ("--boot", "soon"): "--boot: 'soon' is not a time",
        ("--tick", "1us"): "tick_us 1 is not in 1000..1000000",
        ("--fault", "fire"): "--fault: no fault 'fire'",
        ("/nowhere.toml",): "system /nowhere.toml: No such file",
        ("--openrtm", ":"): "--openrtm: ':' is not HOST:PORT",
    }.items():
        result = CliRunner().invoke(tkernel_emu, list(words))
        assert result.exit_code == 2
        assert told in result.stderr
        assert result.stderr.count("\n") == 1


@pytest.mark.realtime
def test_a_system_beyond_its_limits_is_refused_at_boot(tmp_path: Path) -> None:
    system = tmp_path / "fast.toml"
    system.write_text('[[component]]\nname = "A0"\ntype = "ConsoleIn"\nrate_hz = 1000\n')
    program = f"from {NODE} import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program, str(system), "--boot", "0s"],
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )
    assert done.returncode == 2
    last = done.stderr.splitlines()[-1]
    assert last.startswith("Error: the node cannot have this system: A0: its period of 1 ms")
    assert "Traceback" not in done.stderr


@pytest.mark.realtime
@OMNIORB
def test_its_components_are_in_the_context_tkernel_of_a_name_server(tmp_path: Path) -> None:
    from tests.host.rtc.engines.openrtm.live_system import live_system  # noqa: PLC0415 - an extra

    words = ("--boot", "100ms", "--connectors", "1", str(chain(tmp_path)))
    with live_system(tmp_path, *words, command="tkernel-emu") as node:
        where = f"/{node.names.address}/tkernel.host_cxt"
        until(lambda: "ConsoleOut0.rtc" in node.tool("rtls", where)[1])
        code, told, _ = node.tool("rtact", f"{where}/ConsoleIn0.rtc")
        assert (code, told) == (0, "")
        assert "Active" in node.tool("rtls", "-l", f"{where}/ConsoleIn0.rtc")[1]
        ends = [f"{where}/{end}" for end in ("ConsoleIn0.rtc:out", "ConsoleOut0.rtc:in")]
        assert node.tool("rtcon", *ends)[0] == 0
        other = f"{where}/ConsoleOut1.rtc:in"
        assert node.tool("rtcon", ends[0], other)[0] != 0
        code, said = node.end(signal.SIGINT)
        assert (code, "Traceback" not in said) == (0, True)
    assert "The node is up: ConsoleIn0, ConsoleOut0, ConsoleOut1." in said
    assert "1 connectors are all that this node has" in said


def chain(folder: Path) -> Path:
    """Write a system that fits on the node."""
    system, names = folder / "chain.toml", ("ConsoleIn0", "ConsoleOut0", "ConsoleOut1")
    rows = (
        f'[[component]]\nname = "{name}"\ntype = "{name[:-1]}"\nrate_hz = 100\n' for name in names
    )
    system.write_text("".join(rows))
    return system
