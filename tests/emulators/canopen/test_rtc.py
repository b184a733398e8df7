"""DeviceRTCs of a user's file on a bus."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from examples.device_rtc_gripper import Gripper

from tickrig.device.canopen.device_rtc import make_dictionary
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.canopen.cli import main
from tickrig.emulators.canopen.eds import read_eds

ROOT = Path(__file__).parents[3]
GRIPPER = "examples/device_rtc_gripper.py:Gripper"
COMPONENT = """
from tickrig.device.canopen.device_rtc import CanopenComponent
from tickrig.device.canopen.device_rtc import CanopenInPort
from tickrig.device.physical import InputSignal
from tickrig.wire.rtc_canopen import CHARACTER, STRING

class Mine(CanopenComponent):
    type_name = "Mine"
    letter = CanopenInPort("letter", CHARACTER)
    def on_execute(self):
        raise RuntimeError("no idea")

class Wordy(CanopenComponent):
    type_name = "Wordy"
    words = CanopenInPort("words", STRING, cob_id=0x300)

class Greedy(CanopenComponent):
    type_name = "Greedy"
    physical = (InputSignal("power_off", "mine"),)

class Broken(CanopenComponent):
    type_name = "Broken"
    def __init__(self):
        super().__init__()
        self.nothing.here()
"""


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(COMPONENT)
    return tmp_path / "mine.py"


def run(*words: str | Path, scenario: str = "") -> Result:
    more = ["--scenario", "-"] if scenario else []
    return CliRunner().invoke(main, [*map(str, words), *more], input=scenario)


def frames(result: Result) -> list[str]:
    return re.findall(r"^\(\d{10}\.\d{6}\) \S+ (\S+)$", result.stdout, re.MULTILINE)


def rows(dictionary: Dictionary) -> list[tuple[object, ...]]:
    return [
        (entry.key, entry.name, entry.data_type, entry.access, entry.default, entry.relative)
        for entry in dictionary.description
    ]


def test_the_gripper_moves_gets_hot_and_stays_in_error_until_it_is_cool() -> None:
    scenario = """
        10ms  send 000#0110
        20ms  send 210#F401
        50ms  set motor_dc 950
        70ms  send 000#8110
        80ms  set motor_dc 100
        90ms  send 000#8110
        +0s   expect 710#00 within 5ms
        100ms end
    """
    result = run("--rtc", GRIPPER, "--node-id", "16", scenario=scenario)
    assert result.exit_code == 0, result.output
    assert frames(result) == [
        *("710#00", "000#0110", "190#0000", "290#00"),
        *("210#F401", "190#F401", "290#01", "190#F401", "290#00"),
        *("000#8110", "000#8110", "710#00"),
    ]


def test_two_components_hear_each_other_on_one_bus() -> None:
    scenario = """
        10ms send 000#0100
        20ms set 16/0x1800:1 0x80000190
        30ms set 48/0x2101 7
        40ms end
    """
    result = run("--node", f"16={GRIPPER}", "--node", "48=rtc-echo", scenario=scenario)
    assert (result.exit_code, frames(result)[:2]) == (0, ["710#00", "730#00"])
    assert "1B0#07000000" in frames(result)


def test_the_eds_of_a_component_gives_the_same_dictionary(tmp_path: Path) -> None:
    file = tmp_path / "gripper.eds"
    assert run("--rtc", GRIPPER, "--write-eds", file).exit_code == 0
    assert rows(read_eds(file).template) == rows(make_dictionary(Gripper))


def test_a_character_port_survives_its_eds(tmp_path: Path, mine: Path) -> None:
    file = tmp_path / "mine.eds"
    assert run("--rtc", f"{mine}:Mine", "--write-eds", file).exit_code == 0
    assert "DataType=0x00A0" in file.read_text("utf-8")
    assert read_eds(file).template[0x2100, 0].data_type.name == "VISIBLE_CHAR"


def test_an_eds_that_derives_a0h_keeps_its_own_type(tmp_path: Path, mine: Path) -> None:
    file = tmp_path / "mine.eds"
    run("--rtc", f"{mine}:Mine", "--write-eds", file)
    text = file.read_text("utf-8").replace("DefaultBytes of 2100 is 00", "")
    derived = "\n[A0]\nSubNumber=2\n[A0sub1]\nParameterName=Type\nDefaultValue=0x5\n"
    file.write_text(text + derived)
    assert read_eds(file).template[0x2100, 0].data_type.name == "UNSIGNED8"


def test_a_callback_that_raises_is_one_line(mine: Path) -> None:
    result = run("--rtc", f"{mine}:Mine", "--node-id", "5", scenario="10ms send 000#0105\n1s end\n")
    assert result.exit_code == 2
    assert result.stderr.splitlines()[-1] == f"Error: {mine}:Mine: line 11: RuntimeError: no idea"


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Wordy", "mine.py:Wordy: Wordy: port words: it has no PDO for cob_id 300h"),
        ("Greedy", "input 'power_off' is one that every node has"),
        ("Broken", "line 25: AttributeError: 'Broken' object has no attribute 'nothing'"),
        ("Other", "has no component 'Other'; it has Mine, Wordy, Greedy, Broken"),
    ],
)
def test_a_component_that_cannot_be_is_one_line(mine: Path, name: str, reason: str) -> None:
    result = run("--rtc", f"{mine}:{name}", "--node-id", "5", scenario="1s end\n")
    assert result.exit_code == 2
    assert reason in result.stderr.splitlines()[-1]


def test_what_is_no_file_with_a_class_is_one_line() -> None:
    result = run("--rtc", "gripper", "--node-id", "5", scenario="1s end\n")
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (
        *(2, "Error: 'gripper' is not FILE.py:Class"),
    )


def test_a_rig_file_names_components_beside_it(tmp_path: Path, mine: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[device.a]\ntype = "mine.py:Mine"\nnode_id = 5\n[device.b]\ntype = "rtc-echo"\n'
    )
    result = run("--rig", rig, scenario="20ms end\n")
    assert (result.exit_code, frames(result)) == (0, ["705#00", "730#00"])
