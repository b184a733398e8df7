"""docs/canmon-net.md: what it shows happens."""

from __future__ import annotations

import re
from pathlib import Path

from tests.emulators.testing.conformance.test_page import ThisEnvironment
from tests.environment import ROOT
from tests.page_runner import PageRunner
from tickrig.host.canmon.net.group import VERBS

PAGE = ROOT / "docs" / "canmon-net.md"


def test_what_the_page_shows_happens(tmp_path: Path) -> None:
    runner = PageRunner(ThisEnvironment(tmp_path), tmp_path)
    runner.run(PAGE)
    assert runner.typed


def test_the_page_has_all_verbs() -> None:
    told = re.findall(r"^\| `([a-z]+)", PAGE.read_text("utf-8"), re.MULTILINE)
    assert set(VERBS) <= set(told)
