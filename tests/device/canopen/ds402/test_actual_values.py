"""Objects that are worked out when somebody asks show what the latest tick left."""

from __future__ import annotations

import pytest

from tests.device.canopen.ds402.wheel import Wheel
from tickrig.device.canopen.ds402.indices import POSITION_ACTUAL, STATUSWORD


@pytest.fixture
def turning() -> Wheel:
    """One that turns; nothing of it is sent by itself."""
    wheel = Wheel()
    wheel.enable(3)
    wheel.write(0x60FF, 400)
    wheel.run(200)
    return wheel


def test_what_a_controlword_changes_is_shown_from_the_end_of_its_tick_on(turning: Wheel) -> None:
    before = turning.read(STATUSWORD)
    disable, upload = "601#2B40600000000000", "601#4041600000000000"
    _, answer = turning.step(disable, upload)
    assert answer == f"581#4B416000{before.to_bytes(2, 'little').hex().upper()}0000"
    assert turning.step(upload) == ["581#4B41600050030000"]


def test_what_a_reset_leaves_is_shown_at_the_end_of_its_tick(turning: Wheel) -> None:
    turning.step("000#8101")
    assert turning.read(STATUSWORD) & 0x6F == 0x40


@pytest.mark.parametrize(("index", "changes"), [(STATUSWORD, 0), (POSITION_ACTUAL, 2)])
def test_who_begins_to_watch_hears_of_changes_from_then_on(
    turning: Wheel, index: int, changes: int
) -> None:
    heard: list[int] = []
    turning.slave.dictionary[index, 0].watch(lambda entry: heard.append(entry.number))
    turning.run(2)
    assert len(heard) == changes
    assert not heard or heard[-1] == turning.read(index)
