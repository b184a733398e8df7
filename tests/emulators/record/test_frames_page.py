"""The page docs/reference/bench/frames.md, program by program."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[3] / "docs/reference/bench/frames.md"


@pytest.mark.parametrize("number", [0, 1])
def test_its_programs_run(number: int) -> None:
    programs = re.findall(
        r"^```python\n(.*?)^```", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE
    )
    assert len(programs) == 2
    if "construct" in programs[number]:
        pytest.importorskip("construct")
    exec(compile(programs[number], str(PAGE), "exec"), {"__name__": "page"})
