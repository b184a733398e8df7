"""The bodies as real hardware has them: an emulator in another process, reached by its port alone.

What hands do goes over its control socket, as an operator's hands would.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.interop.buses import MULTICAST
from tickrig.emulators.bench.child import Child, running

pytestmark = pytest.mark.realtime

ROOT = Path(__file__).parents[2]
TRIES = 5
TIMEOUT_S = 100


class Case(NamedTuple):
    """A device, the command that plays it, and bodies that are quick."""

    device: str
    module: str
    options: tuple[str, ...]
    bodies: str


ON_LINES = [
    Case("rrc", "rrc.cli", (), "limit_halves and stable or three_checksum"),
    Case("rh3_base", "rh3.cli", (), "stop_stops or red_button"),
    Case("urg", "urg.cli", (), "as_many_scans or jammed"),
    Case("rtc_lite", "rtc_lite.cli", (), "through_its_life or power_cut"),
]
ON_CAN = [
    Case("epos", "canopen.cli", ("--model", "epos", "--node-id", "1"), "at_a_velocity or supply"),
    Case("f_palette", "canopen.cli", ("--model", "f-palette"), "told_at_once or sdo_and_pdo"),
    Case("motor_core_unit", "canopen.cli", ("--model", "motor-core-unit"), "angle_is or encoder"),
]


@pytest.mark.parametrize("case", ON_LINES, ids=[case.device for case in ON_LINES])
def test_a_device_on_a_line_in_another_process(case: Case, tmp_path: Path) -> None:
    with running(f"tickrig.emulators.{case.module}") as child:
        place = f'port = "{child.link}"'
        said = run_until_judged(
            case, rig_file(case, child, f"[hardware.{case.device}]\n{place}", tmp_path)
        )
    assert re.search(r"\b2 passed", said), said


@pytest.mark.parametrize("case", ON_CAN, ids=[case.device for case in ON_CAN])
def test_a_node_on_a_bus_in_another_process(case: Case, tmp_path: Path) -> None:
    if reason := MULTICAST.why_not():
        pytest.skip(reason)
    module = f"tickrig.emulators.{case.module}"
    with running(module, *case.options, *MULTICAST.arguments, linked=False) as child:
        options = ", ".join(f"{name} = {value}" for name, value in MULTICAST.options)
        place = f'interface = "{MULTICAST.interface}"\nchannel = "{MULTICAST.channel}"'
        bus = f"[hardware.can]\n{place}\noptions = {{ {options} }}"
        said = run_until_judged(case, rig_file(case, child, bus, tmp_path))
    assert re.search(r"\b2 passed", said), said


def rig_file(case: Case, child: Child, where: str, folder: Path) -> Path:
    """Write the rig file of a device whose hardware is somewhere."""
    what = (ROOT / "tests/hil/rigs" / f"{case.device}.toml").read_text("utf-8")
    path = folder / "rig.toml"
    path.write_text(f'{what}\n[hardware]\ncontrol = "{child.control}"\n\n{where}\n')
    return path


def run_until_judged(case: Case, rig: Path) -> str:
    """Run the bodies until the machine was quick enough for all; return what pytest printed."""
    words = ("-q", "-p", "no:cacheprovider", "--bench", str(rig), "--bench-mode", "hardware")
    command = [
        sys.executable,
        "-m",
        "pytest",
        *words,
        f"tests/hil/{case.device}",
        "-k",
        case.bodies,
    ]
    for _ in range(TRIES):
        done = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=TIMEOUT_S
        )
        said = done.stdout + done.stderr
        assert "failed" not in said.splitlines()[-1], said
        if "too slow" not in said:
            break
    return said
