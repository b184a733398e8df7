"""Chance is the same everywhere, also when draws are passed over."""

from __future__ import annotations

from tickrig.device.chance import Chance


def test_draws_are_passed_over_at_once() -> None:
    one, other = Chance(7, "noise"), Chance(7, "noise")
    draws = [one.draw() for _ in range(10)]
    other.skip(9)
    assert other.draw() == draws[9]
    other.skip(0)
    assert other.draw() == one.draw()
