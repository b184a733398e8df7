from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canopen.bus_file.bench import NODE, generate, write_bus
from tests.host.canopen.bus_file.corpus import CORPUS, Case
from tests.host.canopen.data_sheet.corpus import CORPUS as EDS_CORPUS
from tests.host.canopen.data_sheet.corpus import Deviation
from tickrig.host.canopen.bus_file.bus_checks import STOPS, check_sheets
from tickrig.host.canopen.bus_file.bus_file import read_bus_file
from tickrig.host.canopen.bus_file.notes import RULES

BESIDE = {"bus-load", "eds-check", "joint", "tickrig"}
"""Rules of `tickrig check` alone."""


@pytest.mark.parametrize("case", CORPUS, ids=[f"{case.rule}-{case.said[:20]}" for case in CORPUS])
def test_a_mistake_is_told_where_it_is(case: Case, tmp_path: Path) -> None:
    bus = read_bus_file(write_bus(tmp_path, case.text))
    told = [one for one in bus.findings if one.rule.name == case.rule and case.said in one.text]
    assert [one.line for one in told] == [case.line], [str(one) for one in bus.findings]
    assert len(bus.findings) == 1 or not case.alone, [str(one) for one in bus.findings]


def test_each_rule_has_a_file_that_breaks_it() -> None:
    assert {case.rule for case in CORPUS} == RULES.keys() - BESIDE


STOPPING = [case for case in EDS_CORPUS if case.rule in STOPS and b"\naccesstype" not in case.data]
"""Keys that differ in capital letters are two keys for dcfgen, and it takes one of them."""


@pytest.mark.parametrize("case", STOPPING, ids=[case.rule for case in STOPPING])
def test_dcfgen_stops_where_that_is_said(case: Deviation, tmp_path: Path) -> None:
    path = write_bus(tmp_path, NODE)
    (tmp_path / "epos.eds").write_bytes(case.data)
    bus = read_bus_file(path)
    if not bus.errors:
        (told,) = check_sheets(bus.slaves)
        assert case.rule in told.text.partition("dcfgen stops at ")[2].split(", ")
    with pytest.raises(Exception):  # noqa: B017, PT011 - whatever it dies of
        generate(path)
