"""`pytest --hil rig.toml`, with an emulator in another process as the real hardware."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pexpect
import pytest

from tickrig.host.control.client import ControlClient

ROOT = Path(__file__).parents[3]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
EMULATOR = "from tickrig.emulators.rrc.cli import main; main()"
TIMEOUT_S = 30


@dataclass
class Hardware:
    """An emulator that plays the real hardware."""

    port: Path
    control: Path

    def rig_toml(self, *more: str) -> str:
        path = self.port.with_name("rig.toml")
        path.write_text("\n".join([f'[dut.rrc]\nport = "{self.port}"', *more]))
        return str(path)


@pytest.fixture
def hardware(tmp_path: Path) -> Iterator[Hardware]:
    it = Hardware(tmp_path / "rrc", tmp_path / "ctl")
    command = [sys.executable, "-c", EMULATOR, "--link", str(it.port), "--control", str(it.control)]
    with subprocess.Popen(
        command, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as emulator:
        assert emulator.stdout is not None
        try:
            assert emulator.stdout.readline() == f"{it.port}\n".encode()
            yield it
        finally:
            emulator.kill()


def hil_command(rig_toml: str, chosen: str) -> list[str]:
    options = ["-q", "-p", "no:cacheprovider", "--hil", rig_toml, "-k", chosen]
    return [sys.executable, "-m", "pytest", "tests/hil/rrc", *options]


def run(rig_toml: str, chosen: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        hil_command(rig_toml, chosen),
        cwd=ROOT,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )


@pytest.mark.realtime
def test_bodies_run_on_the_port_of_the_rig_file(hardware: Hardware) -> None:
    rig = hardware.rig_toml(f'[operator]\ncontrol = "{hardware.control}"')
    done = run(rig, "limit_halves and stable or three_checksum")
    assert "2 passed" in done.stdout, done.stdout


@pytest.mark.realtime
@pytest.mark.parametrize(("answer", "outcome"), [("y", "1 passed"), ("n", "1 failed")])
def test_an_operator_at_the_terminal_is_told_and_asked(
    hardware: Hardware, answer: str, outcome: str
) -> None:
    program, *arguments = hil_command(hardware.rig_toml(), "limit_halves and plain")
    with (
        ControlClient(hardware.control) as control,
        pexpect.spawn(program, arguments, TIMEOUT_S, cwd=ROOT, env=ENVIRONMENT) as terminal,
    ):
        terminal.expect("Switch VR2 off with the power button, unless it is off")
        terminal.sendline()
        terminal.expect("Press and release the power button of the controller.")
        control.request("press", name="power_button")
        terminal.sendline()
        terminal.expect("Hold the stick at 100 % forward and 0 % right")
        control.request("set", name="stick", value=[95, 4])
        terminal.sendline()
        terminal.expect("Do the motors drive 50 % forward and 0 % right")
        terminal.sendline(answer)
        terminal.expect("Switch VR2 off")
        control.request("press", name="power_button")
        terminal.sendline()
        terminal.expect(outcome)
        terminal.expect(pexpect.EOF)


def test_a_bad_rig_file_is_one_clear_line(tmp_path: Path) -> None:
    rig_toml = tmp_path / "rig.toml"
    rig_toml.write_text("[dut.rrc]\n")
    done = run(str(rig_toml), "power_button")
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    complaint = f'ERROR: {rig_toml}: [dut.rrc] needs a port, as port = "/dev/ttyACM0"'
    assert done.stderr.strip().splitlines() == [complaint]
