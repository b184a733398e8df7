from __future__ import annotations

import contextlib
from math import hypot, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.urg.sensor_bench import SensorBench
from tickrig.device.urg.world import URG_04LX
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.link import DeviceRefused, LinkClosed
from tickrig.host.urg import UrgClient
from tickrig.wire.scip import Reply, encode_scan

REPLIES = [
    Reply(b"PP", "00", URG_04LX.lines).encode(),
    Reply(b"PP", "00").encode(),
    Reply(b"MD0044072501000", "99", encode_scan(5, [100], 3)).encode(),
    Reply(b"MD", "99").encode(),
    Reply(b"MD", "50").encode(),
]


def test_it_measures_ten_times_a_second() -> None:
    bench = SensorBench()
    scans = bench.run(1_050)
    assert bench.client.specification == URG_04LX
    assert [scan.time_ms for scan in scans] == list(range(100, 1_000, 100))
    assert {len(scan.distances_mm) for scan in scans} == {682}


def test_a_sensor_that_has_just_started_is_switched_to_scip_2() -> None:
    bench = SensorBench()
    bench.run(300)
    assert (bench.urg.parameters.scip, bench.client.garbled, bench.client.restarts) == ("1.1", 0, 0)


def test_points_are_in_radians_and_metres() -> None:
    points = dict(SensorBench().run(300)[0].points())
    assert points[0.0] == 2.0
    assert points[pi / 2] == 1.5
    assert min(points) == pytest.approx(-340 * 2 * pi / 1_024)


def test_what_is_no_distance_is_no_point() -> None:
    bench = SensorBench()
    bench.urg.inputs.set("x_m", 30.0)
    bench.urg.inputs.set("heading_rad", pi)
    assert list(bench.run(300)[0].points()) == []


def test_clusters_and_intervals_make_less_of_it() -> None:
    scans = SensorBench(cluster=10, interval=1).run(1_000)
    assert len(scans) == 4
    points = list(scans[0].points())
    assert len(points) == 68
    assert all(distance <= hypot(2, 1.5) for _, distance in points)
    assert scans[0].angle_rad(34) == pytest.approx(4.5 * 2 * pi / 1_024)


def test_garbled_scans_are_left_out() -> None:
    bench = SensorBench(cluster=10)
    bench.run(300)
    bench.port.arm("flip", "0.0003")
    scans = bench.run(3_000)
    assert bench.client.garbled > 3
    assert 10 < len(scans) < 30
    assert all(scan.distances_mm == scans[0].distances_mm for scan in scans)


def test_after_silence_it_begins_again() -> None:
    bench = SensorBench()
    bench.run(300)
    bench.urg.inputs.set("power_cut", 1)
    bench.run(20)
    assert bench.run(1_000) == []
    bench.urg.inputs.set("power_cut", 0)
    assert len(bench.run(1_500)) > 5
    assert bench.client.restarts >= 1


def test_trouble_is_told_with_its_status() -> None:
    bench = SensorBench()
    bench.run(300)
    bench.urg.inputs.set("motor_jammed", 1)
    with pytest.raises(DeviceRefused, match="status 51") as told:
        bench.run(100)
    assert told.value.code == "51"


def test_a_sensor_that_still_measures_is_taken_over() -> None:
    bench = SensorBench()
    bench.run(300)
    bench.link.send(b"MD0384038401000\n")
    bench.client = type(bench.client)(bench.link)
    assert len(bench.run(1_000)[-1].distances_mm) == 682


def test_a_sensor_left_in_adjust_mode_is_taken_over() -> None:
    bench = SensorBench()
    bench.link.send(b"TM0\n")
    bench.client = type(bench.client)(bench.link)
    assert len(bench.run(500)) >= 2


@given(st.lists(st.binary(max_size=80) | st.sampled_from(REPLIES), max_size=8))
def test_any_noise_on_the_line_is_survived(pieces: list[bytes]) -> None:
    line = SerialLine(12_000_000)
    rig = Rig()
    client = UrgClient(SimLink(rig, line.b))
    for piece in pieces:
        line.a.send(rig.now_us, piece)
        rig.run_for(1_000)
        with contextlib.suppress(DeviceRefused):
            assert len(client.poll()) <= 1


def test_closing_switches_the_laser_off() -> None:
    bench = SensorBench()
    bench.run(300)
    bench.client.close()
    bench.rig.run_for(10_000)
    assert bench.urg.read("laser") == 0
    with pytest.raises(LinkClosed):
        bench.client.poll()
