"""A device package of somebody else, `tests/stranger`, works beside our wheel as ours do."""

from __future__ import annotations

import re
import shutil
import subprocess
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.environment import ROOT, Environment, make_environment
from tickrig.host.control.client import ControlClient
from tickrig.host.links.serial_link import SerialLink

SCENARIO = """\
1ms  set water_ml 100
+0s  ask temp
+0s  expect 20 within 50ms
10ms send heat
+0s  expect ok within 50ms
1s   fault sensor_broken
+0s  ask temp
+0s  expect ? within 50ms
2s   clear sensor_broken
3s   fault cut@3s-5s
4s   send stop
5.5s send temp?
+0s  expect 47 within 50ms
15s  expect boils within 2s
17s  end
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """Install our wheel and the stranger's package into an environment of their own."""
    return make_environment(tmp_path_factory, "stranger")


def test_a_scenario_with_faults_is_played_traced_and_replayed(
    environment: Environment, tmp_path: Path
) -> None:
    emu = ("tickrig", "emu", "kettle", "--power-w", "2100", "--scenario", "-", "--trace", "run")
    said = environment.run(*emu, cwd=tmp_path, typed=SCENARIO)
    assert "* state Heating" in said
    assert "! cut" in said
    assert "< boils" in said
    assert environment.run("tickrig", "replay", "run", cwd=tmp_path).startswith("identical: ")
    trace = (tmp_path / "run").read_text("utf-8")
    assert trace.startswith('# tickrig-trace v1 kettle {"power_w": 2100, "seed": 0}\n')
    changed = trace.replace("< 20", "< 21")
    (tmp_path / "other").write_text(changed)
    environment.run("tickrig", "replay", "other", cwd=tmp_path, status=1)


@pytest.fixture
def running(environment: Environment, tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a kettle on a pty, with a control socket."""
    emu = ("tickrig", "emu", "kettle", "--link", "tty", "--control", "control")
    with environment.start(*emu, cwd=tmp_path) as process:
        yield process
        process.terminate()


@pytest.mark.realtime
def test_a_pty_and_the_control_socket_reach_it(
    running: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    assert running.stdout is not None
    assert running.stdout.readline() == b"tty\n"  # it is up
    with ControlClient(tmp_path / "control") as control:
        assert control.request("get", names=["state"])["values"] == {"state": "Cold"}
        link = SerialLink(str(tmp_path / "tty"), 9_600)
        link.send(b"heat\n")
        heard = b""
        while not heard.endswith(b"\n"):
            heard += link.receive(5_000_000)
        assert heard == b"ok\n"
        control.request("set", name="water_ml", value=0)
        control.request("press", name="lid_open")
        assert control.request("status")["device"] == "kettle"
        link.close()
        control.request("stop")
    assert running.wait() == 0


SYSTEM = """\
[[component]]
name = "F"
type = "{}"
rate_hz = 100.0
active = true
"""


@pytest.mark.realtime
def test_its_component_runs_in_a_system_and_is_created_in_one(
    environment: Environment, tmp_path: Path
) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM.format("Fahrenheit"))
    run = ("tickrig", "rtc", "run", "system.toml", "--control", "control")
    variables, pipe = environment.variables, subprocess.PIPE
    with subprocess.Popen(run, cwd=tmp_path, env=variables, stderr=pipe) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == b"F. Ctrl-C ends.\n"  # it is up

        def rtc(*words: str) -> str:
            return environment.run("tickrig", "rtc", *words, "--at", "control", cwd=tmp_path)

        assert rtc("create", "Fahrenheit") == "Fahrenheit0\n"
        rtc("con", "F.fahrenheit", "Fahrenheit0.celsius")
        rtc("inject", "F.celsius", "100")
        assert rtc("ls", "-l").split()[:2] == ["Active", "2/1"]
        rtc("stop")
    assert process.returncode == 0


def test_its_broken_component_is_a_line(environment: Environment, tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM.format("Kelvin"))
    run = ["tickrig", "rtc", "run", "system.toml", "--control", "control"]
    done = subprocess.run(
        run,
        cwd=tmp_path,
        env=environment.variables,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    place = "component type 'Kelvin' of package kettle-emu (kettle_rtc:Kelvin): "
    assert line.startswith(f"Error: system system.toml: {place}")


def test_its_own_tests_pass(environment: Environment, tmp_path: Path) -> None:
    shutil.copy(ROOT / "tests" / "stranger" / "test_kettle.py", tmp_path)
    assert "passed" in environment.run("pytest", "-q", cwd=tmp_path)


def test_its_broken_entry_point_is_a_line_and_breaks_nothing(
    environment: Environment, tmp_path: Path
) -> None:
    done = subprocess.run(
        ["tickrig", "emu", "--help"],
        cwd=tmp_path,
        env=environment.variables,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "kettle " in done.stdout
    (line,) = done.stderr.splitlines()
    assert line.startswith("device 'broken' of package kettle-emu (kettle_emu:MISSING): ")


def test_a_device_is_added_as_contributing_says(environment: Environment, tmp_path: Path) -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    section = text.partition("## Add a device\n")[2].partition("\n### ")[0]
    blocks = re.findall(r"```console\n(.*?)```", section, re.DOTALL)
    assert len(blocks) == 4
    said = environment.run("sh", "-ec", textwrap.dedent("\n".join(blocks)), cwd=tmp_path)
    assert [line for line in said.splitlines() if line.startswith(("0.", "identical"))] == [
        "0.000000 * state On",
        "0.001000 > hello",
        "0.001521 < ready",
        "0.002521 < hello",
        "identical: 2 ticks",
    ]
    assert " passed" in said
