"""examples/rtc_lite_proxy.py."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[3] / "examples" / "rtc_lite_proxy.py"


def test_numbers_pass_and_a_power_cut_removes_the_proxy(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    assert capsys.readouterr().out.splitlines() == [
        "1 -5 2147483647",
        "1.600 s: Echo0: FatalError",
        "2.600 s: Echo0: Removed",
    ]
