"""The tester finds each planted defect, by a check whose clause it breaks."""

from __future__ import annotations

from typing import Any, Final

import pytest

from tests.device.canopen.actions import DriveActions, GenericIoActions, SlaveActions
from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO, make_dictionary
from tests.device.canopen.reference import NODE_ID
from tests.host.canopen.conform.defects import of_others
from tests.host.canopen.conform.defects.defect import Defect, make_defective
from tests.host.canopen.conform.defects.table import DEFECTS
from tests.host.canopen.conform.r1 import EDS, R1, Stimulus, yes
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.conformance.powered_slave import PoweredSlave
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.verdict import Report, Verdict
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

    def judge(self, plan: Plan, **given: Any) -> Report:
        """Run the tester against it."""
        file = open_eds(EDS)
        return ConformRun(self.link, NODE_ID, plan, device=self._eds, eds=file, **given).run()


def judge(defect: Defect, *only: str) -> Report:
    """Judge a defective slave by some checks."""
    r1 = DefectiveR1(defect)
    actions = next((ACTIONS[need] for need in ACTIONS if need in defect.needs), SlaveActions)
    stimulus = Stimulus(r1, actions(r1.slave))
    return r1.judge(Plan(Level.INTRUSIVE, only, PROFILE, stimulus=stimulus, confirm=yes))


def finds(defect: Defect, check: str) -> bool:
    """Say whether a check fails, or tells where it is left to the device."""
    verdict = Verdict.IMPLEMENTATION_DEFINED if defect.left else Verdict.FAIL
    return any(result.outcome.verdict is verdict for result in judge(defect, check).results)


@pytest.mark.parametrize("defect", DEFECTS, ids=lambda defect: defect.name)
def test_a_planted_defect_is_found(defect: Defect) -> None:
    assert any(finds(defect, check) for check in defect.breaks)


def test_all_but_one_of_40_defects_made_from_the_text_are_found() -> None:
    assert len(of_others.DEFECTS) == 39
    assert sum(defect.left for defect in of_others.DEFECTS) == 3


def test_a_node_that_names_other_objects_in_aborts_blocks_the_run() -> None:
    report = judge(of_others.BLOCKS, "UE-07")
    assert {result.outcome.verdict for result in report.results} == {Verdict.BLOCKED}
