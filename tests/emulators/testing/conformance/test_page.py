"""docs/reference/canopen/conform.md and conformance-by-hand.md: what they show happens."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from tests.environment import ROOT, Environment
from tests.page_runner import PageRunner

PAGE = ROOT / "docs" / "reference/canopen/conform.md"
BY_HAND = ROOT / "docs" / "reference/canopen/conformance-by-hand.md"


class ThisEnvironment(Environment):
    """The environment of the tests."""

    @property
    def variables(self) -> dict[str, str]:
        """What a shell in it has."""
        place = Path(sys.executable).parent
        return {**os.environ, "PATH": f"{place}:/usr/bin:/bin", "PYTHONPATH": str(ROOT / "src")}


def test_the_page_goes_as_shown(tmp_path: Path) -> None:
    runner = PageRunner(ThisEnvironment(tmp_path), tmp_path)
    runner.run(PAGE)
    assert len(runner.typed) >= 6
    assert (tmp_path / "report.html").read_text("utf-8").startswith("<!doctype html>")


def test_a_baseline_goes_from_release_to_release(tmp_path: Path) -> None:
    runner = PageRunner(ThisEnvironment(tmp_path), tmp_path)
    runner.run(BY_HAND)
    assert len(runner.typed) == 6
    known = (tmp_path / "known.txt").read_text("utf-8").splitlines()
    assert len(known) == 1, "the mended failure is gone"
