from __future__ import annotations

from math import pi, tau

import pytest

from tests.host.rtc.motion.port_bench import PERIOD_US, PortBench
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import room
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.link import Link
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg


class CaptureBench(PortBench[LrfCaptureUrg]):
    """The component with an emulated sensor, both in virtual time."""

    def __init__(self, **settings: str) -> None:
        self.urg, self.line = Urg(world=room(4, 3)), SerialLine(12_000_000)
        self.rig = Rig(Station(self.urg, self.line.a))
        super().__init__(LrfCaptureUrg("LRFCapture_URG0", self._open), **settings)

    def _open(self, url: str) -> Link[bytes]:
        self.link = SimLink(self.rig, self.line.b)
        return self.link

    def period(self, count: int = 1) -> None:
        for _ in range(count):
            self.rig.run_to(self.manager.now_us + PERIOD_US)
            self.manager.run_to(self.rig.now_us)


def test_each_scan_is_written_in_metres() -> None:
    bench = CaptureBench(cluster="1")
    bench.period(50)
    found = bench.taken("ranges")
    assert 8 <= len(found) <= 10
    ranges, config = found[0].ranges, found[0].config
    assert len(ranges) == 682
    assert ranges[384 - 44] == 2.0
    assert config.minAngle == pytest.approx(-340 * tau / 1_024)
    assert config.maxAngle == pytest.approx(341 * tau / 1_024)
    assert (config.minRange, config.maxRange, config.frequency) == (0.02, 5.6, 10.0)


def test_clusters_make_less_of_it() -> None:
    bench = CaptureBench()
    bench.period(20)
    found = bench.taken("ranges")[0]
    assert len(found.ranges) == 170
    assert found.config.angularRes == pytest.approx(4 * tau / 1_024)


def test_where_nothing_is_the_range_is_0() -> None:
    bench = CaptureBench()
    bench.urg.inputs.set("x_m", 50.0)
    bench.urg.inputs.set("heading_rad", pi / 2)
    bench.period(20)
    assert 0.0 in bench.taken("ranges")[0].ranges


def test_trouble_of_the_sensor_is_an_error_until_it_is_mended(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench = CaptureBench()
    bench.period(20)
    bench.urg.inputs.set("motor_jammed", 1)
    bench.period(5)
    assert bench.state == "ERROR"
    assert "LRFCapture_URG0: " in caplog.text
    assert "status 51" in caplog.text
    bench.urg.inputs.set("motor_jammed", 0)
    bench.manager.reset("LRFCapture_URG0")
    bench.period()
    bench.activate()
    bench.taken("ranges")
    bench.period(20)
    assert bench.taken("ranges")


def test_deactivated_the_laser_is_off() -> None:
    bench = CaptureBench()
    bench.period(20)
    assert bench.urg.read("laser") == 1
    bench.deactivate()
    bench.period(2)
    assert bench.urg.read("laser") == 0


def test_a_line_that_is_gone_is_an_error() -> None:
    bench = CaptureBench()
    bench.period(20)
    bench.link.close()
    bench.period(2)
    assert bench.state == "ERROR"


def test_a_line_that_cannot_be_opened_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    on = PortBench(LrfCaptureUrg("LRFCapture_URG0"), DeviceFileName="/dev/nothing")
    on.period()
    assert on.state == "ERROR"
    assert "LRFCapture_URG0: cannot open '/dev/nothing'" in caplog.text
