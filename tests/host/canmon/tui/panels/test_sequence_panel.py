from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from textual.widgets import TextArea

from tests.host.canmon.tui.panel_pilot import Desk, at_desk, kept
from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.tui.panels.sequence_panel import (
    NEW,
    SequencePanel,
    sequence_name,
    texts_settings,
)
from tickrig.host.canmon.workspace import SettingError, Workspace

SYNC = "# sync\nloop forever\n+10 080#\n"
START = 'name = "start"\n\n[[step]]\nsend = "000#0105"\n\n[[step]]\nexpect = "705#05"\n'
TWO = {"item": [{"text": SYNC}, {"text": START}]}


def test_a_sequence_runs_once_it_is_armed_until_it_is_stopped() -> None:
    async def act(desk: Desk[SequencePanel]) -> None:
        await desk.press("f5")
        assert desk.told() == ["not armed: nothing is sent; A arms"]
        await desk.press("A", "f5")
        desk.session.run(25_000)
        assert desk.lines() == ["0.010000 > 080#", "0.020000 > 080#"]
        assert desk.static("#state") == "sync (1 of 2)   runs"
        await desk.press("f6")
        assert desk.lines()[-1] == "0.020000 . stopped"
        await desk.press("f5", "f9")
        desk.session.run(50_000)
        assert desk.session.frames == ["080#", "080#"]

    panel = at_desk(SequencePanel, act, settings=TWO)
    assert kept(panel) == {"bus": "", **TWO}


def test_a_mistake_is_told_and_the_editor_goes_there() -> None:
    async def act(desk: Desk[SequencePanel]) -> None:
        area = desk.panel.query_one(TextArea)
        await desk.press("f7")
        assert desk.lines() == ["send 080#", "wait 100 ms"]
        await desk.press("e", "A", "escape")
        assert area.text.startswith('Aname = "new"')
        area.text = area.text[1:].replace("100ms", "soon")
        await desk.press("f5")
        assert desk.static("#mistake").startswith("new:7: 'soon' is not a time")
        assert area.cursor_location == (6, 0)
        area.text = area.text.replace("soon", "1s")
        await desk.press("f7")
        assert not desk.panel.query_one("#mistake").display

    panel = at_desk(SequencePanel, act)
    assert panel.texts == [NEW.replace("100ms", "1s")]


def test_sequences_are_turned_over_added_and_taken_out() -> None:
    async def act(desk: Desk[SequencePanel]) -> None:
        await desk.press("full_stop")
        assert desk.static("#state") == "start (2 of 2)"
        await desk.press("n")
        assert desk.static("#state") == "new (3 of 3)"
        await desk.press("x", "comma")
        assert desk.static("#state") == "sync (1 of 2)"
        await desk.press("x", "x", "b")
        assert desk.static("#state") == "new (1 of 1)   bus can0"

    at_desk(SequencePanel, act, settings=TWO)


def test_files_are_read_and_written(tmp_path: Path) -> None:
    (tmp_path / "start.toml").write_text(START)
    (tmp_path / "noise").write_bytes(b"\xff\xfe\xff")

    async def act(desk: Desk[SequencePanel]) -> None:
        await desk.press("o")
        await desk.answer(str(tmp_path / "none.toml"))
        assert desk.static("#wrong").endswith("none.toml: No such file or directory")
        await desk.answer(str(tmp_path / "noise"))
        assert desk.static("#wrong").endswith("noise: is no text")
        await desk.answer(str(tmp_path / "start.toml"))
        assert desk.panel.texts == [NEW, START]
        await desk.press("s")
        await desk.answer(str(tmp_path / "none/copy.toml"))
        assert desk.static("#wrong").endswith("copy.toml: No such file or directory")
        await desk.answer(str(tmp_path / "copy.toml"))

    at_desk(SequencePanel, act)
    assert (tmp_path / "copy.toml").read_text() == START


@example("\r\n")
@example("a\r")
@given(st.text(st.sampled_from("a'\n\t\"\\#=\r\x00é"), max_size=30))
def test_any_text_comes_back_from_a_workspace(text: str) -> None:
    workspace = Workspace()
    workspace.put("sequence", {"item": texts_settings([text])})
    (found,) = Workspace(workspace.text).section("sequence")["item"]
    assert found["text"] == text.lstrip("\n")


def test_a_sequence_is_called_by_its_first_line() -> None:
    assert sequence_name("name = 'a b'\n[[step]]", 1) == "a b"
    assert sequence_name("\nname = 'a'", 2) == "sequence 2"


@pytest.mark.parametrize(
    ("settings", "path"),
    [
        ({"item": [{"text": 5}]}, ("item", 0, "text")),
        ({"item": [5]}, ("item",)),
        ({"bus": 7}, ("bus",)),
    ],
)
def test_a_setting_that_is_none_is_refused(settings: dict[str, Any], path: object) -> None:
    with pytest.raises(SettingError) as refused:
        SequencePanel(RigSession()).load(settings)
    assert refused.value.path == path
