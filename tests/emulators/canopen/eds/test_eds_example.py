from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[4] / "examples" / "canopen_from_eds.py"


def test_a_slave_is_made_of_an_eds_alone(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    assert capsys.readouterr().out.splitlines() == [
        "0.000 705#00",
        "0.010 000#0105",
        "0.010 185#00",
        "0.100 185#81",
        "0.200 205#5A",
        "0.500 705#05",
        "the outputs are 5Ah",
    ]
