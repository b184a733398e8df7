"""A bus.yml is a bench: alone, and in a rig file."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.emulators.canopen.bus_file.system import ONE_JOINT, Joint, joints, write_system
from tickrig import Bench, RigFileError, open_bench
from tickrig.emulators.testing.commands.replay_cli import replay_command
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.testing import open_master

EXAMPLES = Path(__file__).parents[4] / "examples"
IO_MODULE = EXAMPLES / "io_module.eds"
EXAMPLE = EXAMPLES / "ros2_canopen"

TWO = f"""{ONE_JOINT}  tickrig: {{start: {{load_nm: 0.5}}, supply_v: 48, upper: 0.5}}

joint_2:
  node_id: 3
  dcf: joint.eds
"""


def velocity(joint: Joint, value: int) -> None:
    joint.enable(3)
    joint.write(0x60FF, value, 4)


def test_a_test_presses_loads_unplugs_and_blocks_a_joint_by_its_name(tmp_path: Path) -> None:
    with joints(write_system(tmp_path, TWO), 2, 3) as (bench, [first, second]):
        assert bench.devices == ("joint_1", "joint_2")
        one, two = bench["joint_1"], bench["joint_2"]
        assert (one.get("load_nm"), one.get("supply_v"), two.get("load_nm")) == (0.5, 48, 0)
        for joint in (first, second):
            velocity(joint, 100)
        bench.run_for("500ms")
        two.set("negative_limit_switch", 1)
        bench.run_for("2ms")
        assert second.read(0x60FD) == 1
        two.fault("encoder_unplugged")
        bench.run_for("20ms")
        assert (one.get("drive_state"), two.get("drive_state")) == ("Operation enabled", "Fault")
        one.fault("unplugged")
        bench.run_for("20ms")
        assert float(one.get("shaft_deg_s")) > 5


@pytest.mark.parametrize("name", ["bus.yml", "joint.eds", "arm.urdf"])
def test_a_trace_replays_while_all_files_of_its_nodes_are_the_same(
    tmp_path: Path, name: str
) -> None:
    for file in EXAMPLE.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    trace = tmp_path / "run.trace"
    with open_bench(tmp_path / "bus.yml") as bench:
        bench.run_for("10ms")
        bench.save_trace(trace)
    replay = CliRunner().invoke(replay_command, [str(trace)])
    assert replay.output.startswith("identical: ")
    (tmp_path / name).write_text((tmp_path / name).read_text() + "\n")
    replay = CliRunner().invoke(replay_command, [str(trace)])
    assert replay.exit_code == 2
    file = tmp_path / name
    assert f": {file} is another file than the one that was recorded\n" in replay.stderr


def test_a_trace_without_the_files_that_a_bus_yml_names_replays(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    with open_bench(write_system(tmp_path, TWO)) as bench:
        bench.run_for("10ms")
        bench.save_trace(trace)
    head, _, rest = trace.read_text().partition("\n")
    mark, _, header = head.partition("{")
    devices = json.loads("{" + header)
    for device in devices["devices"].values():
        assert set(device.pop("files")) == {"joint.eds"}
    trace.write_text(f"{mark}{json.dumps(devices)}\n{rest}")
    assert CliRunner().invoke(replay_command, [str(trace)]).output.startswith("identical: ")


def test_the_shaft_runs_into_the_limit_switch_that_the_file_says(tmp_path: Path) -> None:
    with joints(write_system(tmp_path, TWO), 2) as (bench, [joint]):
        velocity(joint, 1_000)
        bench.run_for("2s")
        assert bench["joint_1"].get("shaft_deg") == pytest.approx(28.65, abs=1.0)
        assert joint.read(0x60FD) == 2
        assert bench["joint_1"].get("shaft_deg_s") == pytest.approx(0, abs=0.1)


def test_a_rig_file_adds_devices_starts_and_faults(tmp_path: Path) -> None:
    write_system(tmp_path, TWO)
    rig = tmp_path / "rig.toml"
    rig.write_text(
        'bus = "bus.yml"\n[device.vr2]\ntype = "rrc"\n[device.joint_1.start]\nload_nm = 2\n'
        '[fault]\njoint_2 = "encoder_unplugged@50ms"\n'
    )
    with open_bench(rig) as bench:
        bench.run_for("100ms")
        assert set(bench.devices) == {"joint_1", "joint_2", "vr2"}
        assert bench["joint_1"].get("load_nm") == 2
        assert bench["joint_1"].get("supply_v") == 48
        assert bench["joint_2"].get("encoder_unplugged") == 1


def test_one_node_by_its_name(tmp_path: Path) -> None:
    path = write_system(tmp_path, TWO)
    with Bench(left=f"{path}:joint_2") as bench:
        bench.run_for("5ms")
        assert (bench.get("state"), bench.get("node_id")) == ("Pre-operational", 3)


def test_the_bit_rate_of_the_master_is_that_of_the_bus(tmp_path: Path) -> None:
    text = ONE_JOINT.replace("node_id: 1\n", "node_id: 1\n  baudrate: 250\n")
    plan = read_rig_file(write_system(tmp_path, text))
    assert plan.wires["can"].bit_rate == 250_000


def test_mistakes_have_the_lines_of_the_bus_yml(tmp_path: Path) -> None:
    path = write_system(tmp_path, f"{ONE_JOINT}  tickrig: {{gear_ratio: -1}}\n")
    reason = "joint_1.tickrig.gear_ratio: it takes a number 0.01..1e+06, not -1"
    with pytest.raises(RigFileError) as told:
        open_bench(path)
    assert str(told.value) == f"{path}:7: {reason}"
    rig = tmp_path / "rig.toml"
    rig.write_text('seed = 1\nbus = "bus.yml"\n')
    with pytest.raises(RigFileError) as told:
        open_bench(rig)
    assert f"{rig}:2: {path}:7: {reason}" in str(told.value)


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("bus = 5", "rig.toml:1: bus: it takes the name of a bus.yml, not 5"),
        ('bus = "no.yml"', "no.yml: No such file or directory"),
        (
            'device.a.type = "bus.yml:joint_9"',
            "no node 'joint_9'; known: joint_1",
        ),
        ('bus = "bus.yml"\ndevice.joint_1.start.lod = 1', "did you mean 'load_nm'?"),
    ],
)
def test_what_a_rig_file_says_wrong_of_it(tmp_path: Path, line: str, error: str) -> None:
    write_system(tmp_path)
    (tmp_path / "rig.toml").write_text(line)
    with pytest.raises(RigFileError) as told:
        open_bench(tmp_path / "rig.toml")
    assert error in str(told.value)


def test_a_recorded_run_is_replayed(tmp_path: Path) -> None:
    path, trace = write_system(tmp_path, TWO), tmp_path / "run.trace"
    with joints(path, 2, 3) as (bench, [joint, _]):
        velocity(joint, 300)
        bench.run_for("100ms")
        bench.save_trace(trace)
    same = CliRunner().invoke(replay_command, [str(trace)])
    assert same.exit_code == 0, same.output
    path.write_text(path.read_text().replace("0.5", "0.6"))
    other = CliRunner().invoke(replay_command, [str(trace)])
    assert "is another file than the one that was recorded" in other.output


@pytest.mark.realtime
def test_in_real_time_a_joint_of_a_bus_yml_turns(tmp_path: Path) -> None:
    path = write_system(tmp_path, TWO)
    with open_bench(path, mode="real") as bench, open_master(bench.link, path) as master:
        master.boot()
        joint = master.joints["joint_2"]
        master.perform(joint.choose("pv"))
        joint.set_target(0.5)
        turns = lambda: float(bench["joint_2"].get("shaft_deg_s")) > 20  # noqa: E731
        assert master.wait_until(turns, "10s")


def test_a_bus_yml_is_known_by_what_it_says(tmp_path: Path) -> None:
    bus = write_system(tmp_path)
    rig = tmp_path / "rig.yml"
    rig.write_text('[device.rrc]\ntype = "rrc"\n')
    assert set(read_rig_file(rig).devices) == {"rrc"}
    with pytest.raises(RigFileError, match=r"it is a bus.yml: its name has to end in .yml"):
        read_rig_file(bus.rename(tmp_path / "bus.toml"))
    broken = tmp_path / "broken.yml"
    broken.write_text("joint_1: {node_id: 2")
    with pytest.raises(RigFileError, match=r"broken.yml:1: .*not YAML"):
        read_rig_file(broken)


def test_without_yaml_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_system(tmp_path)
    monkeypatch.delitem(sys.modules, "tickrig.host.text.yaml_reader", raising=False)
    monkeypatch.setitem(sys.modules, "yaml", None)
    with pytest.raises(RigFileError, match=r"a bus.yml needs PyYAML: pip install 'tickrig\[bus\]'"):
        read_rig_file(path)


def test_modules_and_other_nodes_answer_with_their_signals(tmp_path: Path) -> None:
    text = (
        "master: {node_id: 1}\n"
        f"io: {{node_id: 5, dcf: '{IO_MODULE}', tickrig: {{start: {{di1: 1}}}}}}\n"
        f"plain: {{node_id: 6, dcf: '{IO_MODULE}', tickrig: {{profile: none}}}}\n"
    )
    with joints(write_system(tmp_path, text), 5, 6) as (bench, [io, plain]):
        assert io.read(0x6000, 1) & 1 == 1
        bench["io"].set("di2", 1)
        bench["plain"].set("0x6000:1", 0x40)
        bench.run_for("2ms")
        assert (io.read(0x6000, 1) & 3, plain.read(0x6000, 1)) == (3, 0x40)
        io.write(0x6200, 0x05, 1, sub=1)
        assert (bench["io"].get("do1"), bench["io"].get("do3")) == (1, 1)
