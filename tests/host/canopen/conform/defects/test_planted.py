"""Each defect is one: the checks that judge our slave from the inside find it too."""

from __future__ import annotations

from typing import Final

import pytest

from tests.device.canopen.actions import DriveActions, GenericIoActions, SlaveActions
from tests.device.canopen.conformance import NotConformingError, load_all, run_check
from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO
from tests.device.canopen.runner import Runner
from tests.host.canopen.conform.defects import of_clauses, of_others
from tests.host.canopen.conform.defects.defect import Defect, make_defective
from tests.host.canopen.conform.defects.table import DEFECTS

CHECKS: Final = {check.id: check for check in load_all()}
ACTIONS: Final = {GENERIC_IO: GenericIoActions, DRIVE: DriveActions}

LENIENT: Final = {"heartbeat off by 10 %", "1017h is sent as 4 bytes after an NMT command"}
"""What these checks let pass: they count, and measure no period, and each begins anew."""


UNKNOWN: Final = (*of_clauses.DEFECTS, *of_others.DEFECTS)
"""Defects of behaviour that these checks do not look at."""


def fails(defect: Defect, check: str) -> bool:
    device = make_defective(defect)
    actions = next((ACTIONS[need] for need in ACTIONS if need in defect.needs), SlaveActions)
    try:
        run_check(Runner(device), CHECKS[check], actions(device.slave))
    except NotConformingError:
        return True
    return False


@pytest.mark.parametrize(
    "defect",
    [defect for defect in DEFECTS if defect not in UNKNOWN],
    ids=lambda defect: defect.name,
)
def test_a_defect_breaks_what_it_says(defect: Defect) -> None:
    found = any(fails(defect, check) for check in defect.breaks if check in CHECKS)
    assert found is (defect.name not in LENIENT)


def test_names_of_defects_differ() -> None:
    names = [defect.name for defect in DEFECTS]
    assert sorted(set(names)) == sorted(names)
