from __future__ import annotations

from typing import Any

import pytest

from tests.host.canmon.tui.panel_pilot import Desk, at_desk
from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryPanel
from tickrig.host.canmon.workspace import SettingError


def row(desk: Desk[DictionaryPanel], begin: str) -> str:
    return next(line for line in desk.lines() if line[2:].startswith(begin))


def record(*, eds: bool = True) -> RigSession:
    """A session that has heard the boot-up of our drive."""
    session = RigSession(eds=eds)
    session.run(10_000)
    return session


def test_an_object_is_found_read_and_written() -> None:
    async def act(desk: Desk[DictionaryPanel]) -> None:
        assert desk.static("#node") == "can0 node 5"
        await desk.press("slash")
        await desk.answer("heartbeat_time")
        await desk.press("home", "down", "r")
        assert desk.told() == ["not armed: nothing is sent; A arms"]
        await desk.press("A", "slash")
        await desk.answer("1017")
        await desk.press("enter")
        desk.session.run(100_000)
        assert row(desk, "1017h:00").split()[-5:-3] == ["0", "sdo"]
        await desk.press("e")
        assert desk.static("#question") == "1017h:00 producer_heartbeat_time (UNSIGNED16)"
        await desk.answer("often")
        assert desk.static("#wrong").startswith("'often' is no number")
        await desk.answer("100")
        desk.session.run(100_000)
        assert row(desk, "1017h:00").split()[-5] == "100"
        assert desk.static("#node").endswith("write 1017h:00: done")

    at_desk(DictionaryPanel, act, session=record())


def test_before_an_object_is_written_it_is_said_what_may_move() -> None:
    async def act(desk: Desk[DictionaryPanel]) -> None:
        await desk.press("A", "slash")
        await desk.answer("6040")
        await desk.press("e")
        assert desk.static("#question").splitlines()[1:] == [
            "This may turn a motor: controlword. Enter writes it, Escape does not"
        ]

    at_desk(DictionaryPanel, act, session=record())


def test_all_that_is_shown_is_read_and_a_watched_object_is_marked() -> None:
    async def act(desk: Desk[DictionaryPanel]) -> None:
        await desk.press("A", "R")
        assert desk.static("#node").endswith("5 transfers left")
        desk.session.run(200_000)
        assert [line.split()[-4] for line in desk.lines()] == ["sdo"] * 5
        await desk.press("space")
        desk.session.run(2_000_000)
        assert desk.lines()[0].startswith("* 1018h:00")
        assert float(desk.lines()[0].split()[-3]) < 1.1 < float(desk.lines()[1].split()[-3])

    panel = at_desk(DictionaryPanel, act, session=record(), settings={"filter": "1018"})
    assert panel.save() == {"node": 0, "filter": "1018"}


def test_nodes_are_shown_in_turn_or_by_their_number() -> None:
    async def act(desk: Desk[DictionaryPanel]) -> None:
        await desk.press("n", "enter")
        assert desk.static("#node") == "no node has sent a frame"
        await desk.press("g")
        await desk.answer("128")
        assert desk.static("#wrong") == "'128' is no node-ID 1 to 127"
        await desk.answer("9")
        assert desk.static("#node") == "can0 node 9"
        desk.session.run(10_000)
        assert desk.lines() == ["no object: give --eds, or g and a node"]
        await desk.press("n")
        assert desk.static("#node") == "can0 node 5"
        await desk.press("n", "N", "e")
        assert desk.static("#node") == "can0 node 5"
        assert not desk.asked

    panel = at_desk(DictionaryPanel, act, session=RigSession(eds=False))
    assert panel.save()["node"] == 5


@pytest.mark.parametrize("settings", [{"node": 128}, {"node": "5"}, {"node": True}, {"filter": 1}])
def test_a_setting_that_is_none_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(SettingError) as refused:
        DictionaryPanel(RigSession()).load(settings)
    assert refused.value.path == tuple(settings)
