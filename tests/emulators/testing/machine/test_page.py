"""The page on searches: what it says is what happens."""

from __future__ import annotations

from tests.emulators.testing.campaign.test_page import runner as runner  # noqa: PLC0414 - fixture
from tests.environment import ROOT
from tests.page_runner import PageRunner

PAGE = ROOT / "docs" / "howto" / "property-based.md"


def test_its_commands_do_what_it_says(runner: PageRunner) -> None:
    runner.run(PAGE)
    assert len(runner.typed) == 4
