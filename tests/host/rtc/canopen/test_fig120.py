"""The demonstration of Fig. 120: by PDO link and by ports through the PC."""

from __future__ import annotations

import pytest

from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR, SYSTEMS, Bench
from tickrig.host.rtc import ReturnCode
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.wire.rtc_types.rtc import Time, TimedShort

BY_LINK = (SYSTEMS / "fig120.yaml").read_text("utf-8")
BY_PORTS = BY_LINK.replace("pdo_links: [{", "#").replace("# Through the PC instead: ", "")
CAST = {16: "f-palette", 32: "motor-core-unit"}


def turned(text: str) -> Bench:
    """Turn the potentiometer to the middle, and let the motor follow."""
    bench = Bench(text, CAST, SYSTEMS)
    bench.run_ms(700)
    bench.log.heard.clear()
    bench.devices[16].physical["ai1_v"].write(2.5)
    bench.run_ms(600)
    return bench


def angle(bench: Bench) -> float:
    value = bench.devices[32].read("angle_deg")
    assert isinstance(value, float)
    return value


def test_fig_120_by_link_passes_nothing_through_the_pc() -> None:
    bench = turned(BY_LINK)
    assert angle(bench) == pytest.approx(90.0027, abs=0.002)
    assert "PdoLinked 32 16.tpdo2 to 32.rpdo2: 290h" in bench.events()
    assert "290#0040" in bench.log.text
    assert "320#" not in bench.log.text


def test_fig_120_by_link_goes_on_without_the_server() -> None:
    bench = Bench(BY_LINK, CAST, SYSTEMS)
    bench.run_ms(700)
    bench.devices[16].physical["ai1_v"].write(2.5)
    bench.rig.run_for(600_000)
    assert angle(bench) == pytest.approx(90.0027, abs=0.002)


def test_a_linked_in_port_sends_nothing() -> None:
    bench = turned(BY_LINK)
    value = TimedShort(Time(), 5)
    assert bench.server.put("Motor0.angle", value) is ReturnCode.PRECONDITION_NOT_MET


def test_fig_120_by_ports_takes_two_frames_of_bus_time() -> None:
    bench = turned(BY_PORTS)
    assert angle(bench) == pytest.approx(90.0027, abs=0.002)
    source = [at for at, heard in bench.log.heard if str(heard) == "290#0040"]
    target = [at for at, heard in bench.log.heard if str(heard) == "320#0040"]
    assert target[0] - source[0] < 75  # the frame itself: the server takes no virtual time
    assert len(target) == len(source)


def test_a_link_of_different_lengths_is_refused() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "pdo_links: [{from: 16.tpdo1, to: 32.rpdo2}]\n")
    bench.boot()
    assert bench.events(ServerEventType.LINK_REFUSED) == [
        "LinkRefused 32 16.tpdo1 has 8 bits, 32.rpdo2 has 64"
    ]


def test_a_link_to_a_pdo_that_is_off_is_refused() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "pdo_links: [{from: 16.tpdo1, to: 32.rpdo1}]\n")
    bench.boot()
    assert bench.events(ServerEventType.LINK_REFUSED) == [
        "LinkRefused 32 32.rpdo1 is off, or not there"
    ]
