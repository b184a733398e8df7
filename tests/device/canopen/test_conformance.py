from __future__ import annotations

import pytest

from tests.device.canopen.actions import SlaveActions
from tests.device.canopen.conformance import Check, load_all, run_check
from tests.device.canopen.reference import NODE_ID, make_dictionary
from tests.device.canopen.runner import Pace, Runner
from tickrig.device.canopen.stack import make_slave

CHECKS = load_all()
every_check = pytest.mark.parametrize("check", CHECKS, ids=[check.id for check in CHECKS])


def play(check: Check, pace: Pace) -> list[str]:
    slave = make_slave(make_dictionary(check.needs), NODE_ID)
    run = Runner(slave, pace)
    run_check(run, check, SlaveActions(slave))
    return run.transcript


@every_check
def test_the_slave_conforms(check: Check) -> None:
    play(check, Pace.SINGLE)


@every_check
def test_the_slave_conforms_when_frames_come_in_bursts(check: Check) -> None:
    play(check, Pace.BURST)


@every_check
def test_left_out_idle_ticks_are_not_visible(check: Check) -> None:
    assert play(check, Pace.SPARSE) == play(check, Pace.SINGLE)
