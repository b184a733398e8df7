"""What Tables 5 and 6 say, beside what the unit does: the table on its page is made here."""

from __future__ import annotations

from collections.abc import Iterator
from math import radians
from pathlib import Path
from typing import Final, NamedTuple

import pytest

from tests.device.canopen.motor_core_unit.bench import CURRENT, FAULT, ON, UnitBench
from tickrig.device.servo.parameters import FTMD, MOTOR_CORE_UNIT

pytestmark = pytest.mark.unmeasured

PAGE: Final = Path(__file__).parents[4] / "docs/reference/devices/motor-core-unit.md"

FULL: Final = 32_767
"""Asks for 10 A."""

LOAD_KG_M2: Final = 0.95
"""With the unit's own 0.05 kg m2 it is 1 kg m2."""


def free_rpm(supply_v: float) -> float:
    """Return how fast the shaft turns without a load, pushed by 1 A at most."""
    bench = UnitBench()
    bench.set("supply_v", supply_v)
    bench.begin(CURRENT, FULL // 10)
    bench.pass_ms(2_000)
    assert not bench.status & FAULT
    return bench.see("velocity_deg_s") / 6


def pushed(held_ms: int) -> tuple[float, float]:
    """Return current and torque of all that the unit gives after its shaft was held."""
    bench = UnitBench()
    bench.set("load_kg_m2", LOAD_KG_M2)
    bench.set("shaft_blocked", 1)
    bench.begin(CURRENT, FULL)
    bench.pass_ms(held_ms)
    bench.set("shaft_blocked", 0)
    bench.pass_ms(20)
    before = bench.see("velocity_deg_s")
    bench.pass_ms(20)
    acceleration_rad_s2 = radians(bench.see("velocity_deg_s") - before) / 0.02
    return bench.see("current_a"), acceleration_rad_s2 + 0.5  # 0.5 Nm of friction


def is_on(supply_v: float) -> bool:
    """Return whether the power stage works at a supply."""
    bench = UnitBench()
    bench.set("supply_v", supply_v)
    bench.begin(CURRENT, FULL // 10)
    bench.pass_ms(20)
    return bool(bench.status & ON)


class Row(NamedTuple):
    """One number of the report.

    Attributes:
        said: what the report says.
        expected: its number.
        measured: the same of the unit, as the page tells it.
        close: the number of `measured`, and how far it may be off.
    """

    said: str
    expected: float
    measured: str
    close: tuple[float, float]


def speed(supply_v: int, said: str) -> Row:
    rpm = free_rpm(supply_v)
    return Row(said, supply_v, f"{rpm:.1f} rpm without load", (rpm, 0.01))


def torque(said: str, expected: float, held_ms: int) -> Row:
    current_a, torque_nm = pushed(held_ms)
    measured = (
        f"{torque_nm:.1f} Nm at {current_a:.2f} A, {held_ms / 1_000:g} s after 10 A are asked for"
    )
    return Row(said, expected, measured, (torque_nm, 0.01))


def rows() -> Iterator[Row]:
    """Measure all of it."""
    yield speed(60, "5: 60 rpm at 60 V")
    yield speed(24, "the same at 24 V: 24 rpm")
    yield speed(10, "the same at 10 V: 10 rpm")
    yield torque("5: 15 Nm continuous", 15, 2_500)
    yield torque("5: 30 Nm peak", 30, 1_000)
    unit = MOTOR_CORE_UNIT.stage
    for said, said_a, driver_a, unit_a in (
        ("6: 7 A continuous", 7, FTMD.continuous_a, unit.continuous_a),
        ("6: 10 A peak", 10, FTMD.peak_a, unit.peak_a),
    ):
        measured = f"the driver's; the unit lets {unit_a:.2f} A flow"
        yield Row(said, said_a, measured, (driver_a, 0.0))
    lowest_v = next(volt / 10 for volt in range(90, 120) if is_on(volt / 10))
    yield Row("6: motor 10 to 60 V", 10, f"works from {lowest_v:g} V on", (lowest_v, 0.0))


def test_every_number_of_tables_5_and_6_is_met_and_on_the_page() -> None:
    page = PAGE.read_text("utf-8")
    for row in rows():
        number, within = row.close
        assert number == pytest.approx(row.expected, rel=within), row
        assert f"| {row.said} | {row.measured} |" in page, row
    assert "(70 mm x 80 mm and 1132 g; 75 x 55 x 24 mm and 97 g)" in page


@pytest.mark.parametrize("supply_v", range(10, 67, 4))
def test_the_speed_without_load_is_proportional_to_the_supply(supply_v: int) -> None:
    assert free_rpm(supply_v) == pytest.approx(supply_v, rel=0.01)
