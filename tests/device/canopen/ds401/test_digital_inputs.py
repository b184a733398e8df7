from __future__ import annotations

import pytest

from tests.device.canopen.ds401.board import BOOL, REAL, U8, U16, U32, Board, Row
from tickrig.device.canopen.ds401.digital import FILTER_US
from tickrig.device.canopen.ds401.families import (
    FILTER_INPUT,
    INTERRUPT_ANY_CHANGE,
    INTERRUPT_HIGH_TO_LOW,
    INTERRUPT_LOW_TO_HIGH,
    POLARITY_INPUT,
    READ_INPUT,
    DigitalObjects,
)
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.instant import NEVER

WIDTHS: list[tuple[str, DataType, int]] = [
    ("by_8", U8, 8),
    ("by_16", U16, 16),
    ("by_32", U32, 32),
    ("single", BOOL, 1),
]
every_width = pytest.mark.parametrize(("field", "kind", "bits"), WIDTHS)


def index(family: DigitalObjects, field: str) -> int:
    return int(getattr(family, field))


def board(field: str, kind: DataType, bits: int, **defaults: int) -> Board:
    """Make a board with two elements of each input object of one width."""
    families = {
        "read": READ_INPUT,
        "polarity": POLARITY_INPUT,
        "filter": FILTER_INPUT,
        "any": INTERRUPT_ANY_CHANGE,
        "rising": INTERRUPT_LOW_TO_HIGH,
        "falling": INTERRUPT_HIGH_TO_LOW,
    }
    rows: list[Row] = [
        (index(family, field), 2, kind, defaults.get(name, 0)) for name, family in families.items()
    ]
    made = Board(rows, (index(READ_INPUT, field) << 16 | 0x200 | 8 * kind.size,))
    made.start()
    return made


@pytest.mark.unmeasured
@every_width
def test_the_second_element_begins_where_the_first_ends(
    field: str, kind: DataType, bits: int
) -> None:
    made = board(field, kind, bits)
    assert len([name for name in made.module.inputs.table if name.startswith("di")]) == 2 * bits
    made.set(**{f"di{bits + 1}": 1})
    assert made.see(index(READ_INPUT, field), 1) == 0
    assert made.see(index(READ_INPUT, field), 2) == 1


@every_width
def test_polarity_of_any_width_inverts(field: str, kind: DataType, bits: int) -> None:
    made = board(field, kind, bits)
    made.write(index(POLARITY_INPUT, field), 2, 1)
    made.step()
    assert made.see(index(READ_INPUT, field), 2) == 1


@every_width
def test_a_filter_of_any_width_waits(field: str, kind: DataType, bits: int) -> None:
    made = board(field, kind, bits)
    made.write(index(FILTER_INPUT, field), 2, 1)
    made.set(**{f"di{bits + 1}": 1})
    made.run(FILTER_US // 1_000 - 1)
    assert made.see(index(READ_INPUT, field), 2) == 0
    made.step()
    assert made.see(index(READ_INPUT, field), 2) == 1
    assert made.slave.due_us == NEVER


@every_width
@pytest.mark.parametrize(
    ("mask", "up", "down"), [("any", 1, 1), ("rising", 1, 0), ("falling", 0, 1), ("none", 0, 0)]
)
def test_masks_of_any_width_choose_the_edges(  # noqa: PLR0913, PLR0917 - a table
    field: str, kind: DataType, bits: int, mask: str, up: int, down: int
) -> None:
    made = board(field, kind, bits, **{mask: 1})
    line = f"di{bits + 1}"
    assert (len(made.set(**{line: 1})), len(made.set(**{line: 0}))) == (up, down)


def test_objects_of_two_widths_show_the_same_lines() -> None:
    made = Board([(0x6000, 2, U8, 0), (0x6100, 1, U16, 0), (0x6020, 16, BOOL, 0)])
    made.set(di1=1, di16=1)
    assert [made.see(0x6000, 1), made.see(0x6000, 2)] == [0x01, 0x80]
    assert made.see(0x6100, 1) == 0x8001
    assert [made.see(0x6020, sub) for sub in (1, 2, 15, 16)] == [1, 0, 0, 1]


def test_a_setting_of_one_width_is_that_of_the_other() -> None:
    made = Board([(0x6000, 2, U8, 0), (0x6002, 2, U8, 0), (0x6102, 1, U16, 0)])
    made.write(0x6102, 1, 0x8001)
    assert [made.see(0x6002, 1), made.see(0x6002, 2)] == [0x01, 0x80]
    made.write(0x6002, 1, 0xF0)
    assert made.see(0x6102, 1) == 0x80F0
    made.step()
    assert [made.see(0x6000, 1), made.see(0x6000, 2)] == [0xF0, 0x80]


@pytest.mark.parametrize("reset", ["000#8105", "000#8205"])
def test_settings_of_two_widths_agree_after_a_reset(reset: str) -> None:
    made = Board([(0x6000, 1, U8, 0), (0x6002, 1, U8, 0x0F), (0x6102, 1, U16, 0)])
    before = made.see(0x6002, 1), made.see(0x6102, 1)
    assert before == (0, 0)  # the higher index counts
    made.step(reset)
    assert (made.see(0x6002, 1), made.see(0x6102, 1)) == before


def test_single_lines_go_on_in_the_next_index() -> None:
    made = Board([(0x6020, 128, BOOL, 0), (0x6021, 2, BOOL, 0)])
    made.set(di129=1)
    assert [made.see(0x6021, 1), made.see(0x6021, 2), made.see(0x6020, 128)] == [1, 0, 0]


def test_each_filtered_line_has_its_own_time() -> None:
    made = Board([(0x6000, 1, U8, 0), (0x6003, 1, U8, 0xFF)])
    made.set(di1=1)
    made.run(4)
    made.set(di2=1)
    made.run(5)
    assert made.see(0x6000, 1) == 0x01
    made.run(5)
    assert made.see(0x6000, 1) == 0x03


def test_a_spike_that_is_shorter_than_the_filter_is_not_seen() -> None:
    made = Board([(0x6000, 1, U8, 0), (0x6003, 1, U8, 0xFF)])
    made.set(di1=1)
    made.set(di1=0)
    made.run(20)
    assert made.see(0x6000, 1) == 0


def test_without_filter_a_waiting_line_passes_at_once() -> None:
    made = Board([(0x6000, 1, U8, 0), (0x6003, 1, U8, 0xFF)])
    made.set(di1=1)
    made.write(0x6003, 1, 0)
    made.step()
    assert made.see(0x6000, 1) == 0x01


def test_at_power_on_a_filtered_line_counts_at_once() -> None:
    made = Board([(0x6000, 1, U8, 0), (0x6003, 1, U8, 0xFF)])
    made.module.inputs.set("di1", 1)
    made.slave.reset()
    made.step()
    assert made.see(0x6000, 1) == 0x01


def test_without_any_setting_each_change_is_sent() -> None:
    made = Board([(0x6000, 1, U8, 0)], (0x6000_0108,))
    made.start()
    assert made.set(di8=1) == ["185#80"]


def test_lines_are_set_in_groups_of_eight() -> None:
    made = Board([(0x6000, 2, U8, 0), (0x6020, 20, BOOL, 0)])
    assert {name: len(lines) for name, lines in made.module.inputs.groups.items()} == {
        "di": 8,
        "di9_16": 8,
        "di17_20": 4,
    }


def test_an_object_that_is_narrower_than_its_family_shows_its_low_lines() -> None:
    made = Board([(0x6100, 1, U8, 0)])
    made.set(di1=1, di8=1)
    assert made.see(0x6100, 1) == 0x81


def test_an_object_that_holds_no_whole_number_is_no_terminal() -> None:
    text = DataType.VISIBLE_STRING
    made = Board([(0x6000, 1, text, ""), (0x6401, 1, text, "")])
    assert set(made.module.inputs.table) == {"internal_failure"}
    assert Board([(0x6403, 1, REAL, 0.0)]).set(ai1=0.5) == []
