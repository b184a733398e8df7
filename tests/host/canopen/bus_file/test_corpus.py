from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canopen.bus_file.bench import write_bus
from tests.host.canopen.bus_file.corpus import CORPUS, Case
from tickrig.host.canopen.bus_file.bus_file import read_bus_file
from tickrig.host.canopen.bus_file.bus_rules import RULES


@pytest.mark.parametrize("case", CORPUS, ids=[f"{case.rule}-{case.said[:20]}" for case in CORPUS])
def test_a_mistake_is_told_where_it_is(case: Case, tmp_path: Path) -> None:
    bus = read_bus_file(write_bus(tmp_path, case.text))
    told = [one for one in bus.findings if one.rule.name == case.rule and case.said in one.text]
    assert [one.line for one in told] == [case.line], [str(one) for one in bus.findings]
    assert len(bus.findings) == 1 or not case.alone, [str(one) for one in bus.findings]


def test_each_rule_has_a_file_that_breaks_it() -> None:
    assert {case.rule for case in CORPUS} == {*RULES}
