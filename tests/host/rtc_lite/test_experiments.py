"""T1 to T7: the experiments of the paper, in virtual time."""

from __future__ import annotations

from tests.host.rtc_lite.bench import PERIOD_US
from tests.host.rtc_lite.experiment import Experiment


def test_t1_numbers_pass_two_devices_in_order_in_the_period_in_which_they_were_entered() -> None:
    system = Experiment()
    system.activate()
    for number in (1, -5, 2_147_483_647):
        system.source.enter(number)
        system.run_for(PERIOD_US)
        assert system.numbers[-1] == number
    assert system.numbers == [1, -5, 2_147_483_647]
    assert set(system.states().values()) == {"ACTIVE"}
