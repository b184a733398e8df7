"""The section "pyserial" of docs/reference/bench/hosts.md, program by program."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import serial

TEXT = (Path(__file__).parents[4] / "docs/reference/bench/hosts.md").read_text("utf-8")
SECTION = TEXT.partition("\n## pyserial\n")[2].partition("\n## ")[0]


def test_its_programs_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial, "protocol_handler_packages", ["serial.urlhandler"])
    programs = re.findall(r"^```python\n(.*?)^```", SECTION, re.DOTALL | re.MULTILINE)
    assert len(programs) == 5
    exec(compile("".join(programs), "docs/reference/bench/hosts.md", "exec"), {"__name__": "page"})
