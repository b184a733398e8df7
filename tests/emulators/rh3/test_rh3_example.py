from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[3] / "examples" / "rh3_goto.py"


def test_the_example_drives_to_its_goal_with_both_sets(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines[::2]] == ["default", "tuned"]
    off_mm = [float(line.split()[3]) for line in lines[::2]]
    assert off_mm[0] < 40
    assert off_mm[1] < 5
