"""docs/reference/canmon/canmon-gateway.md: what it shows happens, and all is in it."""

from __future__ import annotations

from pathlib import Path

from tests.emulators.testing.conformance.test_page import ThisEnvironment
from tests.environment import ROOT
from tests.page_runner import PageRunner
from tickrig.host.canopen.gateway import Gateway

PAGE = ROOT / "docs" / "reference/canmon/canmon-gateway.md"


def test_what_the_page_shows_happens(tmp_path: Path) -> None:
    runner = PageRunner(ThisEnvironment(tmp_path), tmp_path)
    runner.run(PAGE)
    assert runner.typed


def test_the_page_has_all_commands_of_lss() -> None:
    page = PAGE.read_text("utf-8")
    assert [verb for verb in Gateway.LSS_VERBS if verb not in page] == []
