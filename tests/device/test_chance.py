"""Chance is the same everywhere, also when draws are passed over."""

from __future__ import annotations

import pytest

from tickrig.device.chance import Chance, check_rate, threshold_of


def test_draws_are_passed_over_at_once() -> None:
    one, other = Chance(7, "noise"), Chance(7, "noise")
    draws = [one.draw() for _ in range(10)]
    other.skip(9)
    assert other.draw() == draws[9]
    other.skip(0)
    assert other.draw() == one.draw()


@pytest.mark.parametrize("draws", [0, 1, 256, 500])
@pytest.mark.parametrize("rate", [0.0, 0.05, 0.5, 1.0])
def test_many_draws_hit_as_those_one_by_one(draws: int, rate: float) -> None:
    one, other, threshold = Chance(7, "flip >"), Chance(7, "flip >"), threshold_of(rate)
    hits = [number for number in range(draws) if one.hit(threshold)]
    assert other.hits(threshold, draws) == hits
    assert other.draw() == one.draw()
    assert draws < 500 or abs(len(hits) - rate * draws) < 25


@pytest.mark.parametrize(
    ("rate", "said"),
    [
        (0.0, "loss takes a rate above 0 and up to 1, as loss=0.01; got 0"),
        (1.5, "loss takes a rate above 0 and up to 1, as loss=0.01; got 1.5"),
    ],
)
def test_a_rate_that_cannot_be_is_refused(rate: float, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        check_rate("loss", rate)
    check_rate("loss", 1.0)
