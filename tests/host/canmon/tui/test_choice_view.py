from __future__ import annotations

from tests.host.canmon.tui.panel_pilot import Desk, at_desk
from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryPanel
from tickrig.host.canmon.tui.panels.panel import ChoiceView


def test_the_chosen_line_stays_in_view() -> None:
    session = RigSession()
    session.run(10_000)

    async def act(desk: Desk[DictionaryPanel]) -> None:
        count, view = len(desk.lines()), desk.panel.query_one(ChoiceView)
        for key, chosen in (
            ("pagedown", view.rows),
            ("pageup", 0),
            ("up", 0),
            ("end", count - 1),
            ("down", count - 1),
            ("home", 0),
        ):
            await desk.press(key)
            assert view.chosen == chosen
            assert view.top <= chosen < view.top + view.rows
        await desk.press("end")
        top = view.top
        await desk.click("ChoiceView", (3, 1))
        assert view.chosen == top + 1
        await desk.press("slash")
        await desk.answer("1018")
        assert view.chosen == len(desk.lines()) - 1

    at_desk(DictionaryPanel, act, session=session)
