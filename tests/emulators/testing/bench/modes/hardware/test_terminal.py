"""A human at a real terminal: prompts, answers, and a host that goes on meanwhile."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pexpect
import pytest

from tickrig.emulators.bench.child import running
from tickrig.host.control.client import ControlClient

ROOT = Path(__file__).parents[6]
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}
TIMEOUT_S = 30
PLUGIN = "tickrig.emulators.testing.plugin.pytest_plugin"

DRIVE = """
import sys
from tests.emulators.testing.bench.modes.hardware.plans import serial_plan
from tickrig import Bench
from tickrig.emulators.testing.rig_file.plan import HardwarePlan, PortPlan
from tickrig.host import RrcClient
from tickrig.wire.rrc.replies import RrcEvent

plan = serial_plan(HardwarePlan(ports={"rrc": PortPlan(port=sys.argv[1])}))
with Bench.of_plan(plan, "hardware") as bench, RrcClient(bench.link) as client:
    client.start()
    bench.meanwhile(client.run_for)
    bench.press("power_button")
    client.wait_for(RrcEvent.POWER_ON_SUCCESS, 5_000_000)
    client.watchdog(300_000)
    client.output(30, 0, confirm=True)
    print("answer:", bench.observe("the motors drive forward at 30 %", lambda: False))
"""

ASK = """
from tickrig.emulators.testing.bench.errors import OperatorRefused
from tickrig.emulators.testing.bench.modes.operators import Terminal

try:
    print("typed:", Terminal().prompt("What now?"))
except OperatorRefused as error:
    print("refused:", error)
"""


def python(program: str, *arguments: str) -> pexpect.spawn[bytes]:
    return pexpect.spawn(
        sys.executable, ["-c", program, *arguments], TIMEOUT_S, cwd=ROOT, env=ENVIRONMENT
    )


@pytest.fixture
def prompt() -> Iterator[pexpect.spawn[bytes]]:
    with python(ASK) as terminal:
        terminal.expect_exact("What now? ")
        yield terminal


@pytest.mark.realtime
def test_what_is_typed_is_the_answer(prompt: pexpect.spawn[bytes]) -> None:
    prompt.sendline(" Wait ")
    prompt.expect_exact("typed: Wait\r\n")


@pytest.mark.realtime
def test_nobody_at_the_terminal_is_told(prompt: pexpect.spawn[bytes]) -> None:
    prompt.sendeof()
    prompt.expect_exact("refused: the terminal was closed (end of input)")


@pytest.mark.realtime
def test_a_host_goes_on_while_its_operator_takes_his_time() -> None:
    with (
        running("tickrig.emulators.rrc.cli") as rrc,
        ControlClient(rrc.control) as control,
        python(DRIVE, str(rrc.link)) as terminal,
    ):
        terminal.expect_exact("rrc: press the power button of the controller and let it go, then")
        control.request("press", name="power_button")
        terminal.sendline()
        terminal.expect_exact("rrc: is it so? the motors drive forward at 30 % [y/n]")
        begun_us = int(str(control.request("status")["now_us"]))
        while int(str(control.request("status")["now_us"])) < begun_us + 500_000:
            assert control.request("get", names=["out_v_pct"])["values"] == {"out_v_pct": 30}
        terminal.sendline("y")
        terminal.expect_exact("answer: True")
        terminal.expect(pexpect.EOF)


RIG = """
[device.rrc]
type = "rrc"

[hardware.rrc]
port = "{port}"
"""

BODY = """
from pathlib import Path

import pytest

@pytest.fixture
def bench_config() -> Path:
    return Path("rig.toml")

def test_it_is_asked(bench) -> None:
    print("caught")
    bench.press("power_button")
    assert bench.observe("the motors stand still", lambda: True)
"""


@pytest.mark.realtime
@pytest.mark.parametrize(("answer", "outcome"), [("y", "1 passed"), ("n", "1 failed")])
def test_pytest_catches_no_question(tmp_path: Path, answer: str, outcome: str) -> None:
    (tmp_path / "rig.toml").write_text(RIG.format(port=tmp_path / "tty"))
    (tmp_path / "test_it.py").write_text(BODY)
    words = ["-m", "pytest", "-q", "-p", PLUGIN, "--bench-mode", "hardware"]
    alone = {**ENVIRONMENT, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    with pexpect.spawn(sys.executable, words, TIMEOUT_S, cwd=tmp_path, env=alone) as terminal:
        terminal.expect_exact("press the power button of the controller and let it go, then")
        terminal.sendline()
        terminal.expect_exact("is it so? the motors stand still [y/n]")
        terminal.sendline(answer)
        terminal.expect_exact(outcome)
        terminal.expect(pexpect.EOF)
