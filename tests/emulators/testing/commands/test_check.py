from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.canopen.bus_file.bench import NODE, write_bus
from tests.host.canopen.bus_file.shapes import COGEN, PLAIN
from tickrig.emulators.canopen.cli import main as emulator
from tickrig.emulators.commands.cli import main
from tickrig.emulators.testing.commands.check_cli import check


def run(*words: str) -> tuple[int, list[str], str]:
    result = CliRunner().invoke(check, words)
    return result.exit_code, result.stdout.splitlines(), result.stderr


def test_a_good_file_is_summed_up(folder: Path) -> None:
    write_bus(folder, PLAIN.replace("value: -3", "value: 1"))
    assert run("bus.yml") == (
        0,
        [
            "bus.yml: ok: 1 slave, master 1, SYNC each 10 ms",
            "  left  node-ID 2, epos.eds, 23 writes at boot-up",
        ],
        "",
    )


def test_a_file_that_has_not_changed_is_checked_with_few_calls(folder: Path) -> None:
    write_bus(folder, PLAIN.replace("sync_period", "sync_peroid"))
    first = run("bus.yml")
    calls = 0

    def count(_frame: object, event: str, _arg: object) -> None:
        nonlocal calls
        calls += event == "call"

    sys.setprofile(count)
    try:
        second = run("bus.yml")
    finally:
        sys.setprofile(None)
    assert second == first
    assert calls < 12_000


def test_a_mistake_is_told_with_both_places(folder: Path) -> None:
    write_bus(
        folder, NODE + "  sdo:\n    - {index: 0x6041, value: 1}\n    - {index: 0x9999, value: 1}\n"
    )
    status, out, _ = run("bus.yml")
    assert status == 1
    assert out[0].startswith(
        "bus.yml:6: warning: [read-only] [axis] 6041h:00 cannot be written: epos.eds:"
    )
    assert out[1] == (
        "bus.yml:7: error: [object-missing] [axis] 9999h:00 does not exist: epos.eds has no 9999h;"
        " fix: write to what is there (dcfgen)"
    )
    assert len(out) == 2


def test_what_is_for_the_slaves_alone_is_told_with_all_else(folder: Path) -> None:
    write_bus(
        folder, NODE + "  tickrig: {motr: {}}\n  boot: soon\n  sdo: [{index: 0x9999, value: 1}]\n"
    )
    status, out, _ = run("bus.yml")
    assert status == 1
    assert out[0] == (
        "bus.yml:5: error: [tickrig] axis.tickrig: no key 'motr'; did you mean 'motor'?;"
        " fix: docs/howto/ros2-canopen.md has all keys (canopen-slave-emu)"
    )
    assert out[1].startswith("bus.yml:6: warning: [flag-text]")
    assert out[2].startswith("bus.yml:7: error: [object-missing]")
    assert len(out) == 3


def test_ok_says_how_many_warnings_there_are(folder: Path) -> None:
    write_bus(folder, NODE + "  sdo: [{index: 0x6041, value: 1}]\n")
    assert run("bus.yml")[1][1] == "bus.yml: ok, with 1 warning: 1 slave, master 1"


ROBOT = """<robot name="arm"><joint name="elbow" type="revolute"/>
<ros2_control><joint name="elbow"><param name="device_name">elbo</param></joint></ros2_control>
</robot>"""


@pytest.mark.parametrize(
    ("said", "wanted"), [('device_name">elbo', "node 'elbo'"), ('node_id">9', "node-ID 9")]
)
def test_a_joint_of_the_robot_without_a_node_is_warned_of(
    folder: Path, said: str, wanted: str
) -> None:
    write_bus(folder, f"options: {{tickrig: {{urdf: arm.urdf}}}}\n{NODE}  tickrig: {{motr: 1}}\n")
    (folder / "arm.urdf").write_text(ROBOT.replace('device_name">elbo', said))
    _, out, _ = run("bus.yml")
    assert out[0].startswith(f"arm.urdf:2: warning: [joint] joint 'elbow': no {wanted} in bus.yml;")
    assert "no key 'motr'" in out[1]


def test_drives_that_fill_the_bus_are_told(folder: Path) -> None:
    write_bus(folder, f"{PLAIN.replace('sync_period', 'baudrate: 20 #')}")
    status, out, _ = run("bus.yml")
    assert (status, out[0].partition(": polling")[0]) == (
        0,
        "bus.yml:4: warning: [bus-load] 20 kbit/s: 411% of the bus in each period",
    )
    assert run("bus.yml", "--strict")[0] == 1


@pytest.mark.parametrize("head", ["", '<?xml version="1.0"?>\n<!-- of xacro -->\n', "\ufeff"])
def test_of_a_robot_it_says_what_can_be_checked(folder: Path, head: str) -> None:
    (folder / "arm.urdf").write_text(head + ROBOT, "utf-8")
    text = "it is a URDF: a bus.yml names it, options: {tickrig: {urdf: FILE}}"
    status, out, _ = run("arm.urdf")
    assert (status, out) == (1, [f"arm.urdf:1: {text}, and tickrig check of that checks both"])


def test_a_finding_of_the_eds_is_told_once(folder: Path) -> None:
    write_bus(folder, NODE.replace("epos", "broken"))
    status, out, _ = run("bus.yml")
    assert (status, len(out)) == (1, 2)
    assert out[0].startswith("broken.eds:172: error: [eds] [axis] [1018sub1] DefaultValue=ten")
    assert out[1].startswith("broken.eds:172: warning: [eds-check] it finds 1 error, ")


def test_warnings_count_where_that_is_wanted(folder: Path) -> None:
    write_bus(folder, COGEN)
    assert run("bus.yml")[0] == 0
    assert run("bus.yml", "--strict")[0] == 1


def test_it_is_known_by_its_content_and_a_rig_file_by_its_own(folder: Path) -> None:
    write_bus(folder, NODE).rename("bench.toml")
    (folder / "bus.toml").write_text('[device.rrc]\ntype = "rrc"\n# master: 1\n')
    status, out, _ = run("bench.toml", "bus.toml")
    assert (status, out[0]) == (0, "bench.toml: ok: 1 slave, master 1")
    assert out[2] == "bus.toml: ok: 1 device, 1 wire"


def test_a_pipe_is_read_but_once(folder: Path) -> None:
    read, write = os.pipe()
    os.write(write, b'[device.rrc]\ntype = "rrc"\n')
    os.close(write)
    status, out, _ = run(f"/dev/fd/{read}")
    os.close(read)
    assert (status, out[0]) == (0, f"/dev/fd/{read}: ok: 1 device, 1 wire")


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("tickrig", "check bus.yml"),
        ("tickrig", "run bus.yml"),
        ("tickrig", "run rig.toml"),
        ("canopen-slave-emu", "--bus bus.yml --scenario -"),
    ],
)
def test_without_pyyaml_the_extra_is_named(
    folder: Path, monkeypatch: pytest.MonkeyPatch, script: str, words: str
) -> None:
    write_bus(folder, NODE)
    (folder / "rig.toml").write_text('bus = "bus.yml"\n')
    monkeypatch.setitem(sys.modules, "yaml", None)
    monkeypatch.delitem(sys.modules, "tickrig.host.text.yaml_reader", raising=False)
    command = {"tickrig": main, "canopen-slave-emu": emulator}[script]
    result = CliRunner().invoke(command, words.split())
    assert result.exit_code == 2, result.output
    said = (result.stdout + result.stderr).splitlines()
    assert "a bus.yml needs PyYAML: pip install 'tickrig[bus]'" in said[0]
    assert "Traceback" not in result.output
