"""The tester finds each planted defect, by a check whose clause it breaks."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Final

import pytest

from tests.device.canopen.actions import DriveActions, GenericIoActions, SlaveActions
from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO, make_dictionary
from tests.device.canopen.reference import NODE_ID
from tests.host.canopen.conform.defects import of_others
from tests.host.canopen.conform.defects.defect import Bends, Defect, Plant, make_defective, says
from tests.host.canopen.conform.defects.table import DEFECTS
from tests.host.canopen.conform.r1 import EDS, R1, Stimulus, yes
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.conformance.conformance import PoweredSlave
from tickrig.host.canopen.conform.binding.capabilities import EdsClaims
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import DeviceInfo

PROFILE: Final = frozenset(range(0x6000, 0xA000))
ACTIONS: Final = {GENERIC_IO: GenericIoActions, DRIVE: DriveActions}


class DefectiveR1(R1):
    """R1 with a defect, and the EDS of a sound one."""

    def __init__(self, defect: Defect) -> None:
        device, sound = make_defective(defect), make_dictionary(defect.needs)
        self.slave, self.wire = device.slave, CanWire()
        self.powered = PoweredSlave(device)
        self.rig = Rig(Station(self.powered, self.wire.end()))
        self.link = CanHost(self.rig, self.wire.end())
        self.rig.run_for(100_000)
        if DRIVE in defect.needs:
            self.slave.dictionary[0x1000, 0].value = 402
        self._eds = EdsDevice(DeviceInfo(), tuple(sound.description), sound.objects)

    def judge(self, plan: ConformancePlan, **given: Any) -> Report:
        """Run the tester against it."""
        file = open_eds(EDS)
        claims = EdsClaims.of_file(file)
        return ConformRun(self.link, NODE_ID, plan, device=self._eds, claims=claims, **given).run()


def judge(defect: Defect, *only: str) -> Report:
    """Judge a defective slave by some checks."""
    r1 = DefectiveR1(defect)
    actions = next((ACTIONS[need] for need in ACTIONS if need in defect.needs), SlaveActions)
    stimulus = Stimulus(r1, actions(r1.slave))
    return r1.judge(ConformancePlan(Level.INTRUSIVE, only, PROFILE, stimulus=stimulus, confirm=yes))


def finds(defect: Defect, check: str) -> bool:
    """Say whether a check fails, or tells where it is left to the device."""
    verdict = CheckVerdict.IMPLEMENTATION_DEFINED if defect.left else CheckVerdict.FAIL
    return any(result.outcome.verdict is verdict for result in judge(defect, check).results)


@pytest.mark.parametrize("defect", DEFECTS, ids=lambda defect: defect.name)
def test_a_planted_defect_is_found(defect: Defect) -> None:
    assert any(finds(defect, check) for check in defect.breaks)


def test_all_but_8_of_76_defects_made_from_the_text_are_found() -> None:
    assert len(of_others.DEFECTS) == 76
    assert sum(defect.left for defect in of_others.DEFECTS) == 8


def names_the_one_before(*heads: str) -> Plant:
    """Name in some answers the object of the request before."""

    def plant(slave: CanopenSlave) -> Bends:
        named = ["001000", "001000"]

        def hear(text: str) -> Iterable[str]:
            if re.match("605#(2[0-9A-F]|40|A[04]|C[0246])", text):
                named[:] = named[1], text[6:12]
            return (text,)

        def say(text: str) -> Iterable[str]:
            return (f"{text[:6]}{named[0]}{text[12:]}" if text.startswith(heads) else text,)

        return Bends(hear, say)

    return plant


MISNAMING: Final[dict[str, tuple[Plant, tuple[str, ...]]]] = {
    "aborts name 1000h:00": (says("585#80.{6}(.{8})", r"585#80001000\1"), ("UE-06", "UE-07")),
    "aborts name sub-index 0": (says("585#80(....)..(.{8})", r"585#80\g<1>00\2"), ("UE-07",)),
    "aborts name an index of the high byte first": (
        says("585#80(..)(..)(.{10})", r"585#80\2\1\3"),
        ("UE-06", "UE-07"),
    ),
    "aborts name 0": (says("585#80.{6}(.{8})", r"585#80000000\1"), ("UE-06", "UE-07")),
    "values name 1008h": (
        says("585#(4[137BF])....(.{10})", r"585#\g<1>0810\2"),
        ("UE-01", "UE-02"),
    ),
    "values name sub-index 1": (says("585#(4[37BF].{4})00(.{8})", r"585#\g<1>01\2"), ("UE-01",)),
    "confirmations name the object before": (names_the_one_before("585#60"), ("DE-01", "DE-02")),
    "all answers name 1008h": (
        says("585#(4[137BF]|60|80)....(.{10})", r"585#\g<1>0810\2"),
        ("UE-01", "UE-06", "UE-07"),
    ),
    "block uploads name the object before": (names_the_one_before("585#C"), ("BU-01",)),
    "block downloads name the object before": (names_the_one_before("585#A4"), ("BD-01",)),
}
"""Defects, and checks that fail: an answer names the object that was asked for."""


@pytest.mark.parametrize("name", MISNAMING)
def test_a_node_that_names_other_objects_is_judged_and_restored(name: str) -> None:
    plant, breaks = MISNAMING[name]
    r1 = DefectiveR1(Defect(name, (), plant))
    before = {at: value for at, value in r1.values().items() if at[0] != 0x1003}
    stimulus = Stimulus(r1, SlaveActions(r1.slave))
    only = ("UE", "DE", "BU-01", "BD-01", "NMT-01")
    report = r1.judge(
        ConformancePlan(Level.INTRUSIVE, only, PROFILE, stimulus=stimulus, confirm=yes)
    )
    assert report.count(CheckVerdict.BLOCKED) == 0
    failed = {r.check.id: r for r in report.results if r.outcome.verdict is CheckVerdict.FAIL}
    assert set(breaks) <= failed.keys()
    for check in breaks:
        assert any(line.text.startswith("585#") for line in failed[check].outcome.evidence)
    assert {at: value for at, value in r1.values().items() if at[0] != 0x1003} == before
    assert report.unrestored == ()


def test_the_report_tells_which_answers_name_other_objects() -> None:
    defect = next(
        each for each in of_others.DEFECTS if each.plant is of_others.abort_names_the_one_before
    )
    report = judge(defect, "UE-06")
    assert [r.outcome.verdict for r in report.results] == [CheckVerdict.FAIL]
    assert "of 5FFFh" in report.results[0].outcome.reason
    assert any(
        "was answered with 585#80" in text and "which names" in text for text in report.findings
    )
