"""The section "Hosts that look at the clock" of docs/reference/bench/hosts.md."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.emulators.testing.host_clock.user_host import Host
from tickrig import Bench
from tickrig.device import Rrc
from tickrig.emulators.testing.host_clock.host_code import LOOKS, UnpatchedTimeError
from tickrig.emulators.testing.host_clock.patched_time import unpatched_time_fails

PAGE = (Path(__file__).parents[4] / "docs/reference/bench/hosts.md").read_text("utf-8")
SECTION = PAGE.partition("\n## Hosts that look at the clock\n")[2].partition("\n## ")[0]


def test_its_program_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (program,) = re.findall(r"^```python\n(.*?)^```", SECTION, re.DOTALL | re.MULTILINE)
    page = ModuleType("page")
    page.__file__ = str(tmp_path / "page.py")
    monkeypatch.setitem(sys.modules, "page", page)
    exec(compile(program, page.__file__, "exec"), vars(page))


def test_what_it_says_is_said() -> None:
    with (
        Bench(Rrc()) as bench,
        pytest.raises(UnpatchedTimeError) as caught,
        unpatched_time_fails(),
    ):
        Host(bench.serial(timeout=0)).ask("version")
    (text,) = re.findall(r"^```text\n(.*?)^```", SECTION, re.DOTALL | re.MULTILINE)
    assert (
        " ".join(text.split()).partition(": time.")[2] == str(caught.value).partition(": time.")[2]
    )


def test_each_look_is_named() -> None:
    (row,) = re.findall(r"^\| `time\.time`.*$", SECTION, re.MULTILINE)
    assert [name for name in LOOKS if name.removesuffix("_ns") not in row] == []
