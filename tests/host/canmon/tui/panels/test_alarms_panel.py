from __future__ import annotations

from typing import Any

import pytest
from textual.widgets import TabbedContent, TextArea

from tests.host.canmon.tui.panel_pilot import Desk, at_desk, kept
from tests.host.canmon.tui.rig_session import BUS, RigSession
from tickrig.host.canmon.tui.panels.alarms_panel import AlarmsPanel
from tickrig.host.canmon.workspace import SettingError
from tickrig.wire.can import CanFrame

RULES = {"rules": {"nodes": [5, 9], "no_sdo_abort": True, "heartbeat": {"5": "100ms±20%"}}}


def test_what_is_missing_is_an_alarm_also_while_nothing_is_heard() -> None:
    session = RigSession()
    panel = AlarmsPanel(session)
    panel.load(RULES)
    session.run(1_000_000)
    session.model.now_us += 3_000_000
    panel.held.tick(session.now_us + 200_000, ())
    states = {alarm.rule: alarm.count for alarm in panel.held.alarms.rows()}
    assert states == {"no-sdo-abort": 0, "heartbeat 5": 1, "nodes": 1}


def test_findings_are_shown_acknowledged_and_cleared() -> None:
    async def act(desk: Desk[AlarmsPanel]) -> None:
        desk.session.run(10_000)
        desk.session.buses[BUS](CanFrame.parse("605#2F00100000000000"))
        desk.session.run(10_000)
        lines = desk.lines()
        assert lines[1].split()[:3] == ["no-sdo-abort", "BROKEN", "1"]
        assert lines[-1].endswith("[can0 585#8000100002000106]")
        await desk.press("space")
        assert all(alarm.acknowledged for alarm in desk.panel.held.alarms.rows())
        await desk.press("c")
        assert desk.lines()[1].split()[1:] == ["no", "frame", "0"]
        await desk.press("f5")

    panel = at_desk(AlarmsPanel, act, settings={"rules": {"no_sdo_abort": True}})
    assert kept(panel) == {"rules": {"no_sdo_abort": True}}


def test_a_written_rule_is_held_against_what_frames_mean() -> None:
    async def act(desk: Desk[AlarmsPanel]) -> None:
        desk.session.run(10_000)
        desk.session.buses[BUS](CanFrame.parse("605#2F00100000000000"))
        desk.session.run(10_000)
        assert desk.lines()[1].split()[:4] == ["sdo.aborted", "never", "BROKEN", "1"]

    panel = at_desk(AlarmsPanel, act, settings={"rules": {"rule": ["sdo.aborted never"]}})
    assert kept(panel) == {"rules": {"rule": ["sdo.aborted never"]}}


def test_rules_are_written_and_held() -> None:
    async def act(desk: Desk[AlarmsPanel]) -> None:
        area = desk.panel.query_one(TextArea)
        await desk.press("e")
        area.text = "no_emcy = 1"
        await desk.press("f5")
        assert desk.static("#wrong") == "no_emcy = 1 is not true or false"
        area.text = "max_load = 50"
        await desk.press("f5")
        assert "needs the bit rate" in desk.static("#wrong")
        area.text = "no_emcy = true"
        await desk.press("f5")
        assert desk.lines()[1].split()[:3] == ["no-emcy", "no", "frame"]
        await desk.press("e", "x", "escape")
        assert not area.display

    panel = at_desk(AlarmsPanel, act)
    assert kept(panel) == {"rules": {"no_emcy": True}}


@pytest.mark.parametrize(
    ("settings", "path"),
    [
        ({"rules": {"no_luck": True}}, ("rules",)),
        ({"rules": ["no_emcy"]}, ("rules",)),
        ({"rules": {"max_load": 50}}, ("rules",)),
    ],
)
def test_a_setting_that_is_none_is_refused(settings: dict[str, Any], path: object) -> None:
    with pytest.raises(SettingError) as refused:
        AlarmsPanel(RigSession()).load(settings)
    assert refused.value.path == path


def test_a_limit_of_the_load_is_held_where_the_bit_rate_is_known() -> None:
    panel = AlarmsPanel(RigSession(bit_rate=1_000_000))
    panel.load({"rules": {"max_load": 50}})
    assert [alarm.rule for alarm in panel.held.alarms.rows()] == ["max-load"]


USUAL = ["no-loss", "no-emcy", "no-error-frames", "no-lost-heartbeat"]


@pytest.mark.parametrize(("bit_rate", "rules"), [(None, USUAL), (500_000, ["max-load", *USUAL])])
def test_without_rules_the_usual_ones_are_held_and_none_is_kept(
    bit_rate: int | None, rules: list[str]
) -> None:
    panel = AlarmsPanel(RigSession(bit_rate=bit_rate))
    panel.load({})
    assert [alarm.rule for alarm in panel.held.alarms.rows()] == rules
    assert kept(panel) == {}


def test_rules_that_were_taken_away_do_not_come_back() -> None:
    async def act(desk: Desk[AlarmsPanel]) -> None:
        area = desk.panel.query_one(TextArea)
        await desk.press("e")
        assert "no_lost_heartbeat = true" in area.text
        area.text = ""
        await desk.press("f5")
        assert desk.lines() == ["no rules: e writes some, F1 shows how"]

    panel = at_desk(AlarmsPanel, act)
    assert kept(panel) == {"rules": {}}
    again = AlarmsPanel(RigSession())
    again.load(kept(panel))
    assert again.held.alarms.rows() == []


def test_the_title_of_the_tab_tells_that_a_rule_is_broken() -> None:
    async def act(desk: Desk[AlarmsPanel]) -> None:
        tab = desk.panel.screen.query_one(TabbedContent).get_tab("tab-alarms")
        desk.session.run(10_000)
        desk.panel.refresh_badge()
        assert tab.label_text == "1 alarms"
        desk.session.buses[BUS](CanFrame.parse("000#0105"))
        desk.session.buses[BUS](CanFrame.parse("205#00"))  # too short: an EMCY
        desk.session.run(10_000)
        desk.panel.refresh_badge()
        assert tab.label_text == "1 alarms!"
        assert "bold red" in repr(tab.label)
        desk.session.model.now_us += 3_000_000
        desk.panel.refresh_badge()
        assert "yellow" in repr(tab.label)
        await desk.press("space")
        desk.session.model.now_us += 3_000_000
        desk.panel.refresh_badge()
        assert tab.label_text == "1 alarms"

    at_desk(AlarmsPanel, act)
