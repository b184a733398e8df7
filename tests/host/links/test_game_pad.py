from __future__ import annotations

import pytest

from tickrig.host.links.game_pad import (
    ABS_RX,
    ABS_X,
    ABS_Y,
    EV_ABS,
    EV_KEY,
    Axes,
    EvdevPad,
    StickPosition,
)
from tickrig.host.links.link import LinkClosed


def test_a_file_that_is_no_pad_is_refused() -> None:
    pytest.importorskip("evdev")
    with pytest.raises(LinkClosed, match="cannot open game pad /dev/null: "):
        EvdevPad("/dev/null")


def test_sticks_are_centred_and_turned_round() -> None:
    axes = Axes({ABS_X: (0, 255), ABS_Y: (-100, 100), ABS_RX: (-100, 100)})
    assert axes.hand == StickPosition()
    axes.take(EV_ABS, ABS_Y, -50)
    axes.take(EV_ABS, ABS_X, 0)
    axes.take(EV_ABS, ABS_RX, 200)
    assert axes.hand == StickPosition(0.5, -1.0, 1.0)


def test_other_events_move_no_stick() -> None:
    axes = Axes({ABS_Y: (-100, 100)})
    axes.take(EV_KEY, ABS_Y, 100)
    axes.take(EV_ABS, ABS_X, 100)
    assert axes.hand == StickPosition()


def test_an_axis_without_a_range_does_not_matter() -> None:
    axes = Axes({ABS_Y: (0, 0)})
    axes.take(EV_ABS, ABS_Y, 0)
    assert axes.hand == StickPosition()


def test_a_button_is_held_until_it_is_let_go() -> None:
    axes = Axes({})
    axes.take(EV_KEY, 0x130, 1)
    axes.take(EV_KEY, 0x131, 1)
    axes.take(EV_KEY, 0x130, 0)
    assert axes.held == {0x131}
    axes.take(EV_KEY, 0x131, 2)  # it repeats
    axes.take(EV_KEY, 0x131, 0)
    assert axes.held == set()
