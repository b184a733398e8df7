from __future__ import annotations

import pytest

from tests.device.canopen.actions import DriveActions, GenericIoActions, SlaveActions
from tests.device.canopen.conformance import Check, load_all, run_check
from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO, make_dictionary
from tests.device.canopen.reference import NODE_ID
from tests.device.canopen.runner import Pace, Runner
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.slave import Application
from tickrig.device.canopen.stack import make_slave

pytestmark = pytest.mark.unmeasured

CHECKS = load_all()
every_check = pytest.mark.parametrize("check", CHECKS, ids=[check.id for check in CHECKS])


def play(check: Check, pace: Pace) -> list[str]:
    application, actions = profile(check)
    dictionary = make_dictionary(check.needs)
    slave = make_slave(dictionary, NODE_ID, application=application)
    run = Runner(slave, pace)
    run_check(run, check, actions(slave))
    return run.transcript


def profile(check: Check) -> tuple[type[Application], type[SlaveActions]]:
    if GENERIC_IO in check.needs:
        return Ds401, GenericIoActions
    return (Ds402, DriveActions) if DRIVE in check.needs else (Application, SlaveActions)


@every_check
def test_the_slave_conforms(check: Check) -> None:
    play(check, Pace.SINGLE)


@every_check
def test_the_slave_conforms_when_frames_come_in_bursts(check: Check) -> None:
    play(check, Pace.BURST)


@every_check
def test_left_out_idle_ticks_are_not_visible(check: Check) -> None:
    assert play(check, Pace.SPARSE) == play(check, Pace.SINGLE)
