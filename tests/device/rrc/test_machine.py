"""What a rig asks of the RRC: its period, when it is due, and what can be read."""

from __future__ import annotations

from tests.device.rrc.bench import RrcBench
from tickrig.device.rrc.machine import Rrc
from tickrig.wire.instant import NEVER


def test_it_works_every_10_ms_and_begins_at_once() -> None:
    rrc = Rrc()
    assert (rrc.tick_us, rrc.due_us) == (10_000, 0)


def test_it_is_called_as_its_device_type_is() -> None:
    assert Rrc().type_name == "rrc"


def test_it_is_due_at_once_when_an_input_is_set_or_it_is_reset() -> None:
    bench = RrcBench().power_on()
    bench.run(10)
    assert bench.rrc.due_us == NEVER
    bench.set(gauge=1)
    assert bench.rrc.due_us == 0
    bench.step()
    assert bench.rrc.due_us == NEVER
    bench.rrc.reset()
    assert bench.rrc.due_us == 0


def test_it_is_due_when_power_on_ends() -> None:
    bench = RrcBench().boot()
    bench.tap("power_button")
    assert bench.rrc.due_us == 10_000 * (bench.tick + 29)


def test_it_is_due_when_the_watchdog_would_trip() -> None:
    bench = RrcBench().power_on()
    bench.step("watchdog0f")
    bench.run(10)
    assert bench.rrc.due_us == 10_000 * (bench.tick + 5)


def test_it_is_due_until_its_load_says_no_more_of_a_command() -> None:
    bench = RrcBench().power_on()
    bench.run(10)
    bench.step("gauge")
    for _ in range(10):
        assert bench.rrc.due_us == 10_000 * (bench.tick + 1)
        assert bench.rrc.read("load_pct") == 34
        bench.step()
    assert bench.rrc.due_us == NEVER
    assert bench.rrc.read("load_pct") == 30


def test_it_is_due_in_each_period_while_it_sends_its_status() -> None:
    bench = RrcBench().power_on()
    bench.step("statusA1")
    assert bench.rrc.due_us == 10_000 * (bench.tick + 1)
    bench.step("poweroff")
    bench.run(2)
    assert bench.rrc.due_us > 10_000 * (bench.tick + 1)


def test_it_is_due_in_the_next_period_while_lines_wait() -> None:
    bench = RrcBench().power_on()
    bench.step("beep01", "beep01", "beep01")
    assert bench.rrc.due_us == 10_000 * (bench.tick + 1)


def test_the_power_of_vr2_can_be_read() -> None:
    bench = RrcBench()
    seen = [bench.rrc.read("vr2_power")]
    bench.power_on()
    seen.append(bench.rrc.read("vr2_power"))
    bench.step("poweroff")
    seen.append(bench.rrc.read("vr2_power"))
    assert seen == [0, 1, 0]
