"""Six mistakes in the hosts of `tests/outside`, one at a time: what a search finds of them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]
MISTAKES = (
    "no time-out",
    "toggle ignored",
    "EMCY not handled",
    "restart race",
    "wrong COB-ID",
    "boot-up lost",
)
FAILURE = """
+0us call heat_and_turn()
+1s fault stirrer/encoder_unplugged for 3s
+0us call watch()
"""
MOST_STEPS = 6
SEARCH = "check_host(Boiler, max_examples=600, seed=1)"
PROGRAM = """
import sys
sys.path[:0] = {paths!r}
from boiler_machine import Boiler
from tickrig.testing import check_host, replay_host
try:
    {call}
except Exception as error:
    print(error.__notes__[-1])
"""


@pytest.fixture
def kettle(tmp_path: Path) -> Path:
    """Return where the kettle is, as if it were installed."""
    source = ROOT / "tests" / "stranger" / "kettle_emu.py"
    (tmp_path / source.name).write_text(source.read_text("utf-8"), "utf-8")
    info = tmp_path / "kettle_emu-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: kettle-emu\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[tickrig.devices]\nkettle = kettle_emu:DEVICE\n")
    return tmp_path


def found(kettle: Path, mistake: str, call: str) -> str:
    """Return what a search or a replay finds, in a process and a folder of its own."""
    outside = ROOT / "tests" / "outside"
    paths = [str(kettle), str(outside), str(outside / "tests")]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(paths=paths, call=call)],
        cwd=kettle,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src"), "BOILER_MISTAKE": mistake},
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.stderr, done.stderr
    return done.stdout


@pytest.mark.parametrize("mistake", MISTAKES)
def test_each_mistake_is_found_and_is_short(kettle: Path, mistake: str) -> None:
    said = found(kettle, mistake, SEARCH)
    steps = re.match(r"# a scenario of .*boiler_machine\.py:Boiler, (\d+) steps?\n", said)
    assert steps is not None, said
    assert int(steps[1]) <= MOST_STEPS, said


@pytest.mark.parametrize("mistake", ["EMCY not handled", ""])
def test_a_failure_of_the_motor_is_handled_but_for_a_mistake(kettle: Path, mistake: str) -> None:
    said = found(kettle, mistake, f"replay_host(Boiler, {FAILURE!r})")
    assert bool(said) is bool(mistake)


def test_without_a_mistake_nothing_is_found(kettle: Path) -> None:
    assert found(kettle, "", "check_host(Boiler, max_examples=20, seed=1)") == ""
