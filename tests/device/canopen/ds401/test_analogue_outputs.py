from __future__ import annotations

from functools import partial
from math import inf, nan

import pytest

from tests.device.canopen.ds401.board import I8, I16, I32, REAL, U8, Board, Row
from tickrig.device.canopen.ds401 import Converter, Ds401
from tickrig.wire.canopen.datatypes import DataType

DAC = Converter("v", "V", low=-10.0, high=10.0, low_raw=-32767, high_raw=32767)
with_volts = partial(Ds401, outputs=(DAC,))


@pytest.mark.parametrize(
    ("index", "kind", "value"),
    [(0x6410, I8, -100), (0x6411, I16, -30_000), (0x6412, I32, -(2**31)), (0x6413, REAL, 0.25)],
)
def test_a_value_of_any_width_is_put_out(index: int, kind: DataType, value: float) -> None:
    made = Board([(index, 1, kind, 0)])
    made.write(index, 1, value)
    made.step()
    assert made.put("ao1") == value


@pytest.mark.parametrize(
    ("index", "kind", "value", "volt"),
    [(0x6410, I8, 64, 5.0), (0x6411, I16, 32767, 10.0), (0x6412, I32, -(2**31), -10.0)],
)
def test_a_converter_makes_the_quantity_of_any_width(
    index: int, kind: DataType, value: int, volt: float
) -> None:
    made = Board([(index, 1, kind, 0)], make=with_volts)
    made.write(index, 1, value)
    made.step()
    assert made.put("ao1_v") == pytest.approx(volt, abs=1e-3)
    assert made.module.outputs["ao1_v"].unit == "V"


@pytest.mark.parametrize(("value", "volt"), [(2.5, 2.5), (11.0, 10.0), (-inf, -10.0)])
def test_a_real_quantity_is_limited_to_the_converter(value: float, volt: float) -> None:
    made = Board([(0x6413, 1, REAL, 0.0)], make=with_volts)
    made.write(0x6413, 1, value)
    made.step()
    assert made.put("ao1_v") == volt


def test_what_is_no_number_leaves_the_output_as_it_is() -> None:
    made = Board([(0x6413, 1, REAL, 1.5)])
    made.write(0x6413, 1, nan)
    made.step()
    assert made.put("ao1") == 1.5


def test_the_object_that_changed_last_counts() -> None:
    made = Board([(0x6411, 1, I16, 0), (0x6413, 1, REAL, 0.0)])
    made.write(0x6413, 1, 0.5)
    made.step()
    assert made.put("ao1") == 0.5
    made.write(0x6411, 1, 7)
    made.step()
    assert made.put("ao1") == 7


def test_scaling_and_offset_are_applied_in_this_order() -> None:
    rows: list[Row] = [(0x6411, 1, I16, 0), (0x6446, 1, I32, 5), (0x6447, 1, I32, 2)]
    rows += [(0x6413, 2, REAL, 0.0), (0x6441, 2, REAL, 0.5), (0x6442, 2, REAL, 4.0)]
    made = Board(rows)
    made.write(0x6411, 1, 100)
    made.write(0x6413, 2, 1.0)
    made.step()
    assert (made.put("ao1"), made.put("ao2")) == (205, 4.5)


@pytest.mark.parametrize(("mode", "put"), [(1, (-7.0, 2.5)), (0, (100.0, 1.0))])
def test_error_values_are_put_out_as_the_mode_says(mode: int, put: tuple[float, float]) -> None:
    rows: list[Row] = [(0x6411, 1, I16, 100), (0x6413, 2, REAL, 1.0), (0x6443, 2, U8, mode)]
    made = Board([*rows, (0x6444, 2, I32, -7), (0x6445, 2, REAL, 2.5)])
    made.write(0x6411, 1, 99)
    made.write(0x6411, 1, 100)
    made.step("000#0205")
    assert (made.put("ao1"), made.put("ao2")) == put


def test_at_power_on_an_output_is_at_rest() -> None:
    made = Board([(0x6413, 2, REAL, nan)], make=with_volts)
    assert made.put("ao1_v") == pytest.approx(0.0, abs=1e-3)
    assert made.put("ao2") == 0.0
