from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click import Command
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rh3.cli import main as rh3_emu
from tickrig.emulators.rrc.cli import main as rrc_emu
from tickrig.emulators.rtc_lite.cli import main as rtc_lite_emu
from tickrig.emulators.urg.cli import main as urg_emu

ROOT = Path(__file__).parents[3]
GOLDEN = ROOT / "tests" / "golden" / "scenario"
NAMES = sorted(path.stem for path in GOLDEN.glob("*.txt"))


def rrc(*words: str | Path, text: str | None = None) -> Result:
    return CliRunner().invoke(rrc_emu, [str(word) for word in words], input=text)


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_gives_its_golden_transcript(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(GOLDEN)
    result = rrc("--scenario", f"{name}.txt")
    assert result.stdout == Path(f"{name}.transcript").read_text()
    assert result.exit_code == ("? " in result.stdout)


def test_the_transcript_does_not_depend_on_the_process() -> None:
    program = "from tickrig.emulators.rrc.cli import main; main()"
    outs = {
        subprocess.run(
            [sys.executable, "-c", program, "--scenario", "drive.txt"],
            cwd=GOLDEN,
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT / "src")},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "12345")
    }
    assert outs == {(GOLDEN / "drive.transcript").read_bytes()}


def test_the_example_of_the_documentation_prints_what_it_says(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "reference/bench/scenario.md").read_text()
    scenario, transcript = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    (tmp_path / "drive.txt").write_text(scenario)
    result = rrc("--scenario", tmp_path / "drive.txt")
    assert (result.exit_code, result.stdout) == (0, transcript)


def test_a_scenario_comes_from_standard_input_too() -> None:
    result = rrc("--scenario", "-", text="0.1 end\n")
    assert result.stdout.endswith("0.011303 < EV:Initialized\n")
    assert result.stderr == "ran 0.100 s; bytes lost: 0\n"


def test_a_missed_expectation_is_exit_status_1() -> None:
    result = rrc("--scenario", "-", text="0 expect EV:PowerOn within 1s\n")
    assert result.exit_code == 1
    assert "1.000000 ? -:1: no line 'EV:PowerOn' within 1000 ms of 0.000000\n" in result.stdout
    assert result.stderr.endswith("expectations met: 0; missed: 1\n")


def test_the_power_on_event_may_be_that_of_the_manual() -> None:
    scenario = "0.1 press power_button\n+0s expect EV:PowerOn within 50ms"
    assert rrc("--scenario", "-", "--power-on-event", "PowerOn", text=scenario).exit_code == 0


MINITERM = "python -m serial.tools.miniterm --eol LF -e"


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("command", "words", "talk"),
    [
        (rrc_emu, (), f"{MINITERM} LINK 115200"),
        (urg_emu, (), f"{MINITERM} LINK 115200"),
        (urg_emu, ("--baud", "230400"), f"{MINITERM} LINK 230400"),
        (rh3_emu, ("--baud", "57600"), "rh3 goto 1 0 0 --device LINK --baud 57600"),
        (rtc_lite_emu, (), "tickrig rtc run SYSTEM.toml --lite NAME=LINK@57600"),
    ],
)
def test_a_greeting_says_how_to_talk_at_the_own_rate(
    command: Command, words: tuple[str, ...], talk: str, tmp_path: Path
) -> None:
    link = str(tmp_path / "tty")
    words = (*words, "--link", link, "--scenario", "-")
    result = CliRunner().invoke(command, words, input="0.02 end\n")
    assert f"\n  {talk.replace('LINK', link)}\n" in result.stderr
    assert not list(tmp_path.iterdir())


def test_faults_of_the_command_line_are_those_of_scenarios() -> None:
    result = rrc(
        *("--scenario", "-", "--fault", "vr2_fault", "--fault", "cut@5ms-15ms"),
        text="0.1 press power_button\n0.5 end",
    )
    assert "0.000000 ! vr2_fault=1\n" in result.stdout
    assert "0.401476 < EV:PowerOnError2" in result.stdout
    assert "EV:Initialized" not in result.stdout


def test_a_seed_chooses_the_chance() -> None:
    def said(seed: int) -> str:
        words = ("--scenario", "-", "--fault", "flip=0.05", "--seed", str(seed))
        return rrc(*words, text="0.1 press power_button\n0.5 end").stdout

    assert said(1) == said(1)
    assert said(1) != said(2)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--scenario", "missing.txt"], "scenario missing.txt: No such file or directory"),
        (["--scenario", "."], "scenario .: Is a directory"),
        (["--scenario", "bad.txt"], "bad.txt:1: no action 'jump'; known: send, check, raw"),
        (["--scenario", "latin.txt"], "scenario latin.txt: byte 2 is not UTF-8"),
        (["--fault", "flup=1"], "--fault: no fault 'flup'; did you mean 'flip'?"),
        (["--fault", "flip=2"], "--fault: flip takes a rate above 0 and up to 1"),
        (["--fault", "cut@x"], "--fault: 'x' is not a time: write 1.5s, 200ms or 250us"),
        (["--link", "bad.txt"], "link bad.txt: exists; remove it if no emulator uses it"),
        (["--link", "no/dir/tty"], "link no/dir/tty: No such file or directory"),
        (["--trace", "no/dir/trace"], "trace no/dir/trace: No such file or directory"),
        (["--control", "bad.txt"], "control bad.txt: File exists"),
        (["--control", "no/dir/ctl"], "control no/dir/ctl: No such file or directory"),
        (["--control", "x" * 200], f"control {'x' * 200}: AF_UNIX path too long"),
    ],
)
def test_a_mistake_is_one_line_and_exit_status_2(
    words: list[str], error: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.txt").write_text("1 jump\n")
    Path("latin.txt").write_bytes(b"1 \xe9\n")
    before = sorted(tmp_path.iterdir())
    result = rrc(*words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"Error: {error}")
    assert result.stderr.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("words", [["-v"], ["--scenario", "x"]])
def test_a_panel_has_the_screen_to_itself(words: list[str]) -> None:
    result = rrc("--panel", *words)
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: --panel has the screen to itself: no --scenario")


def test_a_panel_without_textual_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tickrig.emulators.commands.serial_run.find_spec", lambda name: None)
    result = rrc("--panel")
    assert result.exit_code == 2
    assert result.stderr == "Error: --panel needs Textual: pip install 'tickrig[tui]'\n"


def test_nothing_but_the_panel_needs_textual() -> None:
    program = (
        "import sys; sys.modules.update(textual=None, rich=None);"
        "from tickrig.emulators.rrc.cli import main; main()"
    )
    env = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    words = [sys.executable, "-c", program, "--scenario", "drive.txt"]
    done = subprocess.run(words, cwd=GOLDEN, env=env, capture_output=True, check=False)
    assert done.stdout == (GOLDEN / "drive.transcript").read_bytes()


def test_a_mistake_leaves_an_older_trace_alone(tmp_path: Path) -> None:
    (tmp_path / "t").write_text("older")
    assert rrc("--trace", tmp_path / "t", "--fault", "x").exit_code == 2
    assert (tmp_path / "t").read_text() == "older"


@pytest.mark.parametrize("command", [rrc_emu, tickrig])
def test_versions_and_help_are_there(command: object) -> None:
    runner = CliRunner()
    assert re.search(r"\d+\.\d+\.\d+", runner.invoke(command, ["--version"]).output)  # type: ignore[arg-type]
    assert "Usage:" in runner.invoke(command, ["--help"]).output  # type: ignore[arg-type]


def replayed(path: Path) -> Result:
    return CliRunner().invoke(tickrig, ["replay", str(path)])


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    path = tmp_path / "run.trace"
    rrc("--scenario", GOLDEN / "faults.txt", "--trace", path, "--power-on-event", "PowerOn")
    return path


def test_a_recorded_scenario_replays_identically(trace: Path) -> None:
    result = replayed(trace)
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.fullmatch(r"identical: \d\d ticks\n", result.stdout)


def test_a_difference_is_shown_and_is_exit_status_1(trace: Path) -> None:
    text = trace.read_text()
    trace.write_text(text.replace(r"OK:watchdog\n", r"OK:watchdoc\n"))
    result = replayed(trace)
    assert result.exit_code == 1
    assert re.fullmatch(
        rf"different at 0\.510000 \({re.escape(str(trace))}:\d+\)\n"
        r"  recorded < OK:watchdoc\\n\n"
        r"  replayed < OK:watchdog\\n\n",
        result.stdout,
    )


def test_another_configuration_is_a_difference(trace: Path) -> None:
    text = trace.read_text()
    trace.write_text(text.replace('"power_on_event": "PowerOn"', '"power_on_ticks": 31'))
    result = replayed(trace)
    assert result.exit_code == 1
    assert result.stdout.startswith("different at 0.100000 ")


def test_a_cut_trace_is_replayed_with_a_note(trace: Path) -> None:
    trace.write_text(trace.read_text()[:-20])
    result = replayed(trace)
    assert result.exit_code == 0
    assert result.stderr == f"{trace}: no end line (killed?); its last tick is left out\n"


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("# tickrig-trace v1 rrc", "# tickrig-trace v9 rrc", "this is trace version 9"),
        ("v1 rrc", "v1 iis", "recorded on 'iis'; this program knows rrc"),
        (
            '"overtime": true',
            '"colour": 3',
            "an RRC has no setting 'colour'; known: device_name, version",
        ),
        ('"buffer_bytes": 256', '"buffer_bytes": 0', "buffer_bytes is 0, at least 1"),
        (
            '"buffer_bytes": 256',
            '"buffer_bytes": "a"',
            "buffer_bytes is 'a', expected is something like 256",
        ),
        ('"power_on_fail_target": "wait"', '"power_on_fail_target": "x"', "'x' is not a valid"),
        ("0.010000 <", "0.01 <", "line 2 is not 'SECONDS MARK TEXT'"),
        ("power_button=1", "power_button=7", "power_button 7 is not in 0..1"),
    ],
)
def test_a_damaged_trace_is_one_line(trace: Path, old: str, new: str, error: str) -> None:
    text = trace.read_text()
    assert old in text
    trace.write_text(text.replace(old, new))
    result = replayed(trace)
    assert result.exit_code == 2
    assert error in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_missing_trace_is_one_line(tmp_path: Path) -> None:
    result = replayed(tmp_path / "none")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "No such file or directory" in result.stderr


def test_a_missing_emulator_is_one_line(tmp_path: Path) -> None:
    result = CliRunner().invoke(tickrig, ["ctl", str(tmp_path / "none"), "get"])
    assert result.exit_code == 2
    assert result.stderr.endswith("none: No such file or directory, is the emulator running?\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_recording_that_ended_early_is_exit_status_3() -> None:
    met = "0 expect EV:Initialized within 1s\n0 expect nothing within 1s\n"
    result = rrc("--scenario", "-", "--trace", "/dev/full", text=met)
    assert result.exit_code == 3
    reason = "/dev/full: No space left on device"
    assert result.stderr.splitlines() == [
        f"recording ended: {reason}; the emulator goes on",
        "ran 1.000 s; bytes lost: 0",
        "expectations met: 1; missed: 1",
        f"the recording ended early: {reason}",
    ]
