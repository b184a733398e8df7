from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.host.canmon.tui.panel_pilot import Desk, at_desk, kept
from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.model.frames import Record, Stamp, date_text
from tickrig.host.canmon.model.graph.plot import ViewMode
from tickrig.host.canmon.tui.panels.graph_panel import GraphPanel
from tickrig.host.canmon.workspace import SettingError
from tickrig.wire.can import CanFrame

S = 1_000_000
TWO = {"signals": ["181[0]", "slow=181[0]*0.5@2"], "window": "4s"}


def ramp() -> RigSession:
    """A session that has heard a ramp of 20 s."""
    session = RigSession()
    hear(session, range(1, 21))
    return session


def hear(session: RigSession, seconds: range) -> None:
    frames = [Record(s * S, "can0", CanFrame(0x181, bytes([s]))) for s in seconds]
    decoded_frames = session.model.take(frames)
    for task in session.tasks:
        task.tick(0, decoded_frames)


def span_s(desk: Desk[GraphPanel]) -> tuple[float, float]:
    view = desk.panel.graph.view()
    return view.from_us / S, view.to_us / S


def test_signals_are_added_with_their_past_and_taken_out() -> None:
    async def act(desk: Desk[GraphPanel]) -> None:
        assert desk.lines() == ["no signals: a adds one, F1 shows how"]
        await desk.press("x", "a")
        await desk.answer("181[0")
        assert desk.static("#wrong").startswith("'181[0' is not")
        await desk.answer("181[0]")
        hear(desk.session, range(21, 23))
        assert desk.lines()[0] == "━ 181[0] 22"
        assert list(desk.panel.graph.series[0].values) == [float(s) for s in range(1, 23)]
        await desk.press("x")
        await desk.answer("281[0]")
        assert desk.static("#wrong") == "'281[0]' is not one of 181[0]"
        await desk.answer("181[0]")
        assert desk.panel.graph.words == []

    at_desk(GraphPanel, act, session=ramp())


def test_keys_and_mouse_change_what_is_seen() -> None:
    async def act(desk: Desk[GraphPanel]) -> None:
        desk.lines()
        assert span_s(desk) == (16, 20)
        await desk.press("plus", "minus", "minus")
        assert (span_s(desk), desk.panel.graph.mode) == ((12, 20), ViewMode.LIVE)
        await desk.press("comma")
        assert (span_s(desk), desk.panel.graph.mode) == ((10, 18), ViewMode.HELD)
        await desk.press("full_stop", "right")
        assert (span_s(desk), desk.panel.graph.cursor_us) == ((12, 20), 16_080_000)
        await desk.press("shift+right", "left", "shift+left")
        assert desk.panel.graph.cursor_us == 16 * S
        assert desk.static("#state").endswith("cursor at 15.000000 s")
        await desk.press("h")
        assert span_s(desk) == (1, 20)
        await desk.press("space", "l")
        assert desk.panel.graph.mode is ViewMode.LIVE
        await desk.click("PictureView", (10, 3))
        assert desk.panel.graph.cursor_us == 12 * S

    at_desk(GraphPanel, act, session=ramp(), settings=TWO)


def test_keys_change_one_axis() -> None:
    async def act(desk: Desk[GraphPanel]) -> None:
        await desk.press("y", "h", "i")
        assert desk.panel.graph.view().ranges == {2: (2.875, 7.625)}
        await desk.press("o", "up", "down")
        assert desk.panel.graph.view().ranges == {2: pytest.approx((0.5, 10.0))}
        await desk.press("r", "c")
        assert (desk.panel.graph.view().ranges, len(desk.panel.graph.series[0])) == ({}, 0)

    panel = at_desk(GraphPanel, act, session=ramp(), settings=TWO)
    assert kept(panel) == TWO


def test_the_picture_is_written_to_a_file(tmp_path: Path) -> None:
    async def act(desk: Desk[GraphPanel]) -> None:
        await desk.press("s")
        await desk.answer(str(tmp_path / "g.gif"))
        assert "a graph is written as .svg" in desk.static("#wrong")
        await desk.answer(str(tmp_path / "none/g.csv"))
        assert desk.static("#wrong").endswith("No such file or directory")
        await desk.answer(str(tmp_path / "g.csv"))
        assert desk.told() == [f"{tmp_path / 'g.csv'} is written"]

    at_desk(GraphPanel, act, session=ramp(), settings={"signals": ["181[0]"], "window": "1us"})
    assert (tmp_path / "g.csv").read_text() == "t_s,181[0]\n20.000000,20\n"


@pytest.mark.parametrize(
    ("settings", "path"),
    [
        ({"signals": ["181[0]", "181["]}, ("signals", 1)),
        ({"signals": "181[0]"}, ("signals",)),
        ({"window": "soon"}, ("window",)),
        ({"window": 5}, ("window",)),
    ],
)
def test_a_setting_that_is_none_is_refused(settings: dict[str, Any], path: object) -> None:
    with pytest.raises(SettingError) as refused:
        GraphPanel(RigSession()).load(settings)
    assert refused.value.path == path


def test_of_a_log_all_is_seen_at_first() -> None:
    session = RigSession()
    session.source.live = False
    assert GraphPanel(session).graph.mode is ViewMode.ALL


def test_the_axis_writes_times_as_the_other_tabs() -> None:
    async def act(desk: Desk[GraphPanel]) -> None:
        await desk.press("h", "right")
        axes = []
        for stamp in (Stamp.ZERO, Stamp.ABSOLUTE, Stamp.DATE):
            desk.session.stamp = stamp
            axes.append((desk.lines()[-1].split(), desk.static("#state").partition("cursor ")[2]))
        (zero, at_zero), (absolute, at_absolute), (date, at_date) = axes
        assert (zero[0], zero[-1], at_zero) == ("0", "s", "at 9.690000 s")
        assert ("10" in absolute, absolute[-1], at_absolute) == (True, "s", "at 10.690000 s")
        assert (date[0][-6:], date[-1]) == (":00:10", date_text(S)[:10])
        assert at_date == f"at {date_text(10_690_000)}"

    at_desk(GraphPanel, act, settings={"signals": ["181[0]"]}, session=ramp())
