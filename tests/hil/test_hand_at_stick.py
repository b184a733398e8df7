"""A hand that holds the stick elsewhere is told so: the RRC itself says where it is."""

from __future__ import annotations

import pytest

from tests.emulators.testing.bench.modes.hardware.plans import Answers, serial_plan
from tests.hil.rrc.chair import ASKED, Chair
from tickrig import Bench
from tickrig.emulators.bench.child import running
from tickrig.emulators.testing.bench.errors import OperatorRefused
from tickrig.emulators.testing.rig_file.plan import HardwarePlan, PortPlan
from tickrig.host.control.client import ControlClient

pytestmark = pytest.mark.realtime


def test_a_hand_that_does_not_hold_the_stick_is_asked_again() -> None:
    with running("tickrig.emulators.rrc.cli") as rrc:
        human = Answers(*[""] * (1 + ASKED))
        plan = serial_plan(HardwarePlan(ports={"rrc": PortPlan(port=str(rrc.link))}))
        with Bench.of_plan(plan, "hardware", human) as bench:
            hand, chair = ControlClient(rrc.control), Chair(bench)
            hand.request("press", name="power_button", duration_us=100_000)
            chair.switch_on()  # the human says that it is done
            chair.client.status()
            hand.request("set", name="stick", value=[58, 23])
            with pytest.raises(
                OperatorRefused, match=r"held at \(58, 23\), and not at \(-60, 20\)"
            ):
                chair.hold_stick(-60, 20)
            assert len(human.asked) == 1 + ASKED
            human.answer("")
            chair.hold_stick(60, 20)  # that is near enough
            hand.close()
            chair.client.close()
