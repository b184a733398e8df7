"""A small sample of mutated calls: no traceback, and one line; tools/fuzz net makes more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from tests.host.canmon.net.net_mutations import judge, mutated

TOOL = Path(__file__).parents[4] / "tools" / "fuzz"


@pytest.mark.parametrize("seed", range(4))
def test_a_mutated_call_is_no_traceback(seed: int) -> None:
    chance = Random(seed)
    for _ in range(25):
        judge(*mutated(chance))


def test_the_tool_judges_calls() -> None:
    words = [sys.executable, str(TOOL), "net", "--files", "5"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said.startswith("seed 1: 5 files, {")
