from __future__ import annotations

from typing import Any

import pytest

from tests.host.canmon.tui.panel_pilot import Desk, at_desk, kept
from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.tui.panels.transmit_panel import TransmitPanel
from tickrig.host.canmon.workspace import SettingError

ROWS = {"row": [{"send": "080#", "every": "10ms"}, {"send": "000#0105", "name": "start"}]}


def names(desk: Desk[TransmitPanel]) -> list[str]:
    return [str(words) for words in desk.panel.transmit.words]


def test_rows_are_added_changed_and_taken_out() -> None:
    async def act(desk: Desk[TransmitPanel]) -> None:
        assert desk.lines() == ["no rows: a adds one"]
        await desk.press("enter", "space", "e", "x")
        await desk.press("a")
        await desk.answer("080# --every 10ms")
        await desk.press("a")
        await desk.answer("081#")
        assert names(desk) == ["080# --every 10ms", "081#"]
        await desk.press("e")
        await desk.answer("082#")
        assert names(desk) == ["080# --every 10ms", "082#"]
        await desk.press("up", "x")
        assert names(desk) == ["082#"]

    at_desk(TransmitPanel, act)


def test_a_mistake_is_told_below_the_answer_and_escape_leaves_it() -> None:
    async def act(desk: Desk[TransmitPanel]) -> None:
        await desk.press("a")
        await desk.answer("12#")
        assert "'12#' is not a frame like" in desk.static("#wrong")
        assert desk.asked
        await desk.press("escape")
        assert (desk.asked, names(desk)) == (False, [])
        await desk.press("a")
        assert not desk.panel.query_one("#wrong").display

    at_desk(TransmitPanel, act)


def test_space_sends_a_row_in_each_period_once_it_is_armed() -> None:
    async def act(desk: Desk[TransmitPanel]) -> None:
        await desk.press("space")
        assert desk.told() == ["not armed: nothing is sent; A arms"]
        await desk.press("A", "space")
        desk.session.run(25_000)
        assert desk.session.frames == ["080#"] * 3
        assert desk.lines()[0].startswith("[x]    080#")
        await desk.press("space")
        desk.session.run(50_000)
        assert desk.session.frames == ["080#"] * 3

    at_desk(TransmitPanel, act, settings=ROWS)


def test_enter_sends_a_row_once() -> None:
    async def act(desk: Desk[TransmitPanel]) -> None:
        await desk.press("enter", "A", "down", "enter")
        desk.session.run(50_000)
        assert desk.session.frames == ["000#0105"]
        await desk.press("space")
        assert desk.told()[-1] == "start has no period"

    at_desk(TransmitPanel, act, settings=ROWS)


@pytest.mark.parametrize("key", ["s", "f9"])
def test_all_rows_are_switched_off(key: str) -> None:
    async def act(desk: Desk[TransmitPanel]) -> None:
        await desk.press("A", "space", key, "A", "A")
        desk.session.run(50_000)
        assert desk.session.frames == []

    at_desk(TransmitPanel, act, settings=ROWS)


def test_a_click_chooses_a_row() -> None:
    async def act(desk: Desk[TransmitPanel]) -> None:
        await desk.click("ChoiceView", (3, 1))
        assert desk.panel.chosen == 1
        await desk.press("home")
        assert desk.panel.chosen == 0
        await desk.press("end", "pageup")
        assert desk.panel.chosen == 0

    at_desk(TransmitPanel, act, settings=ROWS)


def test_it_sends_on_the_bus_that_is_chosen() -> None:
    session = RigSession()
    other: list[str] = []
    session.buses["can1"] = lambda frame: other.append(str(frame))

    async def act(desk: Desk[TransmitPanel]) -> None:
        await desk.press("b")
        assert desk.static("#head").endswith("bus can1")
        await desk.press("A", "enter")
        desk.session.run(1_000)
        assert other == ["080#"]

    at_desk(TransmitPanel, act, settings=ROWS, session=session)


def test_settings_come_back_and_no_row_is_enabled() -> None:
    async def act(desk: Desk[TransmitPanel]) -> None:
        await desk.press("A", "space")

    panel = at_desk(TransmitPanel, act, settings=ROWS)
    assert kept(panel) == {"bus": "", **ROWS}


@pytest.mark.parametrize(
    ("settings", "path"),
    [
        ({"row": [{"send": "080#"}, {"send": "xyz"}]}, ("row", 1)),
        ({"row": [{"send": 5}]}, ("row", 0, "send")),
        ({"row": [{"send": "080#", "counter": "0:0..3"}]}, ("row", 0, "counter")),
        ({"row": "080#"}, ("row",)),
        ({"bus": "can7"}, ("bus",)),
    ],
)
def test_a_setting_that_is_none_is_refused(settings: dict[str, Any], path: object) -> None:
    with pytest.raises(SettingError) as refused:
        TransmitPanel(RigSession()).load(settings)
    assert refused.value.path == path
