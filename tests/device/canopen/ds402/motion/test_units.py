from __future__ import annotations

import pytest

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds402.settings import Parameters, Units, read_settings
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

TURN = 2_000


def parameters(**values: int) -> Parameters:
    """Objects by names such as x608F_1."""
    entries = []
    for name, value in values.items():
        index, _, sub = name[1:].partition("_")
        kind = DataType.INTEGER32 if value < 0 else DataType.UNSIGNED32
        entries.append(
            EntryDescription(int(index, 16), int(sub or 0), name, kind, Access.READ, default=value)
        )
    return Parameters(Dictionary(entries))


def units(**values: int) -> Units:
    return Units(parameters(**values), TURN)


def test_without_factors_a_unit_is_a_count() -> None:
    plain = units()
    assert (plain.per_position, plain.per_velocity, plain.per_acceleration) == (1, 1, 1)


def test_gear_and_feed_make_the_position_unit() -> None:
    scaled = units(x608F_1=4_096, x608F_2=1, x6091_1=50, x6091_2=1, x6092_1=360, x6092_2=1)
    assert scaled.per_position == pytest.approx(4_096 * 50 / 360)
    assert scaled.per_velocity == scaled.per_position


def test_a_feed_of_zero_is_none() -> None:
    assert units(x608F_1=4_096, x608F_2=0, x6091_2=0, x6092_1=360).per_position == 1


@pytest.mark.parametrize(
    ("objects", "rpm"),
    [
        ({"x60A9": 0x00B4_4700}, 1.0),
        ({"x60A9": 0xFDB4_4700}, 0.001),
        ({"x608C": 0xA4}, 1.0),
        ({"x608C": 0xA4, "x608B": -1}, 0.1),
    ],
)
def test_a_velocity_may_be_in_revolutions_per_minute(objects: dict[str, int], rpm: float) -> None:
    assert units(**objects).per_velocity == pytest.approx(rpm * TURN / 60)


@pytest.mark.parametrize(
    ("unit", "per_turn"),
    [(0xFF41_0000, 3_600), (0x0041_0000, 360), (0xFD10_0000, 6_283.185), (0x00B4_0000, 1)],
    ids=["0.1 degree", "degree", "milliradian", "revolution"],
)
def test_a_position_may_be_an_angle_of_the_shaft(unit: int, per_turn: float) -> None:
    plain = units(x60A8=unit)
    assert plain.per_position == pytest.approx(TURN / per_turn)
    assert plain.per_velocity == plain.per_position
    geared = units(x60A8=unit, x608F_1=4_096, x608F_2=1, x6091_1=50, x6091_2=1, x6092_1=1)
    assert geared.per_position == pytest.approx(4_096 * 50 / per_turn)


def test_a_position_in_increments_has_its_factors() -> None:
    assert units(x60A8=0x00B5_0000).per_position == 1


@pytest.mark.parametrize(("polarity", "signs"), [(0x80, (-1, 1)), (0x40, (1, -1)), (0, (1, 1))])
def test_polarity_turns_position_and_velocity_apart(polarity: int, signs: tuple[int, int]) -> None:
    turned = units(x607E=polarity)
    assert (turned.per_position, turned.per_velocity, turned.per_acceleration) == (*signs, 1)


@pytest.mark.parametrize(
    ("value", "exponent", "period_us"), [(10, -3, 10_000), (2, 0, 2_000_000), (1, -6, 1_000)]
)
def test_the_interpolation_period_has_a_power_of_ten(
    value: int, exponent: int, period_us: int
) -> None:
    settings = read_settings(parameters(x60C2_1=value, x60C2_2=exponent), TURN)
    assert settings.interpolation_us == period_us


def test_an_impossible_power_of_ten_is_a_millisecond() -> None:
    assert read_settings(parameters(x60C2_1=1, x60C2_2=3), TURN).interpolation_us == 1_000


def test_software_limits_that_are_not_apart_are_none() -> None:
    low, high = read_settings(parameters(x607D_1=5, x607D_2=5), TURN).software_limits
    assert (low, high) == (-float("inf"), float("inf"))


def test_software_limits_change_sides_with_the_polarity() -> None:
    settings = read_settings(parameters(x607D_1=-5, x607D_2=20, x607E=0x80), TURN)
    assert settings.software_limits == (-20, 5)


@pytest.mark.parametrize(("low", "high"), [(0, 0), (1, 0), (5, -5)])
def test_a_position_range_that_is_none_leaves_positions_as_they_are(low: int, high: int) -> None:
    settings = read_settings(parameters(x607B_1=low, x607B_2=high), TURN)
    assert settings.position_range == (-(1 << 31), (1 << 31) - 1)
