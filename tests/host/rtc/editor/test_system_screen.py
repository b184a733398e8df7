"""The System Editor of RT components: keys, what is on the screen, and a system that goes."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from unittest.mock import patch

import pytest
from click.testing import CliRunner
from textual import _wait
from textual.pilot import Pilot
from textual.widgets import Input, Markdown

from tests.host.canmon.tui.pilot import screen_text
from tests.host.rtc.commands.served import Served
from tickrig.emulators.commands.cli import main
from tickrig.host.rtc.editor import app as editor_app
from tickrig.host.rtc.editor.app import SystemScreen
from tickrig.host.rtc.editor.system_link import SystemLink
from tickrig.host.rtc.editor.widgets import ChoiceScreen, QuestionScreen
from tickrig.host.tui import LineView, line_text


class Desk:
    """An editor of a system; the editor asks it when the test says so."""

    def __init__(self, path: Path) -> None:
        self.link = SystemLink(path)
        self.app = SystemScreen(self.link, "here")
        self.pilot: Pilot[None]

    async def turn(self) -> None:
        self.link.turn()
        self.app.look()
        await self.pilot.pause()

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause()
        await self.turn()

    async def answer(self, text: str) -> None:
        self.app.screen.query_one(Input).value = text
        await self.press("enter")

    async def go_to(self, name: str) -> None:
        self.app.view.focus()
        self.app.view.go_to(name)
        await self.pilot.pause()

    async def choose(self, text: str) -> None:
        """Put the cursor of the details on the first row that has a text."""
        self.app.details.focus()
        rows = [line_text(row.line) for row in self.app.details.rows_shown]
        self.app.details.put_cursor(next(n for n, row in enumerate(rows) if text in row))
        await self.pilot.pause()

    def shown(self, view: LineView) -> str:
        return "\n".join(line_text(line).rstrip() for line in view.lines)

    @property
    def said(self) -> list[str]:
        return [str(notification.message) for notification in self.app._notifications]


Act = Callable[[Desk], Awaitable[None]]


def at_desk(path: Path, act: Act, size: tuple[int, int] = (80, 24)) -> None:
    async def work() -> None:
        desk = Desk(path)
        async with desk.app.run_test(size=size) as pilot:
            desk.pilot = pilot
            try:
                await desk.turn()
                await act(desk)
            finally:
                desk.link._hang_up()

    # The components run in this process: Textual would wait for it to be idle, a second each time.
    with patch.object(editor_app, "PAINT_S", 3_600), patch.object(_wait, "SLEEP_IDLE", 1):
        asyncio.run(work())


@pytest.fixture
def system(tmp_path: Path) -> Served:
    return Served(tmp_path / "system")


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (40, 12)])
def test_components_are_shown_as_a_picture_with_their_states(
    system: Served, size: tuple[int, int]
) -> None:
    async def act(desk: Desk) -> None:
        text = screen_text(desk.app)
        assert "┌ ConsoleIn0 ─" in text
        assert "4 components, 2 active" in text
        if size[0] >= 80:
            assert " Active ┘" in text
            assert "ConsoleIn0: Active, 1000 Hz" in text

    with system:
        at_desk(system.path, act, size)


def test_ports_are_disconnected_and_connected_by_keys(system: Served) -> None:
    async def act(desk: Desk) -> None:
        assert "├─┘" in desk.shown(desk.app.view)
        await desk.go_to("ConsoleIn0")
        await desk.press("right")
        assert desk.app.view.at == "ConsoleIn0.out"
        assert "DataOutPort TimedLong" in desk.shown(desk.app.details)
        assert "with ConsoleOut0.in" in desk.shown(desk.app.details)
        await desk.press("x")
        assert "├" not in desk.shown(desk.app.view)
        await desk.press("m")
        assert "marked: ConsoleIn0.out" in desk.shown(desk.app.status)
        await desk.go_to("ConsoleOut0.in")
        await desk.press("c")
        assert "├─┘" in desk.shown(desk.app.view)
        assert "marked" not in desk.shown(desk.app.status)
        (connector,) = system.manager.connectors
        assert connector.ports == ("ConsoleIn0.out", "ConsoleOut0.in")

    with system:
        at_desk(system.path, act)


def test_one_of_several_connectors_is_chosen(system: Served) -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("ConsoleIn0.out")
        await desk.press("x")
        assert isinstance(desk.app.screen, ChoiceScreen)
        await desk.answer("ConsoleOut1")
        (connector,) = system.manager.connectors
        assert connector.ports == ("ConsoleIn0.out", "ConsoleOut0.in")

    with system:
        system.rtc("create", "ConsoleOut", "ConsoleOut1")
        system.rtc("con", "ConsoleIn0.out", "ConsoleOut1.in")
        at_desk(system.path, act)


def test_a_component_is_deactivated_and_activated(system: Served) -> None:
    async def until(desk: Desk, state: str) -> None:
        for _ in range(200):
            await desk.turn()
            if state in str(desk.app.details.border_title):
                return
        raise AssertionError(f"not {state}: {desk.app.details.border_title}")

    async def act(desk: Desk) -> None:
        await desk.press("d")
        await until(desk, "Inactive")
        await desk.press("a")
        await until(desk, "Active")
        await desk.press("r")
        assert desk.said[-1] == "reset ConsoleIn0: PRECONDITION_NOT_MET, it is ACTIVE"

    with system:
        at_desk(system.path, act)


def test_configuration_sets_are_shown_edited_and_activated(system: Served) -> None:
    component = system.manager.find("ConfigSample0")
    component.configuration.add_set("fast", {"int_param0": "99"})

    async def act(desk: Desk) -> None:
        await desk.go_to("ConfigSample0")
        await desk.choose("int_param0 = ")
        await desk.press("e")
        assert isinstance(desk.app.screen, QuestionScreen)
        await desk.answer("5")
        assert component.configuration.sets["default"]["int_param0"] == "5"
        await desk.choose("  int_param0 = 99")
        await desk.press("enter")
        await desk.answer("7")
        assert component.configuration.sets["fast"]["int_param0"] == "7"
        await desk.choose("set fast")
        await desk.press("enter")
        assert component.configuration.active_id == "fast"
        assert "set fast  active" in desk.shown(desk.app.details)
        await desk.choose("int_param0 = ")
        await desk.press("e")
        await desk.answer("many")
        assert desk.said[-1] == "int_param0 takes a value like 0 (int)"
        await desk.press("e", "escape")
        assert component.configuration.sets["fast"]["int_param0"] == "7"

    with system:
        at_desk(system.path, act)


def test_a_configuration_set_is_added_with_the_values_of_another(system: Served) -> None:
    configuration = system.manager.find("ConfigSample0").configuration
    configuration.set("int_param0", "5")

    async def act(desk: Desk) -> None:
        await desk.press("plus")
        assert desk.said[-1] == "go to a component with parameters"
        await desk.go_to("ConfigSample0")
        await desk.press("plus")
        await desk.answer("slow")
        assert configuration.sets["slow"] == configuration.sets["default"]
        assert configuration.sets["slow"]["int_param0"] == "5"
        assert "set slow" in desk.shown(desk.app.details)
        for name in ("slow", " "):
            await desk.press("plus")
            await desk.answer(name)
            assert desk.said[-1].endswith("has no name, or is there already")

    with system:
        at_desk(system.path, act)


def test_what_does_not_fit_is_refused(system: Served) -> None:
    async def act(desk: Desk) -> None:
        for at, key, why in (
            ("ConsoleIn0", "m", "ports can be marked: go to one with the arrows"),
            ("ConsoleIn0", "c", "mark a port first (m)"),
            ("ConsoleIn0", "x", "go to a port that is connected"),
            ("ConsoleIn0", "e", "go to a parameter or set in the details (Tab)"),
        ):
            await desk.go_to(at)
            await desk.press(key)
            assert desk.said[-1] == why
        await desk.go_to("SeqOut0.Double")
        await desk.press("m")
        await desk.go_to("ConsoleOut0.in")
        await desk.press("c")
        assert "TimedDouble" in desk.said[-1]

    with system:
        at_desk(system.path, act)


def test_a_system_that_is_gone_is_told_and_found_again(system: Served) -> None:
    again = Served(system.path.with_name("again"))

    async def act(desk: Desk) -> None:
        system.__exit__()
        await desk.turn()
        assert "the system is gone, waiting for it (socket " in desk.shown(desk.app.status)
        assert "┌ ConsoleIn0 ─" in desk.shown(desk.app.view)
        for key in ("d", "m", "x", "e", "c"):
            await desk.press(key)
        assert "the system is gone: nothing was done" in desk.said
        again.path.rename(system.path)
        with again:
            await desk.turn()
            assert "4 components" in desk.shown(desk.app.status)
            await desk.press("d")
        await desk.turn()

    system.__enter__()
    at_desk(system.path, act)


def test_the_system_is_saved(system: Served, tmp_path: Path) -> None:
    file = tmp_path / "saved.toml"

    async def act(desk: Desk) -> None:
        for path, said in (
            ("saved.txt", "system saved.txt: the name ends in .toml or .xml"),
            (str(tmp_path / "none" / "x.toml"), "No such file or directory"),
            (str(file), f"saved: {file}"),
        ):
            await desk.press("ctrl+s")
            await desk.answer(path)
            assert said in desk.said[-1]

    with system:
        at_desk(system.path, act)
        system.rtc("check", str(file))


def test_help_resizing_mouse_and_leaving(system: Served) -> None:
    async def act(desk: Desk) -> None:
        await desk.press("f1")
        (text,) = desk.app.screen.query("HelpPanel Markdown").results(Markdown)
        assert "a wire for each" in text.source
        await desk.press("escape")
        for columns, lines in ((140, 40), (60, 15), (80, 24)):
            await desk.pilot.resize_terminal(columns, lines)
            await desk.turn()
            assert all(
                sum(len(part) for part, _ in line) <= columns for line in desk.app.view.lines
            )
        place = desk.app.view.picture.places["ConsoleOut0.in"]
        await desk.pilot.click("#picture", offset=(place.column + 1, place.line + 1))
        await desk.pilot.pause()
        assert desk.app.view.at == "ConsoleOut0.in"
        await desk.press("n", "N", "home", "end", "up", "left", "down", "right")
        await desk.press("ctrl+c")
        assert desk.app._exit

    with system:
        at_desk(system.path, act)


def test_without_a_system_or_a_terminal_it_is_one_line(system: Served, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["rtc", "edit", "--at", str(tmp_path / "none")])
    assert result.exit_code == 2
    assert result.stderr.endswith("No such file or directory, is the system running?\n")
    with system:
        assert "the editor needs a terminal; tickrig rtc ls, con, dis" in system.rtc(
            "edit", exit_code=2
        )
    assert "tickrig rtc edit --at /tmp/cart" in system.rtc("edit", "--help")
