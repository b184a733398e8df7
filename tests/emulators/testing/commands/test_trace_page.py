"""docs/reference/bench/trace.md, command by command."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click import Command
from click.testing import CliRunner

from tests.emulators.testing.commands.test_compare_cli import record_bus, record_rrc
from tests.emulators.testing.commands.test_record_realtime import Recorder, answer
from tests.host.live import live_rrc, pty
from tickrig.device.rrc.settings import RrcConfig
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rrc.cli import main as rrc_emu
from tickrig.host.canmon.cli import main as canmon
from tickrig.host.links.serial_link import SerialLink

PAGE = (Path(__file__).parents[4] / "docs" / "reference/bench/trace.md").read_text("utf-8")
PROGRAMS: dict[str, Command] = {"tickrig": tickrig, "canmon": canmon, "rrc-emu": rrc_emu}


def blocks(language: str) -> list[str]:
    """Return the blocks of a language, those in lists without their indentation."""
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```", PAGE, re.DOTALL | re.MULTILINE)
    return [re.sub(rf"^{indent}", "", text, flags=re.MULTILINE) for indent, text in found]


def console() -> dict[str, str]:
    """Return what each command of the page prints."""
    text = "".join(blocks("console"))
    return dict(re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", text, re.MULTILINE))


COMMANDS = console()


def run(line: str, *, code: int = 0) -> str:
    name, *words = shlex.split(line)
    result = CliRunner().invoke(PROGRAMS[name], words)
    assert result.exit_code == code, result.output
    return result.stdout


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_all_commands_of_the_page_are_known_here() -> None:
    assert [line.split(" run.trace")[0].split(" bench.trace")[0] for line in COMMANDS] == [
        "rrc-emu --scenario start.txt --trace",
        "tickrig replay",
        "tickrig replay",
        "tickrig record /dev/ttyUSB0 --out",
        "tickrig compare",
        "canmon dump can0 -l bus.trace",
        "tickrig compare bus.trace --node 5=epos --node 3=f-palette --number '382#*[2:6]=300'",
    ]


def test_an_emulator_is_recorded_and_replayed(folder: Path) -> None:
    (folder / "start.txt").write_text("0 press power_button\n1s send version\n1100ms send device\n")
    run(next(line for line in COMMANDS if line.startswith("rrc-emu")))
    line = "tickrig replay run.trace"
    assert run(line) == COMMANDS[line]


def test_a_bench_is_recorded_and_replayed() -> None:
    exec(compile(blocks("python")[0], "trace.md", "exec"), {})
    line = "tickrig replay bench.trace"
    assert run(line) == COMMANDS[line]


def test_a_recording_is_compared(folder: Path) -> None:
    record_rrc(folder / "run.trace", RrcConfig(power_on_ticks=33))
    line = "tickrig compare run.trace"
    assert run(line, code=1) == COMMANDS[line]


def test_a_bus_is_recorded_by_canmon_and_compared(folder: Path) -> None:
    record_bus(folder / "master.trace")
    run("canmon conv master.trace master.log")
    dump, compare = list(COMMANDS)[-2:]
    log = (folder / "master.log").read_text().replace(" T\n", "\n")  # who only listens
    (folder / "master.log").write_text(log)
    run(dump.replace("can0", "master.log"))
    assert (folder / "bus.trace").read_text().count(" > ") == 0
    assert "same: " in run(compare)


@pytest.mark.realtime
def test_a_port_is_recorded_by_the_command_and_by_the_program(folder: Path) -> None:
    line = next(line for line in COMMANDS if "record" in line)
    words = shlex.split(line)
    assert words[:2] == ["tickrig", "record"]
    with pty() as port, live_rrc(port) as rrc:
        rrc.await_output("state", "WaitPowerOn")
        recorder = Recorder(port.path, folder / "run.trace", folder / "rrc")
        assert words[2:] == ["/dev/ttyUSB0", *recorder.options("run.trace", "/tmp/rrc")]
        answer(SerialLink(str(recorder.link)), b"version\n", b"Version 1.0\n")
        assert recorder.end()[0] == 0
        program = blocks("python")[1].replace("/dev/ttyUSB0", port.path)
        exec(compile(program, "trace.md", "exec"), {})
    assert run("tickrig compare run.trace --tolerance 200ms")
