"""Commands whose terminal takes nothing any more, or is gone: each of them ends, and cleans up."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import ClassVar

import can
import pytest

from tests.host.canmon.terminal import Terminal
from tests.interop.buses import GROUP, PORT
from tickrig.emulators.bench.child import running
from tickrig.emulators.tkernel.ucode_table import EXAMPLE
from tickrig.host.control.client import ControlClient
from tickrig.host.links.terminal import MOST_WAITING

pytestmark = pytest.mark.realtime

MULTICAST = ("-i", "udp_multicast", "-c", GROUP, "--bus-kwargs", f"port={PORT}")
BUS = (f"udp:{GROUP}", "--bus-kwargs", f"port={PORT}")
EDS = Path(__file__).parents[1] / "examples" / "eds"
DEFINITION = f"nodes:\n- {{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, role: device}}\n"
RESET_COMMUNICATION = (0x000, b"\x82\x10")
F8 = "\x1b[19~"
MORE = 60
"""So many recorded frames, each in a picture of its own, fill the queue of Textual: it has 30."""


def command(name: str) -> str:
    """Return a program that runs a console command as its script does."""
    return f"from tickrig.commands import {name}; {name}()"


@pytest.fixture
def bus() -> Iterator[can.BusABC]:
    with can.Bus(interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0) as bus:
        yield bus


def tell(bus: can.BusABC, number: int) -> None:
    data = number.to_bytes(4, "big")
    bus.send(can.Message(arbitration_id=0x181 + number % 25, data=data, is_extended_id=False))


class Stuck:
    """A command in a terminal that is full, and from which nobody reads."""

    running: ClassVar[set[int]] = set()

    def __init__(self, terminal: Terminal) -> None:
        self.terminal, self.pid = terminal, terminal.child.pid or 0
        self.running.add(self.pid)
        self._slave = os.open(f"/proc/{self.pid}/fd/1", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        with suppress(BlockingIOError):
            while True:
                os.write(self._slave, b"\0")

    @property
    def runs(self) -> bool:
        return os.waitpid(self.pid, os.WNOHANG) == (0, 0)

    def close(self) -> None:
        """Close the terminal, as an emulator of terminals does that ends."""
        os.close(self._slave)
        self._slave = -1
        os.close(self.terminal.child.child_fd)

    def end(self) -> int:
        """Wait for the end of the command and return its exit status."""
        _, status = os.waitpid(self.pid, 0)
        self.running.remove(self.pid)
        self.terminal.child.closed = True
        if self._slave >= 0:
            os.close(self._slave)
        return os.waitstatus_to_exitcode(status)


@pytest.fixture(autouse=True)
def none_left() -> Iterator[None]:
    yield
    while Stuck.running:
        os.kill(Stuck.running.pop(), signal.SIGKILL)


ENDINGS: dict[str, Callable[[Stuck], object]] = {
    "close": Stuck.close,
    "q": lambda stuck: stuck.terminal.child.send("q"),
    "SIGTERM": lambda stuck: os.kill(stuck.pid, signal.SIGTERM),
}


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_monitor_ends_what_it_does_though_its_terminal_is_stuck(
    bus: can.BusABC, ending: str, tmp_path: Path
) -> None:
    settings, part = tmp_path / "bench.toml", tmp_path / "run-00001.log"
    words = ("tui", *BUS, "-w", str(settings))
    terminal = Terminal(*words, program=command("canmon"))
    terminal.wait_for("LISTEN-ONLY")
    terminal.child.send(F8)
    terminal.wait_for("record into")
    terminal.child.send("\x15")  # all that stands in the field goes
    terminal.child.send(f"{tmp_path}/run.log\r")
    terminal.wait_for("REC")
    terminal.child.send("ob")  # settings that are saved
    terminal.wait_for("frames CAN-ID")
    tell(bus, 0)
    terminal.wait_for("1 frame ")
    stuck = Stuck(terminal)

    def record(number: int) -> None:
        before = part.stat().st_size
        tell(bus, number)
        while part.stat().st_size == before:
            assert stuck.runs

    for number in range(1, MORE):
        record(number)
    ENDINGS[ending](stuck)
    assert stuck.end() == 0
    assert len(part.read_text("ascii").splitlines()) == MORE
    assert '"ev":"end"' in (tmp_path / "run.index.jsonl").read_text("ascii")
    assert "overwrite = true" in settings.read_text("utf-8")


def test_what_a_stuck_terminal_missed_is_painted_when_it_reads_on(bus: can.BusABC) -> None:
    terminal = Terminal("tui", *BUS, columns=200, lines=60, program=command("canmon"))
    terminal.wait_for("LISTEN-ONLY")
    Stuck.running.discard(Stuck(terminal).pid)
    for number in range(4 * MOST_WAITING // (200 * 60)):
        terminal.resize(200 - number % 2, 60)  # each time all of the screen
        tell(bus, number)
    terminal.child.send("3")
    terminal.wait_for("identifiers by id")
    terminal.child.send("q")
    assert terminal.end() == 0


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_table_on_the_screen_is_left_though_the_terminal_is_stuck(
    bus: can.BusABC, ending: str
) -> None:
    terminal = Terminal("top", *BUS, program=command("canmon"))
    terminal.wait_for("0 identifiers")
    stuck = Stuck(terminal)
    tell(bus, 1)
    ENDINGS[ending](stuck)
    assert stuck.end() == 0


@pytest.mark.parametrize("ending", ["close", "SIGTERM"])
def test_the_operator_panel_gives_back_what_it_has_though_its_terminal_is_stuck(
    ending: str, tmp_path: Path
) -> None:
    words = ("--link", str(tmp_path / "tty"), "--panel")
    terminal = Terminal(*words, program=command("rrc_emu"))
    terminal.wait_for("WaitPowerOn")
    ENDINGS[ending](stuck := Stuck(terminal))
    assert stuck.end() == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_editor_leaves_its_nodes_though_its_terminal_is_stuck(
    bus: can.BusABC, ending: str, tmp_path: Path
) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(DEFINITION, "utf-8")
    terminal = Terminal(str(file), *MULTICAST, program=command("rtc_canopen_editor"))
    terminal.wait_for("Palette0")
    while bus.recv(0):
        pass
    ENDINGS[ending](stuck := Stuck(terminal))
    assert stuck.end() == 0
    assert RESET_COMMUNICATION in list(sent(bus))


def sent(bus: can.BusABC) -> Iterator[tuple[int, bytes]]:
    while message := bus.recv(0):
        yield message.arbitration_id, bytes(message.data)


@pytest.mark.parametrize("ending", ["close", "SIGTERM"])
def test_a_dump_ends_though_its_terminal_is_stuck(ending: str, tmp_path: Path) -> None:
    source = tmp_path / "in.log"
    source.write_text("".join(f"({n}.000000) can0 181#{n:08X}\n" for n in range(20_000)), "ascii")
    terminal = Terminal("dump", str(source), program=command("canmon"))
    terminal.wait_until(lambda: bool(terminal.written))
    ENDINGS[ending](stuck := Stuck(terminal))
    assert stuck.end() == 0


@pytest.mark.parametrize("ending", ["close", "SIGTERM"])
def test_an_emulator_writes_its_trace_to_the_end_though_its_terminal_is_stuck(
    ending: str, tmp_path: Path
) -> None:
    link, trace = tmp_path / "tty", tmp_path / "run.trace"
    words = ("--link", str(link), "--trace", str(trace), "-vv")
    terminal = Terminal(*words, program=command("rrc_emu"))
    terminal.wait_for("EV:Initialized")
    stuck = Stuck(terminal)
    link.write_bytes(b"output1e00\n" * 10)
    ENDINGS[ending](stuck)
    assert stuck.end() == 0
    assert trace.read_text("ascii").splitlines()[-1].endswith(" .")


CHAIR = "the port of an emulated RRC whose VR2 is on"


@contextmanager
def with_chair(words: tuple[str, ...]) -> Iterator[list[str]]:
    """Give the words of a command with the port of an RRC, if they name one."""
    if CHAIR not in words:
        yield [*words]
        return
    with running("tickrig.emulators.rrc.cli") as rrc, ControlClient(rrc.control) as control:
        control.request("press", name="power_button")
        while control.request("get", names=["state"])["values"] != {"state": "Standby"}:
            control.request("status")
        yield [str(rrc.link) if word == CHAIR else word for word in words]


SCRIPT = '"$@" 2>&1 & echo $!; wait $!; echo status $?'
BACKGROUND: dict[str, tuple[str, tuple[str, ...], int]] = {
    "rrc-emu": ("rrc_emu", (), 0),
    "rtc-lite-emu": ("rtc_lite_emu", (), 0),
    "rh3-emu": ("rh3_emu", (), 0),
    "urg-emu": ("urg_emu", (), 0),
    "ucode-reader-emu": ("ucode_reader_emu", (), 0),
    "ucode-resolver": ("ucode_resolver", ("table.txt",), 0),
    "tkernel-emu": ("tkernel_emu", (), 0),
    "canopen-slave-emu": ("canopen_slave_emu", ("--node", "5=epos", *MULTICAST), 0),
    "rtc-canopen-server": ("rtc_canopen_server", ("robot.yaml", *MULTICAST), 0),
    "rrc watch": ("rrc", (CHAIR, "watch"), 130),
    "rrc limit": ("rrc", (CHAIR, "limit", "50", "50"), 130),
    "tickrig emu": ("tickrig", ("emu", "rrc"), 0),
    "tickrig run": ("tickrig", ("run", "rig.toml"), 0),
    "tickrig rtc run": ("tickrig", ("rtc", "run", "--control", "control"), 0),
    "tickrig demo": ("tickrig", ("demo", "rtc-lite"), 130),
    "tickrig demo leader": ("tickrig", ("demo", "leader", "--control", "control"), 0),
    "canmon dump": ("canmon", ("dump", *BUS), 0),
    "canmon check": ("canmon", ("check", *BUS, "--known", "001"), 1),
    "canmon gateway": ("canmon", ("gateway", *BUS, "--listen", "0"), 0),
}
"""Commands that run until they are ended, and how that is."""

IMPATIENT = """
import click, signal
say = click.echo
def echo(text="", *words, **named):
    say(text, *words, **named)
    if "Ctrl-C ends" in str(text):
        signal.raise_signal(signal.SIGINT)
click.echo = echo
"""


@pytest.mark.parametrize("name", BACKGROUND)
def test_sigint_ends_what_a_script_has_begun_in_the_background(
    bus: can.BusABC, name: str, tmp_path: Path
) -> None:
    (tmp_path / "rig.toml").write_text('[device.chair]\ntype = "rrc"\n', "utf-8")
    (tmp_path / "robot.yaml").write_text(DEFINITION, "utf-8")
    (tmp_path / "table.txt").write_text(EXAMPLE, "utf-8")
    point, words, status = BACKGROUND[name]
    program = [sys.executable, "-u", "-c", command(point)]
    with (
        with_chair(words) as given,
        subprocess.Popen(
            ["sh", "-c", SCRIPT, "sh", *program, *given],
            stdout=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
        ) as script,
    ):
        assert script.stdout is not None
        pid = int(script.stdout.readline())
        while not select.select([script.stdout], [], [], 0.01)[0]:
            tell(bus, 1)
        script.stdout.readline()
        os.kill(pid, signal.SIGINT)
        assert script.stdout.read().splitlines()[-1] == f"status {status}"


@pytest.mark.parametrize(
    "name",
    [
        name
        for name in BACKGROUND
        if name not in {"tickrig demo", "canmon dump", "canmon check", "rrc watch"}
    ],
)
def test_who_ends_a_command_in_the_moment_it_says_how_ends_it(name: str, tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text('[device.chair]\ntype = "rrc"\n', "utf-8")
    (tmp_path / "robot.yaml").write_text(DEFINITION, "utf-8")
    (tmp_path / "table.txt").write_text(EXAMPLE, "utf-8")
    point, words, status = BACKGROUND[name]
    program = [sys.executable, "-c", IMPATIENT + command(point)]
    with with_chair(words) as given:
        ended = subprocess.run(
            [*program, *given], capture_output=True, text=True, cwd=tmp_path, check=False
        )
    assert (ended.returncode, "Ctrl-C ends" in ended.stderr) == (status, True), ended.stderr


@pytest.mark.parametrize("verb", ["top", "nodes"])
def test_sigint_ends_a_verb_that_prints_in_the_end(
    bus: can.BusABC, verb: str, tmp_path: Path
) -> None:
    """Nothing shows when it listens, so it may be ended before: by the signal, with 130."""
    program = [sys.executable, "-u", "-c", command("canmon"), verb, *BUS]
    with subprocess.Popen(
        ["sh", "-c", SCRIPT, "sh", *program], stdout=subprocess.PIPE, text=True
    ) as script:
        assert script.stdout is not None
        os.kill(int(script.stdout.readline()), signal.SIGINT)
        assert script.stdout.read().splitlines()[-1] in ("status 0", "status 130")
