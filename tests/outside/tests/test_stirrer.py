"""The master of the stirrer, and what it does when things go wrong."""

from __future__ import annotations

import time

import pytest
from boiler.kettle import KettleHost
from boiler.master import Master, SdoError

from tickrig import Bench

pytestmark = pytest.mark.needs("device:stirrer")


def until(master: Master, done: object, within_s: float) -> bool:
    """Let the master work until something is so."""
    assert callable(done)
    until_s = time.monotonic() + within_s
    while not done():
        if time.monotonic() > until_s:
            return False
        master.watch()
    return True


def test_the_motor_is_set_up(bench: Bench, master: Master) -> None:
    master.start()
    assert until(master, lambda: bench["stirrer"].get("state") == "Operational", 1)
    assert until(master, lambda: master.angle is not None, 1)


def test_a_long_name_is_read_in_segments(master: Master) -> None:
    master.start()
    assert len(master.read(0x1008)) > 4


@pytest.mark.needs("fault:duplicate")
def test_a_segment_that_comes_twice_is_taken_once(bench: Bench, master: Master) -> None:
    master.start()
    name = master.read(0x1008)
    bench["stirrer"].fault("duplicate=0.05")
    names = set()
    for _ in range(20):
        try:
            names.add(master.read(0x1008))
        except SdoError:  # our own request came twice, and was refused: it is tried again
            continue
    bench["stirrer"].clear("duplicate")
    assert names == {name}


@pytest.mark.req("SAF-3")
@pytest.mark.needs("fault:encoder_unplugged")
def test_a_motor_that_fails_stops_the_heater(
    bench: Bench, master: Master, kettle: KettleHost
) -> None:
    master.start()
    kettle.heat()
    master.write(0x6411, 1, 9_000, 2)
    master.write(0x2000, 0, 2, 1)
    assert until(master, lambda: float(bench["stirrer"].get("velocity_deg_s")) > 80, 2)
    bench["stirrer"].fault("encoder_unplugged")
    assert until(master, lambda: bench["kettle"].get("state") != "Heating", 1)
    assert master.failed


@pytest.mark.needs("fault:power_off")
def test_a_motor_that_restarts_is_set_up_again(bench: Bench, master: Master) -> None:
    master.start()
    assert until(master, lambda: master.angle is not None, 1)
    bench["stirrer"].fault("power_off", for_="1s")
    assert until(master, lambda: bench["stirrer"].get("state") == "Off", 1)
    assert until(master, lambda: bench["stirrer"].get("state") == "Operational", 5)
    master.angle = None
    assert until(master, lambda: master.angle is not None, 1)


@pytest.mark.needs("fault:drop")
def test_a_boot_up_that_is_lost_is_no_end(bench: Bench, master: Master) -> None:
    assert until(master, lambda: master.boots > 0, 1)
    bench["stirrer"].fault("drop=1", for_="300ms")
    bench["stirrer"].fault("power_off", for_="100ms")
    master.boots = 0
    master.start()
    assert until(master, lambda: bench["stirrer"].get("state") == "Operational", 1)
