"""Whatever a rule or a file of rules is: held, or refused in a line; tools/fuzz check does more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from tests.host.canmon.model.check import log_mutations
from tests.host.canmon.model.check.mutations import RULES, judge, mutated

TOOL = Path(__file__).parents[5] / "tools" / "fuzz"


@pytest.mark.parametrize("seed", range(4))
def test_a_mutated_rule_is_held_or_refused(seed: int) -> None:
    chance = Random(seed)
    for _ in range(40):
        judge(*mutated(chance))


@pytest.mark.parametrize("seed", range(8))
def test_a_mutated_log_is_diagnosed_and_keeps_what_is_learnt_from_it(seed: int) -> None:
    chance = Random(seed)
    found = {log_mutations.judge(*log_mutations.mutated(chance)) for _ in range(250)}
    assert {"sound", "faulty"} <= found


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_of_each_kind_is_held(rule: str) -> None:
    assert judge("rule.txt", rule.encode()) in ("held", "broken")


def test_the_tool_judges_rules_by_several_processes() -> None:
    words = [sys.executable, str(TOOL), "check", "--files", "10", "-j", "2"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said.startswith("seed 1: 10 files, {")
