from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rtc_lite.cli import main as rtc_lite_emu

ROOT = Path(__file__).parents[3]
GOLDEN = ROOT / "tests" / "golden" / "rtc_lite"
EXAMPLES = ROOT / "examples"

NODE = """
from tickrig.device.rtc_lite.component import LiteComponent
from tickrig.device.rtc_lite.component import LiteInPort, LiteOutPort
from tickrig.wire.rtc_lite.values import CHAR_SEQ, LONG, SHORT_SEQ

class Divider(LiteComponent):
    type_name = "Divider"
    number = LiteInPort("number", LONG)
    words = LiteInPort("words", CHAR_SEQ)
    many = LiteInPort("many", SHORT_SEQ)
    result = LiteOutPort("result", LONG)

    def on_execute(self) -> None:
        self.result.write(100 // self.number.read())

class Big(LiteComponent):
    type_name = "ThisNameIsTooLongForIt"

class Picky(LiteComponent):
    type_name = "Picky"

    def __init__(self, pin):
        super().__init__()

number = 5
"""


def emu(*words: str | Path, text: str | None = None) -> Result:
    return CliRunner().invoke(rtc_lite_emu, [str(word) for word in words], input=text)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(NODE)
    Path("broken.py").write_text("x = 1\ndef (\n")
    Path("raises.py").write_text("import os\n\nos.no_such_name()\n")
    return tmp_path


def test_a_scenario_gives_its_golden_transcript(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(GOLDEN)
    result = emu("--scenario", "life.txt", "--fault", "power_cut@200ms-300ms")
    assert result.stdout == Path("life.transcript").read_text()
    assert result.exit_code == 0
    assert result.stderr.endswith("expectations met: 5; missed: 0\n")


def test_a_recorded_scenario_replays_identically(folder: Path) -> None:
    scenario = GOLDEN / "life.txt"
    faults = ("--fault", "flip=0.001", "--fault", "noise=0.05", "--fault", "slow_answer@50ms")
    emu("--scenario", scenario, "--trace", "run.trace", *faults)
    result = CliRunner().invoke(tickrig, ["replay", "run.trace"])
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.fullmatch(r"identical: \d+ ticks\n", result.stdout)


def test_a_node_of_a_file_replays_if_its_code_may_run(folder: Path) -> None:
    words = ("--node", "mine.py:Divider", "--timer", "100", "--trace", "run.trace")
    assert emu(*words, "--scenario", "-", text="0 send CI\n1 end").exit_code == 0
    assert CliRunner().invoke(tickrig, ["replay", "run.trace", "--run-code"]).exit_code == 0
    mine = Path("mine.py")
    mine.write_text(f"open('run', 'w').close()\n{mine.read_text('utf-8')}", "utf-8")
    for command in ("replay", "compare"):
        refused = CliRunner().invoke(tickrig, [command, "run.trace"])
        why = "it names Python code, 'mine.py:Divider'; --run-code runs it"
        assert refused.exit_code == 2
        assert refused.stderr.startswith("Error: trace run.trace: ")
        assert why in refused.stderr
    assert not Path("run").exists()


@pytest.mark.parametrize(
    ("write", "shown"),
    [
        ("write number 7", r"PS\x06\x04number\x07\x00\x00\x00"),
        ("write words 'a b'", r"PS\x05\x03wordsa b"),
        ("write many 1 -1", r"PS\x04\x04many\x01\x00\xff\xff"),
    ],
)
def test_a_scenario_writes_values_as_people_do(folder: Path, write: str, shown: str) -> None:
    scenario = f"0 {write}\n+0s expect PS@ within 20ms"
    result = emu("--node", "mine.py:Divider", "--scenario", "-", text=scenario)
    assert result.exit_code == 0
    assert f"0.000000 > {shown}\n" in result.stdout


def test_packets_of_rtno_are_sent_and_shown_without_header_and_sum() -> None:
    scenario = "0 send X\n20ms send A\n40ms write in 7\n60ms send E\n+0s expect E@ within 9ms"
    result = emu("--framing", "rtno", "--scenario", "-", text=scenario)
    lines = [line.partition(" ")[2] for line in result.stdout.splitlines() if "*" not in line]
    assert lines == [
        *(r"> X", r"< XI", r"> A", r"< A@", r"> S\x02\x04in\x07\x00\x00\x00", r"< S@", r"> E"),
        *(r"< V\x03\x04out\x07\x00\x00\x00", r"< E@"),
    ]


def test_every_second_ping_is_lost() -> None:
    scenario = "".join(rf"{n * 20}ms send CY\x0{n}" + "\n" for n in range(1, 7)) + "200ms end"
    result = emu("--scenario", "-", "--fault", "ping=0.5", text=scenario)
    assert re.findall(r"< CY@\\x(\d\d)", result.stdout) == ["01", "03", "05"]


def test_all_pings_are_lost_and_nothing_else() -> None:
    scenario = "0 send CY\\x01\n20ms send CX\n40ms end"
    result = emu("--scenario", "-", "--fault", "ping=1", text=scenario)
    assert re.findall(r"< (\S+)", result.stdout) == ["CX@C"]


def test_a_baud_rate_shows_in_the_times() -> None:
    fast = emu("--baud", "1000000", "--scenario", "-", text="0 send CX\n20ms end").stdout
    slow = emu("--baud", "1200", "--scenario", "-", text="0 send CX\n200ms end").stdout
    assert "0.001060 < CX@C" in fast
    assert "0.084000 < CX@C" in slow


def test_a_callback_that_raises_is_one_line(folder: Path) -> None:
    scenario = "0 send CI\n10ms send AA\n20ms send AE\n30ms end"
    result = emu("--node", "mine.py:Divider", "--scenario", "-", text=scenario)
    assert result.exit_code == 2
    assert result.stderr == (
        "Error: mine.py:Divider: line 14: ZeroDivisionError: integer division or modulo by zero\n"
    )


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--node", "eco"], "--node: no node 'eco'; did you mean 'echo'? (or FILE.py:Class)"),
        (["--node", "none.py:A"], "--node: none.py: No such file or directory"),
        (["--node", ".py:A"], "--node: .py: No such file or directory"),
        (["--node", "broken.py:A"], "--node: broken.py: line 2: invalid syntax"),
        (["--node", "raises.py:A"], "--node: raises.py: line 3: AttributeError: module 'os' ha"),
        (["--node", "mine.py:A"], "--node: mine.py has no component 'A'; it has Divider, Big, "),
        (["--node", "mine.py:number"], "--node: mine.py has no component 'number'; it has Divi"),
        (["--node", "mine.py:Big"], "--node: mine.py:Big: Big: type_name: name 'ThisNameIsTooL"),
        (["--node", "mine.py:Picky"], "--node: mine.py:Picky: TypeError: Picky.__init__() miss"),
        (["--framing", "rtno", "--checksum", "xor8"], "--checksum: checksum is xor8, packets o"),
        (["--fault", "ping=2"], "--fault: ping takes a rate above 0 and up to 1, as ping=0.01; g"),
        (
            ["--fault", "x"],
            "--fault: no fault 'x'; known: flip, drop, dup, cut, delay, jitter",
        ),
        (["--node", "mine.py:Divider", "--fault", "x"], "--fault: no fault 'x'; known: flip, d"),
        (["--scenario", "bad.txt"], "bad.txt:1: no action 'jump'; known: send, write, raw"),
        (["--link", "no/tty"], "link no/tty: No such file or directory"),
    ],
)
def test_a_mistake_is_one_line_and_exit_status_2(
    words: list[str], error: str, folder: Path
) -> None:
    Path("bad.txt").write_text("1 jump\n")
    result = emu(*words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"Error: {error}")
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("0 send C", "-:1: send takes a command and its data, as 'CX', got 'C'"),
        ("0 write out 1", "-:1: no in-port 'out'; known: in"),
        ("0 write", "-:1: no in-port ''; known: in"),
        ("0 write in 1 2", "-:1: TimedLong takes one value, got 2"),
        ("0 write in x", "-:1: TimedLong cannot be ('x',): required argument is not an integer"),
    ],
)
def test_a_mistake_in_a_scenario_says_where(line: str, error: str) -> None:
    result = emu("--scenario", "-", text=line)
    assert (result.exit_code, result.stderr) == (2, f"Error: {error}\n")


@pytest.mark.parametrize("words", [["--baud", "5"], ["--timer", "0"], ["--framing", "x"]])
def test_an_option_out_of_its_range_is_refused(words: list[str]) -> None:
    result = emu(*words)
    assert result.exit_code == 2
    assert "Error: Invalid value for" in result.stderr


def test_nodes_are_completed_in_the_shell() -> None:
    env = {
        "_RTC_LITE_EMU_COMPLETE": "bash_complete",
        "COMP_WORDS": "rtc-lite-emu --node li",
        "COMP_CWORD": "2",
    }
    result = CliRunner().invoke(rtc_lite_emu, [], env=env, prog_name="rtc-lite-emu")
    assert result.output == "plain,lite-a\nplain,lite-b\n"


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ('"node": "echo"', '"colour": 3', "a node has no setting 'colour'; known: node, framing"),
        ('"node": "echo"', '"node": 3', "node is 3, expected is something like 'echo'"),
        ('"context": "proxy"', '"context": "x"', "context is 'x', proxy or timer is possible"),
        ('"framing": "lite"', '"framing": "x"', "'x' is not a valid Framing"),
    ],
)
def test_a_damaged_trace_is_one_line(folder: Path, old: str, new: str, error: str) -> None:
    emu("--scenario", "-", "--trace", "run.trace", text="0 send CX\n20ms end")
    text = Path("run.trace").read_text()
    assert old in text
    Path("run.trace").write_text(text.replace(old, new))
    result = CliRunner().invoke(tickrig, ["replay", "run.trace"])
    assert result.exit_code == 2
    assert error in result.stderr
    assert result.stderr.count("\n") == 1


def test_the_thermometer_of_the_examples_measures_and_breaks(folder: Path) -> None:
    scenario = """
    0     set temperature_dc 215
    0     send CI
    10ms  write limit 20.5
    20ms  send AA
    60ms  watch state out.celsius out.hot
    100ms set sensor_broken 1
    130ms send AR
    150ms set sensor_broken 0
    160ms send AR
    180ms end
    """
    node = f"{EXAMPLES / 'rtc_lite_thermometer.py'}:Thermometer"
    result = emu("--node", node, "--timer", "50", "--scenario", "-", text=scenario)
    seen = re.findall(r"\* (state \w+|out\S+ \S+)", result.stdout)
    assert seen[-5:] == [
        "state Active",
        "out.celsius 21.5",
        "out.hot 1",
        "state Error",
        "state Inactive",
    ]
    assert re.findall(r"< (AR\S+)", result.stdout) == ["ARxE", "AR@I"]
