"""`canopen-slave-emu --bus`: each node of a bus.yml, and what it says of a file that is wrong."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.emulators.canopen.bus_file.system import ONE_JOINT, write_system
from tickrig.emulators.canopen.cli import main
from tickrig.emulators.testing.commands.check_cli import check

TWO = f"""{ONE_JOINT}
joint_2:
  node_id: 3
  dcf: joint.eds
"""
SCENARIO = "10ms send 000#0100\n11ms watch joint_1/drive_state\n20ms end\n"


def play(*words: str | Path, scenario: str = SCENARIO) -> Result:
    return CliRunner().invoke(main, [*map(str, words), "--scenario", "-"], input=scenario)


def frames(result: Result) -> list[str]:
    return re.findall(r"^\(\d{10}\.\d{6}\) \S+ (\S+)$", result.stdout, re.MULTILINE)


def test_each_node_boots_under_its_node_id(tmp_path: Path) -> None:
    result = play("--bus", write_system(tmp_path, TWO))
    assert (result.exit_code, frames(result)[:2]) == (0, ["702#00", "703#00"])
    assert "joint_1/drive_state Switch on disabled" in result.stderr


@pytest.mark.realtime
def test_the_heads_tell_what_each_node_is(tmp_path: Path) -> None:
    path = write_system(tmp_path, TWO)
    program = "from tickrig.emulators.canopen.cli import main; main(prog_name='canopen-slave-emu')"
    words = ["--bus", str(path), "-i", "virtual", "-c", "heads", "--scenario", "-"]
    done = subprocess.run(
        [sys.executable, "-c", program, *words],
        input="1ms end\n",
        capture_output=True,
        text=True,
        check=False,
    )
    head = f"2 CANopen slaves of {path} on virtual heads:\n"
    line = "  joint_1  node-ID 2  joint.eds  CiA 402, epos-wheel, gear 51:1, 9.25 Nm, 16.4 rad/s, "
    assert f"{head}{line}1000 units a rad\n" in done.stderr


def test_identity_and_cob_ids_are_what_the_master_checks(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  revision_number: 0x77\n  serial_number: 5\n"
    scenario = (
        "10ms send 602#4018100300000000\n20ms send 602#4018100400000000\n"
        "30ms send 602#4014100000000000\n40ms end\n"
    )
    result = play("--bus", write_system(tmp_path, text), scenario=scenario)
    answers = [frame for frame in frames(result) if frame.startswith("582")]
    assert answers == ["582#4318100377000000", "582#4318100405000000", "582#4314100082000000"]
    assert f"{tmp_path / 'bus.yml'}:7: warning: [identity]" in result.stderr


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--node", "5=epos"], "--bus names all nodes: it goes without --node"),
        (["--model", "epos"], "--bus names all nodes: it goes without --model"),
        (
            ["--rig", "a.toml", "--node-id", "5"],
            "--bus names all nodes: it goes without --node-id and --rig",
        ),
    ],
)
def test_bus_goes_alone(tmp_path: Path, words: list[str], error: str) -> None:
    result = play("--bus", write_system(tmp_path), *words)
    assert (result.exit_code, result.stderr) == (2, f"Error: {error}\n")


def test_a_bus_yml_is_no_rig_and_a_rig_no_bus_yml(tmp_path: Path) -> None:
    path = write_system(tmp_path)
    assert play("--rig", path).stderr == f"Error: rig {path}: it is a bus.yml: --bus {path}\n"
    rig = tmp_path / "rig.toml"
    rig.write_text('[device.a]\ntype = "epos"\n')
    assert play("--bus", rig).stderr.startswith(f"Error: {rig}:")


def test_urdf_belongs_to_bus() -> None:
    result = play("--urdf", "arm.urdf")
    assert (result.exit_code, result.stderr) == (
        2,
        "Error: --urdf belongs to --bus: it has the joints of a bus.yml\n",
    )


def test_files_that_are_not_there_are_told(tmp_path: Path) -> None:
    missing = play("--bus", tmp_path / "bus.yml")
    assert (missing.exit_code, missing.stderr) == (
        2,
        f"Error: file {tmp_path / 'bus.yml'}: No such file or directory\n",
    )
    robot = play("--bus", write_system(tmp_path), "--urdf", tmp_path / "arm.urdf")
    assert robot.stderr == f"Error: file {tmp_path / 'arm.urdf'}: No such file or directory\n"


def test_all_mistakes_are_told_at_once_with_their_lines(tmp_path: Path) -> None:
    path = write_system(
        tmp_path,
        """\
        master:
          node_id: 1
        options:
          tickrig: {urdf: none.urdf}
        joint_1:
          node_id: 2
          dcf: joint.eds
          tickrig:
            gear_raito: 5
            motor: epos-whele
            home_switch: [2, 1]
            modes: [pp, xy]
            start: {load: 3, ambient_c: 900}
        joint_2:
          node_id: 3
          dcf: joint.eds
          num_channels: 2
        """,
    )
    result = play("--bus", path)
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        f"Error: {path}:4: options.tickrig.urdf: {tmp_path / 'none.urdf'}: "
        "No such file or directory",
        f"{path}:9: joint_1.tickrig: no key 'gear_raito'; did you mean 'gear_ratio'?",
        f"{path}:10: joint_1.tickrig.motor: it takes epos-wheel, motor-core-unit, "
        "not 'epos-whele'; did you mean 'epos-wheel'?",
        f"{path}:11: joint_1.tickrig.home_switch: it takes a pair [FROM, TO] with FROM up to "
        "TO, not a list",
        f"{path}:12: joint_1.tickrig.modes: it takes pp, pv, tq, hm, ip, csp, csv, cst, not 'xy'",
        f"{path}:13: joint_1.tickrig.start.ambient_c: ambient_c 900 is not in -40..85 degC",
        f"{path}:13: joint_1.tickrig.start.load: no input 'load'; did you mean 'load_nm'?",
        f"{path}:14: joint_2: a drive of several axes (CiA 402-1) is not emulated; "
        "profile: none for its objects",
    ]


def test_a_node_without_drive_has_no_motor(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  tickrig:\n    profile: none\n    gear_ratio: 3\n"
    path = write_system(tmp_path, text)
    assert play("--bus", path).stderr == (
        f"Error: {path}:9: joint_1.tickrig.gear_ratio: it is no CiA 402 drive, and has no motor\n"
    )


def test_a_drive_of_several_axes_can_be_plain_objects(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  num_channels: 2\n  tickrig: {{profile: none}}\n"
    assert play("--bus", write_system(tmp_path, text), scenario="5ms end\n").exit_code == 0


def test_the_check_tells_what_is_wrong_with_our_keys(tmp_path: Path) -> None:
    path = write_system(tmp_path, f"{ONE_JOINT}  tickrig: {{gear_ratio: -1}}\n")
    done = CliRunner().invoke(check, [str(path)])
    text = (
        "error: [tickrig] joint_1.tickrig.gear_ratio: it takes a number 0.01..1e+06, not -1; fix: "
    )
    assert done.exit_code == 1
    assert done.stdout.splitlines()[-1].startswith(f"{path}:7: {text}")


@pytest.mark.parametrize("keys", ["lower: 1, upper: -1", "upper: 0, lower: 0"])
def test_a_joint_between_no_limits_is_wrong(tmp_path: Path, keys: str) -> None:
    path = write_system(tmp_path, f"{ONE_JOINT}  tickrig: {{{keys}}}\n")
    done = CliRunner().invoke(check, [str(path)])
    assert done.exit_code == 1
    assert "error: [tickrig] joint_1.tickrig.lower: " in done.stdout
    assert " is not below upper, which is " in done.stdout


def test_a_node_may_begin_as_its_master_leaves_it(tmp_path: Path) -> None:
    text = (
        f"{ONE_JOINT}  heartbeat_producer: 50\n  sdo: [{{index: 0x6081, value: 0}}]\n"
        "  tpdo: {1: {enabled: true, cob_id: 0x190, transmission: 1, mapping: [{index: 0x6064}]}}\n"
        "  tickrig: {configured: true}\n"
    )
    result = play(
        "--bus",
        write_system(tmp_path, text),
        scenario="10ms send 000#0102\n20ms send 080#\n30ms send 602#4081600000000000\n60ms end\n",
    )
    heard = frames(result)
    assert {"190#00000000", "702#05", "582#4381600000000000"} <= set(heard)


@pytest.mark.parametrize(
    ("mode", "told"),
    [
        (7, "mode 7 (ip) is not in 6502h of its EDS: it is added"),
        (-3, "mode -3 is not emulated: 6060h refuses it, and so fails the boot-up"),
        (2, "mode 2 is not emulated: 6060h refuses it, and so fails the boot-up"),
    ],
)
def test_a_mode_that_the_file_writes_and_the_eds_lacks_is_told(
    tmp_path: Path, mode: int, told: str
) -> None:
    text = f"{ONE_JOINT}  sdo:\n    - {{index: 0x6060, value: {mode}}}\n"
    path = write_system(tmp_path, text)
    result = play("--bus", path, scenario="5ms end\n")
    assert f"{path}:8: joint_1: {told}\n" in result.stderr


def test_speeds_in_other_units_than_positions_are_told(tmp_path: Path) -> None:
    text = f"{ONE_JOINT}  scale_pos_to_dev: 5000\n"
    path = write_system(tmp_path, text)
    said = "scale_vel_to_dev is 1000, but the drive counts speeds as positions: 5000 a second"
    told = f"{path}:4: joint_1: {said}\n"
    assert told in play("--bus", path, scenario="5ms end\n").stderr
    path.write_text(f"{text}  scale_vel_to_dev: 5000\n")
    assert said not in play("--bus", path, scenario="5ms end\n").stderr


def test_a_further_axis_that_nobody_uses_is_told(tmp_path: Path) -> None:
    path = write_system(tmp_path)
    sheet = tmp_path / "joint.eds"
    entry = "[6840]\nParameterName=Controlword 2\nObjectType=7\nDataType=6\nAccessType=rw\n"
    text = sheet.read_text()
    count = int(re.findall(r"\[OptionalObjects\]\nSupportedObjects=(\d+)", text)[0])
    text = text.replace(f"SupportedObjects={count}\n", f"SupportedObjects={count + 1}\n")
    text = text.replace("[ManufacturerObjects]", f"{count + 1}=0x6840\n\n[ManufacturerObjects]", 1)
    sheet.write_text(f"{text}\n{entry}")
    result = play("--bus", path, scenario="5ms end\n")
    assert result.exit_code == 0
    assert (
        f"{path}:4: joint_1: of its axes (CiA 402-1) the first one is emulated\n" in result.stderr
    )


def test_anchors_that_double_sixty_times_are_read_at_once(tmp_path: Path) -> None:
    lines = ["a0: &a0 [x]", *(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, 60))]
    keys = "".join(f"    {line}\n" for line in [*lines, "modes: *a59", "start: *a59"])
    path = write_system(tmp_path, f"{ONE_JOINT}  tickrig:\n{keys}")
    said = play("--bus", path).stderr
    assert "joint_1.tickrig.modes: it takes pp, pv, tq, hm, ip, csp, csv, cst, not a list" in said
    assert "joint_1.tickrig.start: it takes a mapping of inputs, not a list" in said
