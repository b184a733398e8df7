"""What docs/howto/ros2-canopen.md shows is run, and its tables are those of the code."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner

from tests.emulators.canopen.bus_file.joint_sheet import joint_sheet
from tests.emulators.canopen.bus_file.system import write_system
from tickrig import open_bench
from tickrig.emulators.canopen.bus_file.node_keys import KEYS
from tickrig.emulators.canopen.cli import main
from tickrig.emulators.testing.commands.check_cli import check
from tickrig.host.text.section import rows
from tickrig.testing import open_master

ROOT = Path(__file__).parents[4]
TEXT = (ROOT / "docs/howto/ros2-canopen.md").read_text("utf-8")


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def blocks(language: str) -> list[str]:
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```", TEXT, re.DOTALL | re.MULTILINE)
    return [re.sub(rf"(?m)^{indent}", "", text) for indent, text in found]


def test_the_program_runs() -> None:
    (program,) = blocks("python")
    exec(compile(program, "ros2-canopen.md", "exec"), {})


def test_the_check_prints_what_the_page_says() -> None:
    (console,) = blocks("console")
    command, _, expected = console.partition("\n")
    done = CliRunner().invoke(check, command.removeprefix("$ tickrig check ").split())
    assert (done.exit_code, done.stdout) == (0, expected)


def test_the_command_starts_the_slaves_of_the_example() -> None:
    words = next(line for text in blocks("sh") for line in text.splitlines() if "--bus" in line)
    bus = words.split()[2]
    done = CliRunner().invoke(main, ["--bus", bus, "--scenario", "-"], input="5ms end\n")
    assert done.exit_code == 0
    assert re.findall(r"(70\d)#00", done.stdout) == ["702", "703", "704"]


def test_the_inputs_and_faults_that_are_shown_are_there() -> None:
    with open_bench("examples/ros2_canopen/bus.yml") as bench:
        for words in re.findall(r"tickrig ctl /tmp/arm.ctl (.*)", TEXT):
            verb, name, *value = words.split()
            if verb == "set":
                bench.set(name, int(value[0]))
            else:
                bench.fault(name)
        bench.run_for("10ms")
        assert bench.get("elbow/state") == "Off"


def test_the_rig_file_is_right(tmp_path: Path) -> None:
    (rig,) = blocks("toml")
    tomllib.loads(rig)
    (tmp_path / "rig.toml").write_text(rig.replace("examples", str(ROOT / "examples")))
    with open_bench(tmp_path / "rig.toml") as bench:
        assert set(bench.devices) == {"shoulder", "elbow", "rail", "vr2"}


def test_the_node_that_is_shown_is_right(tmp_path: Path) -> None:
    text = next(text for text in blocks("yaml") if "tickrig:" in text)
    node = yaml.safe_load(text)["nodes"]["shoulder"] | {"dcf": "joint.eds"}
    path = write_system(tmp_path, yaml.safe_dump({"master": {"node_id": 1}, "shoulder": node}))
    with open_bench(path) as bench:
        assert bench.get("load_nm") == 2.5


def test_the_keys_are_those_of_the_code() -> None:
    assert "\n".join(["", *rows(KEYS), ""]) in TEXT
    assert all(f"`{name}`" in TEXT for name in KEYS)


def test_the_eds_of_the_example_is_what_its_script_writes() -> None:
    assert (ROOT / "examples/ros2_canopen/joint.eds").read_text() == joint_sheet()


def test_the_load_that_is_shown_moves_no_joint_without_power() -> None:
    (load_nm,) = re.findall(r"set shoulder/load_nm (\S+)\n", TEXT)
    with open_bench("examples/ros2_canopen/bus.yml") as bench:
        bench.set("shoulder/load_nm", float(load_nm))
        bench.run_for("10s")
        assert bench.get("shoulder/shaft_deg") == 0
        bench.set("shoulder/load_nm", -20)
        bench.run_for("1s")
        assert float(bench.get("shoulder/shaft_deg")) < -100  # as the page says


def test_the_rail_of_the_example_is_as_fast_as_its_file_says() -> None:
    bus = "examples/ros2_canopen/bus.yml"
    with open_bench(bus) as bench, open_master(bench.link, bus) as master:
        master.boot()
        rail = master.joints["rail"]
        master.perform(rail.init())
        master.perform(rail.choose("pp"))
        rail.set_target(0.1)
        assert master.wait_until(lambda: abs(rail.position - 0.1) < 0.001, "3s")
        assert bench["rail"].get("shaft_deg") == pytest.approx(0.1 / 0.04 * 360, rel=0.01)
