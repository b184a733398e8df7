from __future__ import annotations

import pytest

from tests.device.canopen.ds401.board import BOOL, U8, U16, U32, Board, Row
from tickrig.device.canopen.ds401.families import (
    ERROR_MODE_OUTPUT,
    ERROR_VALUE_OUTPUT,
    FILTER_MASK_OUTPUT,
    POLARITY_OUTPUT,
    WRITE_OUTPUT,
    DigitalObjects,
)
from tickrig.wire.canopen.datatypes import DataType

every_width = pytest.mark.parametrize(
    ("field", "kind", "bits"),
    [("by_8", U8, 8), ("by_16", U16, 16), ("by_32", U32, 32), ("single", BOOL, 1)],
)


def index(family: DigitalObjects, field: str) -> int:
    return int(getattr(family, field))


def board(field: str, kind: DataType, bits: int) -> Board:
    """Make a board with two elements of each output object of one width."""
    ones = (1 << bits) - 1
    families = [
        (WRITE_OUTPUT, 0),
        (POLARITY_OUTPUT, 0),
        (ERROR_MODE_OUTPUT, ones),
        (ERROR_VALUE_OUTPUT, 0),
        (FILTER_MASK_OUTPUT, ones),
    ]
    rows: list[Row] = [(index(family, field), 2, kind, default) for family, default in families]
    return Board(rows)


@every_width
def test_the_second_element_begins_where_the_first_ends(
    field: str, kind: DataType, bits: int
) -> None:
    made = board(field, kind, bits)
    made.write(index(WRITE_OUTPUT, field), 2, 1)
    made.step()
    assert made.put("do") == 1 << bits
    assert [made.put(f"do{line}") for line in (bits, bits + 1)] == [0, 1]


@every_width
def test_polarity_of_any_width_inverts(field: str, kind: DataType, bits: int) -> None:
    made = board(field, kind, bits)
    made.write(index(POLARITY_OUTPUT, field), 1, 1)
    made.step()
    assert made.put("do") == 1


@every_width
def test_a_filter_mask_of_any_width_holds_lines(field: str, kind: DataType, bits: int) -> None:
    made = board(field, kind, bits)
    made.write(index(FILTER_MASK_OUTPUT, field), 1, 0)
    made.write(index(WRITE_OUTPUT, field), 1, 1)
    made.step()
    assert made.put("do") == 0
    made.write(index(FILTER_MASK_OUTPUT, field), 1, 1)
    made.step()
    assert made.put("do") == 1


@every_width
def test_error_values_of_any_width_are_put_out_as_the_mode_says(
    field: str, kind: DataType, bits: int
) -> None:
    made = board(field, kind, bits)
    made.write(index(ERROR_VALUE_OUTPUT, field), 1, 1)
    made.write(index(ERROR_VALUE_OUTPUT, field), 2, 1)
    made.write(index(ERROR_MODE_OUTPUT, field), 2, 0)
    made.step("000#0205")
    assert made.put("do") == 1
    made.step("000#0105")
    assert made.put("do") == 0


def test_the_polarity_changes_error_values_too() -> None:
    made = Board([(0x6200, 1, U8, 0), (0x6202, 1, U8, 0xFF), (0x6207, 1, U8, 0x0F)])
    made.step("000#0205")
    assert made.put("do") == 0xF0


def test_outputs_of_two_widths_are_the_same_lines() -> None:
    made = Board([(0x6200, 2, U8, 0), (0x6300, 1, U16, 0)])
    made.write(0x6300, 1, 0xABCD)
    assert [made.see(0x6200, 1), made.see(0x6200, 2)] == [0xCD, 0xAB]
    made.write(0x6200, 1, 0x01)
    made.step()
    assert (made.see(0x6300, 1), made.put("do")) == (0xAB01, 0xAB01)


def test_only_the_lines_that_are_written_leave_their_error_value() -> None:
    made = Board([(0x6200, 2, U8, 0)])
    for sub in (1, 2):
        made.write(0x6200, sub, 0x11)
    made.slave.communication_error()
    made.step()
    assert made.put("do") == 0
    made.write(0x6200, 2, 0x22)
    made.step()
    assert made.put("do") == 0x2200


def test_a_reset_puts_power_on_values_out() -> None:
    made = Board([(0x6200, 1, U8, 0x01), (0x6207, 1, U8, 0x80)])
    made.step("000#0205")
    assert made.put("do") == 0x80
    made.step("000#8105")
    assert made.put("do") == 0x01


def test_at_power_on_lines_that_the_mask_holds_are_low() -> None:
    made = Board([(0x6200, 1, U8, 0xFF), (0x6208, 1, U8, 0xFF)])
    assert made.put("do") == 0xFF
    made.write(0x6208, 1, 0xF0)
    made.write(0x6200, 1, 0)
    made.step()
    assert made.put("do") == 0x0F
    made.slave.dictionary[0x6208, 1].description.default = b"\xf0"
    made.slave.reset()
    made.step()
    assert made.put("do") == 0xF0


def test_a_board_without_outputs_has_none() -> None:
    made = Board([(0x6000, 1, U8, 0)])
    assert made.module.outputs == {}
    with pytest.raises(KeyError):
        made.put("do")
