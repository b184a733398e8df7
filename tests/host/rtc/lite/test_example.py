"""examples/rtc_lite_proxy.py."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[4] / "examples" / "rtc_lite_proxy.py"


def test_numbers_pass_and_a_power_cut_removes_the_proxy(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    assert capsys.readouterr().out.splitlines() == [
        "1 -5 2147483647",
        "1.512 s: Echo0: FatalError: no reply to AE within 100 ms, and none of 4 PINGs was answered"
        "; last frames: 0.902 < AE@A, 1.000 > AE, 1.002 < AE@A, 1.012 > CY\\x01,"
        r" 1.112 > AE, 1.212 > CY\x02, 1.312 > CY\x03, 1.412 > CY\x04",
        "2.512 s: Echo0: Removed; PINGs: 4 sent, 0 answered, 4 lost",
    ]
