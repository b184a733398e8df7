from __future__ import annotations

import pytest

from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.device.rrc.settings import RrcConfig
from tickrig.device.rrc.vehicle import Vehicle
from tickrig.wire.instant import NEVER


class Chair:
    """An RRC with a vehicle, whose VR2 is on."""

    def __init__(self, battery_wh: int = 1_200) -> None:
        self.rrc = Rrc(RrcConfig(vehicle=True, battery_wh=battery_wh))
        self.now_us = 0
        self.press_power()

    def press_power(self) -> None:
        for pressed in (0, 1, 0):
            self.rrc.inputs.set("power_button", pressed)
            self.run(400)

    def run(self, duration_ms: int, line: bytes = b"") -> bytes:
        """Run tick by tick; return what it sends."""
        sent = b""
        for _ in range(duration_ms // 10):
            self.now_us += TICK_US
            sent += self.rrc.tick(self.now_us, line)
            line = b""
        return sent

    def read(self, *names: str) -> list[int | str]:
        return [self.rrc.read(name) for name in names]


@pytest.mark.parametrize(
    ("mode", "speed", "turn"), [(1, 333, 300), (2, 667, 600), (3, 1000, 900), (5, 1667, 1500)]
)
def test_each_speed_mode_has_its_speed(mode: int, speed: int, turn: int) -> None:
    chair = Chair()
    chair.run(20, b"speedmode%x0\n" % mode)
    chair.run(4_000, b"output6400\n")
    assert chair.read("speed_mm_s", "turn_mrad_s") == [speed, 0]
    chair.run(4_000, b"output0064\n")
    assert chair.read("speed_mm_s", "turn_mrad_s") == [0, turn]


def test_backing_is_half_as_fast_and_counts_negative() -> None:
    chair = Chair()
    chair.run(4_000, b"output9c9c\n")
    assert chair.read("speed_mm_s", "turn_mrad_s") == [-166, -300]
    (distance, heading) = chair.read("distance_mm", "heading_mrad")
    assert (distance, heading) == (-649, -1181)


def test_it_speeds_up_and_slows_down_at_its_rates() -> None:
    chair = Chair()
    chair.run(20, b"speedmode50\n")
    chair.run(1_000, b"output6400\n")
    assert chair.read("speed_mm_s", "distance_mm") == [800, 400]
    chair.run(500, b"output0000\n")
    assert chair.read("speed_mm_s") == [200]
    chair.run(200)
    assert chair.read("speed_mm_s") == [0]


def test_it_comes_to_rest_before_it_turns_round() -> None:
    chair = Chair()
    chair.run(4_000, b"output6400\n")
    chair.run(280, b"output9c00\n")
    assert chair.read("speed_mm_s") == [0]
    chair.run(4_000)
    assert chair.read("speed_mm_s") == [-166]


@pytest.mark.parametrize("name", ["vr2_fault", "rrc_power"])
def test_a_stop_by_force_and_a_power_cut_brake_it(name: str) -> None:
    chair = Chair()
    chair.run(20, b"speedmode50\n")
    chair.run(4_000, b"output6400\n")
    chair.rrc.inputs.set(name, int(name == "vr2_fault"))
    chair.run(100 if name == "vr2_fault" else 0)
    before = chair.read("speed_mm_s")
    chair.run(500)
    assert (before, chair.read("speed_mm_s")) == ([1667], [167])
    assert chair.rrc.due_us == chair.now_us + TICK_US
    chair.run(100)
    assert chair.read("speed_mm_s") == [0]
    assert chair.rrc.due_us == NEVER


def test_the_battery_falls_with_use_and_the_gauge_shows_it() -> None:
    chair = Chair(battery_wh=1)
    chair.run(20, b"statusA1\n")
    full = chair.run(60_000, b"output0000\n")
    assert chair.read("battery_permille") == [832]
    assert b"\nSA:00000000A1" in full
    assert chair.run(10).startswith(b"SA:0000000091")
    chair.run(10, b"speedmode50\n")
    chair.run(60_000, b"output6400\n")
    assert chair.read("battery_permille", "speed_mm_s") == [0, 0]
    assert chair.run(10).startswith(b"SA:0000640015")
    chair.rrc.inputs.set("gauge", 7)
    chair.run(4_000)
    assert chair.read("speed_mm_s") == [1667]


def test_a_battery_is_not_used_while_vr2_is_off() -> None:
    chair = Chair(battery_wh=1)
    chair.run(20, b"poweroff\n")
    before = chair.read("battery_permille")
    chair.run(60_000)
    assert chair.read("battery_permille") == before


def test_reset_puts_it_back() -> None:
    chair = Chair()
    chair.run(4_000, b"output6464\n")
    chair.rrc.reset()
    names = ("speed_mm_s", "turn_mrad_s", "distance_mm", "heading_mrad", "battery_permille")
    assert chair.read(*names) == [0, 0, 0, 0, 1_000]


def test_without_a_vehicle_nothing_moves() -> None:
    chair = Chair()
    chair.rrc = Rrc()
    chair.press_power()
    chair.run(1_000, b"output6400\n")
    assert chair.read("out_v_pct", "speed_mm_s", "distance_mm") == [100, 0, 0]
    assert chair.rrc.due_us == NEVER


@pytest.mark.parametrize("gauge", range(1, 11))
def test_a_battery_shows_the_gauge_that_was_set(gauge: int) -> None:
    vehicle = Vehicle(1_200)
    vehicle.set_gauge(gauge)
    assert vehicle.shown_gauge == gauge


def test_a_battery_that_holds_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="battery_wh is 0, at least 1 is needed"):
        RrcConfig(battery_wh=0)
