"""Small devices and hosts in examples/gadgets: each has a test that finds a fault of the field."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[3] / "examples/gadgets"
GADGETS = sorted(FOLDER.glob("test_*.py"))


@pytest.mark.parametrize("gadget", GADGETS, ids=[gadget.stem for gadget in GADGETS])
def test_a_gadget_is_small_and_its_tests_pass(gadget: Path) -> None:
    assert len(gadget.read_text("utf-8").splitlines()) < 120
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", gadget.name]
    done = subprocess.run(words, cwd=FOLDER, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_gadgets_also_pass_in_both_modes_from_the_root() -> None:
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", "pyproject.toml"]
    words += ["-o", "bench_mode=virtual,real", "-k", "gnss", str(FOLDER)]
    done = subprocess.run(words, cwd=FOLDER.parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_there_are_five() -> None:
    assert len(GADGETS) == 5
