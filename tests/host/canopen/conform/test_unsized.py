"""Slaves that do not say how many of the four bytes of an expedited upload are data."""

from __future__ import annotations

from typing import Final

import pytest

from tests.device.canopen.reference import NODE_ID
from tests.host.canopen.conform.defects.defect import Defect, says, together
from tests.host.canopen.conform.defects.test_found import DefectiveR1
from tests.host.canopen.conform.r1 import yes
from tests.host.canopen.conform.under_test import not_harmless
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report

SIZES: Final = {"4F": 1, "4B": 2, "47": 3, "43": 4}


def unsized() -> DefectiveR1:
    """Make R1 with 42h in place of 43h to 4Fh, and anything in the bytes that are no data."""
    says_less = [
        says(f"585#{said}(.{{{6 + 2 * size}}}).*", rf"585#42\g<1>{'A5' * (4 - size)}")
        for said, size in SIZES.items()
    ]
    return DefectiveR1(Defect("no size in an expedited upload", (), together(*says_less)))


def judge(r1: DefectiveR1, level: Level) -> Report:
    return r1.judge(ConformancePlan(level, confirm=yes))


@pytest.mark.parametrize("level", Level)
def test_the_sizes_of_the_eds_are_taken(level: Level) -> None:
    r1 = unsized()
    before = r1.values()
    report = judge(r1, level)
    assert not_harmless(report) == []
    assert (report.findings, report.unrestored) == ((), ())
    assert report.count(CheckVerdict.PASS) > 300
    assert r1.values() == before


def test_without_an_eds_the_sizes_of_cia_301_are_taken() -> None:
    r1 = unsized()
    before = r1.values()
    report = ConformRun(r1.link, NODE_ID, ConformancePlan(Level.COMMUNICATION)).run()
    assert not_harmless(report) == []
    assert (report.findings, report.unrestored) == ((), ())
    assert report.count(CheckVerdict.PASS) > 100
    assert r1.values() == before
