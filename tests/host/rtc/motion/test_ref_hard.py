from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.host.rtc.motion.base_bench import COUNTS_PER_RAD, COUNTS_PER_TURN, BaseBench
from tests.host.rtc.motion.port_bench import PortBench
from tickrig.device.modbus import ModbusSlave, Register, Registers
from tickrig.device.rh3.base import Rh3Base
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.links.link import Link, LinkClosed
from tickrig.host.rtc.motion.components.ref_hard import RefHard, RefHardRh3
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ports.service_port import Consumer, ServicePort
from tickrig.wire.modbus import Status


def running(v: float = 0.0, w: float = 0.0, **configuration: str) -> BaseBench:
    """Return a bench whose base has power and follows a velocity."""
    bench = BaseBench(0, **configuration)
    bench.drive(v, w, periods=50)
    return bench


def moving(bench: BaseBench) -> bool:
    bench.rig.run_for(10_000)
    return abs(bench.base.read("speed_m_s")) > 0.01


def test_settings_and_power_are_ordered_first() -> None:
    sent = [data[:-2].hex(" ") for _, data in running().link.sent][:6]
    assert sent == [
        "01 03 00 00 00 01",
        "01 03 00 10 00 01",
        "01 10 00 20 00 0a 14 00 0a 00 00 00 00 00 0a 00 00 00 01 00 03 a3 6e 00 12 31 26",
        "01 10 00 10 00 03 06 00 01 00 05 01 f4",
        "01 10 00 11 00 01 02 00 01",
        "01 17 02 00 00 0c 01 00 00 04 08 00 00 00 00 00 00 00 00",
    ]


def test_each_period_has_one_exchange() -> None:
    bench = running()
    times = [at_us for at_us, data in bench.link.sent if data[1] == 0x17]
    assert {b - a for a, b in pairwise(times)} == {20_000}


def test_a_cart_speed_becomes_wheel_speeds() -> None:
    """0.3 m/s is 71 534 counts/s (RH3 specification, derived numbers)."""
    assert running(0.3).speeds() == (71_534, 71_534)
    half = 0.441 / 2 / 0.1 * COUNTS_PER_RAD
    assert running(0.0, 1.0).speeds() == (-round(half), round(half))


def test_angles_are_those_of_the_wheels() -> None:
    bench = running(0.3)
    left, right = bench.angles()
    assert left == right == pytest.approx(bench.base.read("angle_left_rad"), abs=0.06)
    assert left > 1.5


def test_gear_counts_radii_and_constants_come_from_the_configuration() -> None:
    bench = running(
        0.3,
        GearRatio="100",
        EncoderCount="1000",
        WheelRadiusLeft="0.2",
        EncoderConstant_R="-1",
    )
    per_rad = 100 * 1_000 / 6.283185307
    assert bench.speeds() == (round(1.5 * per_rad), -round(3 * per_rad))
    left, right = bench.angles()
    assert left > 0
    assert right > left


@pytest.mark.parametrize("number", [nan, inf, -inf, 1e300])
def test_a_velocity_that_is_no_number_means_standstill(number: float) -> None:
    bench = running(0.3)
    bench.drive(number, periods=2)
    assert bench.speeds() == (0, 0)
    bench.drive(0.3, number, periods=2)
    assert bench.speeds() == (0, 0)


@pytest.mark.parametrize(("v", "w"), [(5.0, 1.0), (-1e9, 0.0), (1.0, 1e6)])
def test_an_unreachable_speed_is_slowed_down_on_the_same_curve(v: float, w: float) -> None:
    bench = running(v, w)
    left, right = bench.speeds()
    most = 10 * COUNTS_PER_RAD
    assert max(abs(left), abs(right)) == pytest.approx(most, abs=1)
    exact = (v - w * 0.2205, v + w * 0.2205)
    assert left * exact[1] == pytest.approx(right * exact[0], rel=1e-4)
    assert bench.state == "ACTIVE"


@pytest.mark.parametrize(
    ("port_name", "service"), [("InventGUIRefHard", "service"), ("BumpRefHard", "service")]
)
def test_stop_holds_until_go(port_name: str, service: str) -> None:
    bench = running(0.3)
    port = ServicePort("caller")
    refhard = port.require(Consumer[RefHard](service, "RefHard"))
    connect(port, bench.component.ports[port_name])
    refhard.service.Stop()
    bench.period(50)
    assert not moving(bench)
    refhard.service.Go()
    bench.period(50)
    assert moving(bench)


def test_the_bumper_stops_the_cart_while_it_is_pressed() -> None:
    bench = running(0.3)
    bench.base.inputs.set("bumper", 1)
    bench.period(50)
    assert not moving(bench)
    assert bench.state == "ACTIVE"
    bench.base.inputs.set("bumper", 0)
    bench.period(50)
    assert moving(bench)


def test_a_fault_of_the_base_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    bench = running(0.3)
    bench.base.inputs.set("emergency_stop", 1)
    bench.period(50)
    assert bench.state == "ERROR"
    assert "RefHardRh3: fault of the base: emergency stop (left, right)" in caplog.text
    assert not moving(bench)


def test_a_fault_comes_back_until_its_cause_is_gone() -> None:
    bench = running(0.3)
    bench.base.inputs.set("emergency_stop", 1)
    bench.period(50)
    bench.restart()
    assert bench.state == "ERROR"
    bench.base.inputs.set("emergency_stop", 0)
    bench.restart()
    bench.period(50)
    assert bench.state == "ACTIVE"
    assert moving(bench)


def test_a_cut_line_is_an_error_and_the_base_stops_by_its_watchdog(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench = running(0.3)
    bench.port.arm("cut")
    bench.period(15)
    assert bench.state == "ERROR"
    assert "no answer to 5 requests in a row" in caplog.text
    bench.rig.run_for(600_000)
    assert not moving(bench)
    assert bench.base.status & Status.WATCHDOG


def test_after_a_cut_the_angles_go_on_with_what_was_not_heard() -> None:
    bench = running(0.3)
    bench.port.arm("cut")
    bench.period(50)
    bench.port.clear("cut")
    bench.drive(0.0)
    bench.restart()
    assert bench.angles()[0] == pytest.approx(bench.base.read("angle_left_rad"), abs=1e-3)


def test_after_a_loss_of_power_the_angles_go_on_from_where_they_were() -> None:
    bench = running(0.3)
    before = bench.angles()[0]
    bench.base.inputs.set("power_cut", 1)
    bench.period(50)
    assert bench.state == "ERROR"
    bench.base.inputs.set("power_cut", 0)
    bench.drive(0.0)
    bench.restart()
    assert bench.angles()[0] == pytest.approx(before, abs=0.2)


def test_angles_go_on_when_a_counter_begins_again() -> None:
    bench = running()
    wheel = bench.base.sides[0].wheel
    for turns in range(1, 40):  # 5e9 counts, beyond 2**32
        wheel.travel += 1_000 * COUNTS_PER_TURN
        bench.period()
        assert bench.angles()[0] / 6.283185307 == pytest.approx(1_000 * turns, abs=0.5)


def test_one_lost_answer_is_no_miss() -> None:
    bench = running(0.3)
    bench.port.arm("cut")
    bench.period()
    bench.port.clear("cut")
    bench.period(20)
    assert (bench.state, bench.component.lost) == ("ACTIVE", 1)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000))
def test_noise_on_the_line_moves_nothing_but_time(seed: int) -> None:
    bench = BaseBench(seed)
    bench.port.arm("flip", "0.0005")
    bench.drive(0.3, periods=60)
    told = [each.data[0] for each in bench.taken("OutWheelAngle")]
    assert all(0 <= b - a < 1.0 for a, b in pairwise(told))


def test_a_line_that_cannot_be_opened_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    def refuse(url: str) -> Link[bytes]:
        raise LinkClosed(f"cannot open {url!r}")

    bench = PortBench(RefHardRh3("RefHardRh3", refuse), DeviceFileName="/dev/nothing")
    bench.period(2)
    assert bench.state == "ERROR"
    assert "cannot open '/dev/nothing'" in caplog.text


def test_an_encoder_constant_of_0_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    bench = BaseBench(EncoderConstant_L="0")
    bench.period(2)
    assert bench.state == "ERROR"
    assert "an EncoderConstant is 0" in caplog.text


def test_a_line_that_goes_away_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    bench = running(0.3)
    bench.link.close()
    bench.period(2)
    assert bench.state == "ERROR"
    assert "the link was closed" in caplog.text


class Refusing(ModbusSlave):
    """A slave that has no registers for so many requests."""

    tick_us = 1_000

    def __init__(self, base: Rh3Base, times: int) -> None:
        super().__init__(Registers((), {}), lambda values: None)
        self._base, self._times = base, times

    @property
    def due_us(self) -> int:
        return min(super().due_us, self._base.due_us)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        if self.served >= self._times:
            return self._base.tick(now_us, rx)
        return super().tick(now_us, rx)


class RefusingBench(BaseBench):
    """A bench whose base refuses some requests before it takes any."""

    def __init__(self, times: int) -> None:
        self.times = times
        super().__init__()

    def _open(self, url: str) -> Link[bytes]:
        self.rig = Rig(Station(Refusing(self.base, self.times), self.port))
        return super()._open(url)


class Inverter(ModbusSlave):
    """Another slave with registers where a base has its own: a master would start its motor."""

    tick_us = 1_000

    def __init__(self, device_id: int) -> None:
        table = (Register(0, "id", "", initial=device_id), Register(0x10, "run", "", writable=True))
        super().__init__(Registers(table, {}), self._ran)
        self.ran: list[Mapping[str, int]] = []

    def _ran(self, values: Mapping[str, int]) -> None:
        self.ran.append(values)


class StrangerBench(BaseBench):
    """A bench with a slave that is not a base."""

    def __init__(self, device_id: int, **configuration: str) -> None:
        self.inverter = Inverter(device_id)
        super().__init__(0, **configuration)

    def _open(self, url: str) -> Link[bytes]:
        self.rig = Rig(Station(self.inverter, self.port))
        return super()._open(url)


def test_a_device_that_is_not_a_base_is_refused_before_anything_is_written(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench = StrangerBench(0x1234, DeviceFileName="/dev/ttyUSB7")
    bench.drive(0.3, periods=30)
    assert bench.state == "ERROR"
    assert "/dev/ttyUSB7: register 0000h is 1234h, not 5248h; not an RH3 base" in caplog.text
    assert {data[1] for _, data in bench.link.sent} == {0x03}
    assert not bench.inverter.ran


def test_nothing_is_written_to_a_device_that_has_not_said_who_it_is() -> None:
    bench = BaseBench()
    bench.port.arm("cut")
    bench.period(2)
    bench.deactivate()
    assert {data[1] for _, data in bench.link.sent} == {0x03}


def test_any_device_is_driven_if_the_user_says_so() -> None:
    bench = StrangerBench(0x1234, AnyDevice="1")
    bench.drive(0.3, periods=30)
    assert bench.state == "ERROR"  # it has no gains
    assert {data[1] for _, data in bench.link.sent} == {0x03, 0x10}


def test_a_request_that_was_refused_is_made_again() -> None:
    bench = RefusingBench(4)
    bench.drive(0.3, periods=60)
    assert bench.state == "ACTIVE"
    assert moving(bench)


def test_a_base_that_goes_on_to_refuse_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    bench = RefusingBench(5)
    bench.period(12)
    assert bench.state == "ERROR"
    refused = "the base refuses function 03h at 0000h: illegal data address; not an RH3 base"
    assert refused in caplog.text


def test_a_limit_beyond_32_bits_is_the_highest_there_is() -> None:
    bench = running(0.3, Velocity_limit="1e9")
    assert bench.link.sent[2][1][19:23].hex() == "7fffffff"
    assert bench.state == "ACTIVE"


def test_deactivation_stops_the_base_and_gives_the_line_back() -> None:
    bench = running(0.3)
    bench.deactivate()
    assert bench.link.sent[-1][1][:-2].hex(" ") == "01 10 00 11 00 01 02 00 03"
    bench.rig.run_for(300_000)
    assert not moving(bench)
    with pytest.raises(LinkClosed):
        bench.link.receive(0)
