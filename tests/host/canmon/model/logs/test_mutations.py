"""Whatever a log is, it is read as far as it goes; tools/fuzz logs tries more of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from tests.host.canmon.model.logs.mutations import NAMES, heard, judge, log, mutated

TOOL = Path(__file__).parents[5] / "tools" / "fuzz"


@pytest.mark.parametrize("seed", range(4))
def test_a_mutated_log_is_read_as_far_as_it_goes(seed: int) -> None:
    chance = Random(seed)
    for _ in range(25):
        judge(*mutated(chance))


@pytest.mark.parametrize("name", NAMES)
def test_a_whole_log_of_each_kind_is_read_to_its_end(name: str) -> None:
    chance = Random(18)
    assert judge(name, log(name, heard(chance), chance)) == "whole"


def test_the_tool_judges_logs_by_several_processes() -> None:
    words = [sys.executable, str(TOOL), "logs", "--files", "10", "-j", "2"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said.startswith("seed 1: 10 files, {")
