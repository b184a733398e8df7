"""`tickrig rtc run`: what it refuses, and a whole run in a process of its own."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from tickrig.emulators.bench.child import running
from tickrig.emulators.commands.cli import main
from tickrig.host.control.client import ControlClient
from tickrig.host.rtc import Manager
from tickrig.host.rtc.commands.request import default_path
from tickrig.host.rtc.motion.chain import CONNECTIONS, MotionChain
from tickrig.host.rtc.system.manager import COMPONENT_TYPES
from tickrig.host.rtc.system.system_file import parse_toml

EXAMPLE = Path(__file__).parents[4] / "examples" / "rtc_chain.toml"

CHAIN = """
[[component]]
name = "ConsoleIn0"
type = "ConsoleIn"
rate_hz = 100.0
active = true

[[component]]
name = "ConsoleOut0"
type = "ConsoleOut"
rate_hz = 100.0
active = true

[[connection]]
ports = ["ConsoleIn0.out", "ConsoleOut0.in"]
"""

TWICE = """
from tickrig.host.rtc import InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types.rtc import TimedLong

class Twice(RtComponent):
    spec = ModuleSpec("Twice")
    def __init__(self, instance_name):
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedLong))
        self.out = self.add_port(OutPort("out", TimedLong))
    def on_execute(self, ec):
        while self.in_.is_new:
            value = self.in_.read()
            self.out.write(TimedLong(value.tm, 2 * value.data))
        return ReturnCode.RTC_OK

class Broken(RtComponent):
    spec = ModuleSpec("Broken")
    def __init__(self, instance_name):
        raise KeyError("pin")

class Bare(RtComponent):
    pass
"""

BETWEEN = """
[[component]]
name = "{name}0"
type = "{kind}"
rate_hz = 100.0
active = true

[[connection]]
ports = ["ConsoleIn0.out", "{name}0.in"]

[[connection]]
ports = ["{name}0.out", "ConsoleOut0.in"]
"""

DEADLINE_S = 20.0


def chain_through(name: str, kind: str) -> str:
    return CHAIN.partition("[[connection]]")[0] + BETWEEN.format(name=name, kind=kind)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the present folder, with some files."""
    monkeypatch.chdir(tmp_path)
    Path("chain.toml").write_text(CHAIN, "utf-8")
    Path("twice.toml").write_text(chain_through("Twice", "Twice"), "utf-8")
    Path("twice.py").write_text(TWICE, "utf-8")
    Path("bad.toml").write_text("[[component]]\nname = 'x'\n", "utf-8")
    Path("bad.xml").write_text("<a/>", "utf-8")
    Path("latin.toml").write_bytes(b"# \xe4")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("--save none/a.toml", "system none/a.toml: no directory none"),
        ("--save /proc/a.toml", "system /proc/a.toml: No such file or directory"),
        ("none.toml", "system none.toml: No such file or directory"),
        ("twice.py", "system twice.py: the name ends in .toml or .xml"),
        ("bad.toml", "system bad.toml: line 1: component[1]: no key 'type': its type, a text"),
        ("bad.xml", "system bad.xml: a is not an RTSProfile"),
        ("latin.toml", "system latin.toml: byte 2 is not UTF-8"),
        ("twice.toml", "system twice.toml: no component type 'Twice'; known: ConsoleIn, "),
        ("chain.toml --save x.yaml", "system x.yaml: the name ends in .toml or .xml"),
        ("chain.toml --component x", "--component x: 'x' is not FILE.py:Class"),
        ("chain.toml --component no.py:A", "--component no.py:A: no.py: No such file or directory"),
        (
            "chain.toml --component twice.py:A",
            "--component twice.py:A: twice.py has no component 'A'; it has Twice, Broken, Bare",
        ),
        (
            "chain.toml --component twice.py:Broken",
            "--component twice.py:Broken: line 20: KeyError: 'pin'",
        ),
        ("chain.toml --component twice.py:Bare", "has no attribute 'spec'"),
        ("chain.toml --control no/dir/ctl", "control no/dir/ctl: No such file or directory"),
        ("chain.toml --lite x", "--lite 'x' is not NAME=URL[@BAUD][,rtno][,boot=TIME], as LiteA"),
        ("chain.toml --lite A=tty,rtn", "A=tty,rtn: no option 'rtn'; did you mean 'rtno'?"),
        ("chain.toml --lite A=tty,boot=x", "--lite A=tty,boot=x: 'x' is not a time"),
        ("chain.toml --lite A=no/tty", "--lite A=no/tty: cannot open 'no/tty'"),
        ("chain.toml --lite-boot x", "--lite-boot: 'x' is not a time: write 1.5s, 200ms or 250us"),
    ],
)
def test_what_cannot_be_run_is_refused_in_a_line(folder: Path, words: str, error: str) -> None:
    result = CliRunner().invoke(main, ["rtc", "run", *words.split()])
    assert result.exit_code == 2
    assert error in result.output
    assert len(result.output.splitlines()) == 1


def test_where_a_system_runs_already_a_second_one_is_refused(folder: Path) -> None:
    with socket.socket(socket.AF_UNIX) as first:
        first.bind("ctl")
        first.listen()
        result = CliRunner().invoke(main, ["rtc", "run", "chain.toml", "--control", "ctl"])
    assert (result.exit_code, result.output) == (
        2,
        "Error: control ctl: another process listens there\n",
    )


def test_without_a_word_a_system_is_in_a_folder_of_its_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert default_path() == tmp_path / "tickrig-rtc"
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    assert default_path().name.startswith("tickrig-rtc-")


class Run:
    """`tickrig rtc run` in a process of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.path = folder / "ctl"
        program = "from tickrig.emulators.commands.cli import main; main()"
        words = ["rtc", "run", "--control", str(self.path), "--console", *options]
        self.process = subprocess.Popen(
            [sys.executable, "-c", program, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            bufsize=1,
        )

    def rtc(self, *words: str) -> str:
        result = CliRunner().invoke(main, ["rtc", *words, "--at", str(self.path)])
        assert result.exit_code == 0, result.output
        return result.output

    def type(self, *numbers: int) -> None:
        assert self.process.stdin is not None
        self.process.stdin.writelines(f"{number}\n" for number in numbers)

    def lines(self, count: int) -> list[str]:
        """Return so many lines that it prints."""
        assert self.process.stdout is not None
        return [self.process.stdout.readline().rstrip() for _ in range(count)]

    def end(self, number: int) -> str:
        """Send a signal, and return what was told to people."""
        self.process.send_signal(number)
        _, told = self.process.communicate(timeout=DEADLINE_S)
        assert self.process.returncode == 0
        return told


def await_(done: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while not done():
        assert time.monotonic() < deadline_s
        time.sleep(0.01)


@contextmanager
def run(folder: Path, *options: str) -> Iterator[Run]:
    child = Run(folder, *options)
    try:
        await_(lambda: child.path.exists() or child.process.poll() is not None)
        yield child
    finally:
        child.process.kill()
        child.process.communicate()


@pytest.mark.realtime
def test_a_system_runs_with_a_users_component_and_is_saved(folder: Path) -> None:
    options = ["twice.toml", "--component", "twice.py:Twice", "--save", "after.toml"]
    with run(folder, *options) as child:
        assert child.rtc("ls").split() == ["ConsoleIn0", "ConsoleOut0", "Twice0"]
        child.type(1, -5, 1_073_741_823)
        assert child.lines(3) == [f"ConsoleOut0 {number}" for number in (2, -10, 2_147_483_646)]
        child.rtc("inject", "ConsoleOut0.in", "7")
        assert child.lines(1) == ["ConsoleOut0 7"]
        child.rtc("deact", "Twice0")
        child.rtc("dis", "Twice0.out", "ConsoleOut0.in")
        assert json.loads(child.rtc("status", "--json"))["now_us"] > 0
        told = child.end(signal.SIGINT)
    assert "Traceback" not in told
    assert "ran " in told
    assert not child.path.exists()
    system = parse_toml((folder / "after.toml").read_text("utf-8"))
    assert [(entry.name, entry.active) for entry in system.components] == [
        ("ConsoleIn0", True),
        ("ConsoleOut0", True),
        ("Twice0", False),
    ]
    assert [connection.ports for connection in system.connections] == [
        ("ConsoleIn0.out", "Twice0.in")
    ]


@pytest.mark.realtime
def test_the_example_runs_and_print_ends_with_ctrl_c(folder: Path) -> None:
    with run(folder, str(EXAMPLE)) as child:
        child.type(5)
        assert child.lines(1) == ["ConsoleOut0 5"]
        program = "from tickrig.emulators.commands.cli import main; main()"
        words = ["rtc", "print", "ConsoleIn0.out", "--at", str(child.path)]
        printing = subprocess.Popen(
            [sys.executable, "-c", program, *words], stdout=subprocess.PIPE, text=True
        )
        await_(lambda: "print" in child.rtc("cat", "ConsoleIn0"))
        child.type(6)
        assert printing.stdout is not None
        assert printing.stdout.readline().endswith(" 6\n")
        printing.send_signal(signal.SIGINT)
        rest, _ = printing.communicate(timeout=DEADLINE_S)
        assert (printing.returncode, rest) == (0, "")
        assert "ran " in child.end(signal.SIGHUP)


@pytest.mark.realtime
def test_a_device_takes_part_by_its_proxy_and_is_not_left_active(folder: Path) -> None:
    Path("lite.toml").write_text(chain_through("Lite", "RtcLiteProxy"), "utf-8")
    with running("tickrig.emulators.rtc_lite.cli") as device, ControlClient(device.control) as hand:
        with run(folder, "lite.toml", "--rate", "50", "--lite", f"Lite={device.link}") as child:
            child.type(42)
            assert child.lines(1) == ["ConsoleOut0 42"]
            assert hand.request("get", names=["state"])["values"] == {"state": "Active"}
            child.end(signal.SIGTERM)
        assert hand.request("get", names=["state"])["values"] == {"state": "Inactive"}


@pytest.mark.realtime
def test_a_board_with_rtno_and_a_device_of_rtc_lite_take_part_side_by_side(folder: Path) -> None:
    Path("lite.toml").write_text(chain_through("Lite", "RtcLiteProxy"), "utf-8")
    lite, board = running("tickrig.emulators.rtc_lite.cli"), "tickrig.emulators.rtc_lite.cli"
    with lite as other, running(board, "--framing", "rtno") as device:
        lines = [f"Lite={device.link},rtno,boot=10ms", f"Other={other.link}"]
        words = [word for line in lines for word in ("--lite", line)]
        with run(folder, "lite.toml", "--rate", "50", *words) as child:
            child.type(42)
            assert child.lines(1) == ["ConsoleOut0 42"]


CART = Path(__file__).parents[4] / "examples" / "rh3_cart.toml"


def test_help_names_types_and_says_how_to_list_all() -> None:
    told = " ".join(CliRunner().invoke(main, ["rtc", "run", "--help"]).output.split())
    types = told.partition("Types: ")[2].partition(" and others")[0].split(", ")
    assert set(types) < set(COMPONENT_TYPES.built_in)
    chain = [component.spec.type_name for component in MotionChain(Manager()).components]
    assert {"ConsoleIn", "ConsoleOut", *chain} <= set(types)
    assert "an unknown type is refused with a list of all" in told


def test_the_cart_of_the_example_is_joined_as_the_motion_chain() -> None:
    system = parse_toml(CART.read_text("utf-8"))
    assert [entry.name for entry in system.components] == [
        component.instance_name for component in MotionChain(Manager()).components
    ]
    joined = [tuple(name.replace(".", "0.") for name in pair) for pair in CONNECTIONS]
    assert [tuple(entry.ports) for entry in system.connections] == joined


@pytest.mark.realtime
def test_a_cart_of_our_types_drives_an_emulated_base_as_it_is_told_at_the_console(
    tmp_path: Path,
) -> None:
    with running("tickrig.emulators.rh3.cli") as base:
        file = tmp_path / "cart.toml"
        file.write_text(CART.read_text("utf-8").replace("/tmp/rh3", str(base.link)))
        command = [sys.executable, "-m", "tickrig", "rtc", "run", str(file), "--console"]
        process = subprocess.Popen(
            [*command, "--control", str(tmp_path / "ctl")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write("goal 0.1 0 0\n")
            process.stdin.flush()
            told = [process.stdout.readline() for _ in range(2)]
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=60)
        finally:
            process.kill()
    assert told == ["PositionInput0 goal 0.100 0.000 m, 0.0 deg\n", "PositionInput0 FINISH\n"]
    assert process.returncode == 0
