from __future__ import annotations

from typing import Any

import pytest

from tests.host.canmon.tui.panel_pilot import Desk, at_desk
from tests.host.canmon.tui.pilot import drive_session, hear, on_monitor, shown, wire_session
from tests.host.canmon.tui.rig_session import NODE, RigSession
from tests.host.canmon.wire import new_wire
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryPanel
from tickrig.host.canmon.tui.panels.nodes_panel import NodesPanel
from tickrig.host.tui import LineView, line_text


def test_nodes_and_their_emcys_are_shown() -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("2")
        assert shown(monitor)[0].split()[:5] == ["5", "EPOS", "pre-operational", "->", "stopped"]
        card = [line_text(line) for line in monitor.shown.query_one("#card", LineView).lines]
        assert "EMCY, latest first" in card
        assert "8210h PDO not processed" in card[-1]

    on_monitor(drive_session(), act)


def test_a_node_that_fell_silent_is_red() -> None:
    with new_wire() as wire:
        session = wire_session(wire)

        async def act(monitor: MonitorApp, pilot: Any) -> None:
            await pilot.press("2")
            hear(session, wire, "605#2B17100001000000", "585#6017100000000000", "705#05")
            while "LATE" not in "".join(shown(monitor)):  # 1.5 ms of the wall clock
                session.step(1_000)
            styles = {style for _, style in monitor.shown.query_one(LineView).lines[0]}
            assert "bold red reverse" in styles

        on_monitor(session, act)


def asked(desk: Desk[NodesPanel]) -> str:
    return desk.static("#question")


@pytest.mark.parametrize(
    ("key", "word", "frame"),
    [
        ("s", "start", f"000#01{NODE:02X}"),
        ("t", "stop", f"000#02{NODE:02X}"),
        ("p", "pre-op", f"000#80{NODE:02X}"),
        ("r", "reset-node", f"000#81{NODE:02X}"),
        ("k", "reset-comm", f"000#82{NODE:02X}"),
    ],
)
def test_a_command_is_asked_and_says_what_may_move(key: str, word: str, frame: str) -> None:
    async def act(desk: Desk[NodesPanel]) -> None:
        desk.session.run(10_000)
        desk.lines()
        desk.session.arm()
        await desk.press(key)
        assert asked(desk).startswith(f"NMT {word} to node 5. ")
        assert "otor" in asked(desk) or "moves" in asked(desk)
        await desk.answer("y")
        desk.session.run(10_000)

    session = RigSession()
    at_desk(NodesPanel, act, session=session)
    assert session.frames == [frame]


@pytest.mark.parametrize(
    ("key", "frame"),
    [("S", "000#0100"), ("T", "000#0200"), ("P", "000#8000"), ("R", "000#8100"), ("K", "000#8200")],
)
def test_a_capital_commands_all_nodes(key: str, frame: str) -> None:
    async def act(desk: Desk[NodesPanel]) -> None:
        desk.session.run(10_000)
        desk.lines()
        desk.session.arm()
        await desk.press(key)
        assert " to all nodes. " in asked(desk)
        await desk.answer("yes")
        desk.session.run(10_000)

    session = RigSession()
    at_desk(NodesPanel, act, session=session)
    assert session.frames == [frame]


def test_nothing_is_sent_without_a_yes_or_before_it_is_armed() -> None:
    async def act(desk: Desk[NodesPanel]) -> None:
        await desk.press("s")  # no node has sent a frame yet
        desk.session.run(10_000)
        desk.lines()
        await desk.press("s")
        assert not desk.asked
        assert desk.told() == ["not armed: nothing is sent; A arms"]
        desk.session.arm()
        await desk.press("s")
        await desk.answer("")
        assert desk.static("#wrong") == "'' is neither y nor n"
        await desk.answer("n")
        assert not desk.asked
        await desk.press("s", "escape")
        await desk.press("s")
        desk.session.disarm()
        await desk.answer("y")
        desk.session.run(10_000)

    session = RigSession()
    at_desk(NodesPanel, act, session=session)
    assert session.frames == []
    assert session.withheld == 0


def test_a_stop_takes_back_what_was_not_sent() -> None:
    async def act(desk: Desk[NodesPanel]) -> None:
        desk.session.run(10_000)
        desk.lines()
        desk.session.arm()
        await desk.press("s")
        await desk.answer("y")
        desk.session.disarm()
        desk.session.arm()
        desk.session.run(10_000)

    session = RigSession()
    at_desk(NodesPanel, act, session=session)
    assert session.frames == []


def test_a_command_is_shown_until_the_node_confirms_it() -> None:
    async def act(desk: Desk[NodesPanel]) -> None:
        desk.session.run(10_000)
        desk.lines()
        desk.session.arm()
        await desk.press("s")
        await desk.answer("y")
        desk.session.run(10_000)
        assert "pre-operational -> operational" in desk.lines()[0]

    at_desk(NodesPanel, act)


def test_arrows_choose_a_node_and_enter_shows_its_objects() -> None:
    with new_wire() as wire:
        session = wire_session(wire)

        async def act(monitor: MonitorApp, pilot: Any) -> None:
            await pilot.press("1")
            hear(session, wire, "705#05", "708#05")
            monitor.refresh_view()
            await pilot.press("down")
            await pilot.pause()
            card = monitor.shown.query_one("#card", LineView)
            assert line_text(card.lines[0]).endswith(" node 8")
            await pilot.press("enter")
            await pilot.pause()
            assert isinstance(monitor.shown, DictionaryPanel)
            assert monitor.shown.node is not None
            assert monitor.shown.node[1] == 8

        on_monitor(session, act, panels=(NodesPanel, DictionaryPanel))


def test_where_there_is_no_node_or_no_objects_tab_enter_does_nothing() -> None:
    async def act(desk: Desk[NodesPanel]) -> None:
        assert desk.lines()[0].startswith("no node has sent a frame")
        await desk.press("enter")
        desk.session.run(10_000)
        desk.lines()
        await desk.press("enter")
        assert desk.lines()[0].split()[:2] == ["5", "EPOS"]

    at_desk(NodesPanel, act)


@pytest.mark.parametrize("width", [80, 120, 200])
def test_titles_stand_over_their_columns(width: int) -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("2")
        row = shown(monitor)[0]
        head = str(monitor.shown.query_one("#head").render())
        for title, text in (("NAME", "EPOS"), ("NMT STATE", "pre-operational")):
            assert head.index(title) == row.index(text)

    on_monitor(drive_session(), act, size=(width, 24))
