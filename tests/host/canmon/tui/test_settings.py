"""The screen of settings: what it changes while the monitor runs, and what it refuses."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from textual.widgets import Input, Static, TextArea

from tests.host.canmon.tui.pilot import DRIVE, TRIES, on_monitor, screen_text, until, wire_session
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.alarms_panel import AlarmsPanel
from tickrig.host.canmon.tui.panels.panel import TABS, Panel
from tickrig.host.canmon.tui.panels.trace_panel import TracePanel
from tickrig.host.canmon.tui.session import Model, Session, empty_session
from tickrig.host.canmon.tui.settings import EMPTY, InputError, parse_settings, setting_texts
from tickrig.host.canmon.workspace import MonitorSetup, PanelSettings, Workspace
from tickrig.host.cli.can_options import BusOptions

EPOS = Path(__file__).parents[4] / "examples/eds/epos.eds"
PANELS = tuple(map(TABS.load, TABS.built_in))
NAMED_PDO = "185#3702D2040000"

Act = Callable[["Form"], Awaitable[None]]


class Form:
    """The monitor, and the screen of settings when F2 was pressed."""

    def __init__(self, monitor: MonitorApp, pilot: Any) -> None:
        self.monitor, self.pilot = monitor, pilot

    async def open(self) -> None:
        await self.pilot.press("f2")
        await self.pilot.pause()

    def set(self, **texts: str) -> None:
        for name, text in texts.items():
            field = self.monitor.screen.query_one(f"#field-{name}")
            if isinstance(field, TextArea):
                field.text = text
            else:
                assert isinstance(field, Input)
                field.value = text

    async def apply(self, **texts: str) -> None:
        self.set(**texts)
        await self.pilot.press("f5")
        await self.pilot.pause()
        await until(self.pilot, lambda: not self.monitor._moving)

    @property
    def shown(self) -> bool:
        return self.monitor.screen.id == "settings"

    def wrong(self) -> dict[str, str]:
        """Return what stands below the fields."""
        found = self.monitor.screen.query(".wrong").results(Static)
        shown = [one for one in found if one.display]
        return {str(one.id).removeprefix("wrong-"): str(one.content) for one in shown}


def on_form(
    session: Session, setup: MonitorSetup, act: Act, workspace: Workspace | None = None
) -> MonitorApp:
    async def run(monitor: MonitorApp, pilot: Any) -> None:
        form = Form(monitor, pilot)
        try:
            await act(form)
        finally:
            monitor.session.close()
            monitor.session.source.close()

    def settings(panels: list[Panel]) -> PanelSettings:
        return PanelSettings(workspace or Workspace(), setup, panels)

    return on_monitor(session, run, panels=PANELS, size=(80, 24), panel_settings=settings)


def setup_of(wire: Wire) -> MonitorSetup:
    return MonitorSetup(source=(wire.word,), options=BusOptions(bitrate=500_000))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def hear(session: Session, wire: Wire, *frames: str) -> None:
    """Send frames at the far end and let the session take them; alarms are due meanwhile."""
    count = session.model.frames + len(frames)
    for frame in frames:
        wire.send(frame)
    for _ in range(TRIES):
        session.step(100_000)
        if session.model.frames == count:
            return
    raise AssertionError(session.model.frames)


def test_without_a_source_the_settings_ask_for_one(folder: Path) -> None:
    (folder / "run.log").write_text("(1.0) can0 181#A5\n", "ascii")

    async def act(form: Form) -> None:
        assert not form.shown
        form.monitor.asks = True
        form.monitor.on_mount()  # as it begins
        await until(form.pilot, lambda: form.shown)
        await form.apply(source="run.log")
        assert not form.shown
        while not form.monitor.session.model.ended:
            form.monitor.session.step()
        form.monitor.refresh_view()
        await form.pilot.pause()
        assert "[1] A5" in screen_text(form.monitor)

    on_form(empty_session(Model()), MonitorSetup(), act)


def test_another_bus_is_opened_and_the_settings_of_the_tabs_stay(wire: Wire) -> None:
    session = wire_session(wire)
    other = Wire.__new__(Wire)

    async def act(form: Form) -> None:
        import can  # noqa: PLC0415 - the far end of another bus

        with can.Bus(interface="virtual", channel=f"{wire.name}-b") as bus:
            other.name, other._bus = f"{wire.name}-b", bus
            await form.pilot.press("2", "1", "o", "A")
            await form.open()
            await form.apply(source=other.word, bitrate="250k")
            assert not form.shown
            monitor = form.monitor
            assert monitor.session is not session
            hear(monitor.session, other, "705#05")
            assert monitor.session.model.top.view.bit_rate == 250_000
            assert monitor.query_one(TracePanel).overwrite
            assert not monitor.session.armed
            monitor.refresh_view()
            await form.pilot.pause()
            assert " 705 " in screen_text(monitor)
            assert session.source.ended
            assert list(monitor.session.buses) != list(session.buses)

    on_form(session, setup_of(wire), act)


def test_a_bus_that_cannot_be_opened_leaves_the_old_one_running(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(form: Form) -> None:
        await form.open()
        await form.apply(source="socketcan:nowhere0")
        assert form.shown
        assert "nowhere0" in form.wrong()["source"]
        await form.pilot.press("escape")
        assert form.monitor.session is session
        hear(session, wire, "705#05")

    on_form(session, setup_of(wire), act)


def test_a_bus_that_is_opened_otherwise_is_opened_as_it_was_if_that_fails(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(form: Form) -> None:
        hear(session, wire, "705#05")
        await form.open()
        await form.apply(source=f"{wire.word} socketcan:nowhere0")
        assert form.shown
        assert "source" in form.wrong()
        await form.pilot.press("escape")
        assert form.monitor.session is session
        assert not session.model.failed
        hear(session, wire, "705#04")
        assert session.model.frames == 2

    on_form(session, setup_of(wire), act)


def test_a_log_is_opened_in_place_of_a_bus(wire: Wire) -> None:
    async def act(form: Form) -> None:
        await form.open()
        await form.apply(source=str(DRIVE))
        session = form.monitor.session
        while not session.model.ended:
            session.step()
        assert session.model.frames == 134
        assert not session.can_send

    on_form(wire_session(wire), setup_of(wire), act)


def test_an_eds_is_used_for_what_was_heard_before(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(form: Form) -> None:
        hear(session, wire, NAMED_PDO)
        await form.pilot.press("d", "d")
        await form.open()
        await form.apply(eds=f"5={EPOS}")
        monitor = form.monitor
        assert monitor.session.source is session.source
        monitor.refresh_view()
        await form.pilot.pause()
        assert "statusword" in screen_text(monitor)
        hear(monitor.session, wire, NAMED_PDO)
        assert monitor.session.model.frames == 2

    on_form(session, setup_of(wire), act)


def test_a_folder_of_eds_files_is_used_and_the_choice_is_said(wire: Wire) -> None:
    who = ("585#4318100100000000", "585#4318100210620000")

    async def act(form: Form) -> None:
        await form.open()
        await form.apply(eds_dir=str(EPOS.parent))
        frames = (f"605#40{frame[6:12]}00000000" for frame in who)
        for asked, answered in zip(frames, who, strict=True):
            hear(form.monitor.session, wire, asked, answered)
        form.monitor.refresh_view()
        await form.pilot.pause()
        applied, said = [note.message for note in form.monitor._notifications]
        assert applied == "settings are applied; w keeps them in a file"
        assert said.startswith(f"node 5: EDS {EPOS} (vendor 00000000h, product 00006210h)")
        hear(form.monitor.session, wire, NAMED_PDO)
        assert form.monitor.session.model.trace.tail(1)[0].decoded.kind == "tpdo1"  # type: ignore[union-attr]

    on_form(wire_session(wire), setup_of(wire), act)


def test_filter_and_alarms_are_applied_without_another_session(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(form: Form) -> None:
        hear(session, wire, "705#05")
        await form.open()
        await form.apply(filter="node=6", rules="no_emcy = true")
        monitor = form.monitor
        assert monitor.session is session
        assert monitor.query_one(TracePanel).filter_text == "node=6"
        rules = monitor.query_one(AlarmsPanel).held.alarms.rows()
        assert [alarm.rule for alarm in rules] == ["no-emcy"]

    on_form(session, setup_of(wire), act)


def test_all_is_kept_in_the_workspace_and_what_is_taken_away_goes(wire: Wire, folder: Path) -> None:
    path = folder / "bench.toml"
    path.write_text('[bus]\ndbc = ["a.dbc"]\n[nodes.9]\neds = "a.eds"\nname = "left"\n')
    workspace = Workspace.read(path)
    setup = MonitorSetup(**{**_parts(setup_of(wire)), "eds": {9: EPOS}})

    async def act(form: Form) -> None:
        await form.open()
        await form.apply(eds=f"5-6={EPOS}", filter="node=5", bitrate="", eds_dir=str(EPOS.parent))
        assert not form.shown, form.wrong()

    on_form(wire_session(wire), setup, act, workspace)
    again = Workspace.read(path)
    kept = MonitorSetup.read(again)
    assert {node: eds.resolve() for node, eds in kept.eds.items()} == {5: EPOS, 6: EPOS}
    assert [one.resolve() for one in kept.eds_dir] == [EPOS.parent]
    assert (kept.source, kept.options.bitrate, kept.dbc) == ((wire.word,), None, ())
    assert again.section("trace")["filter"] == "node=5"
    assert again.section("nodes")["9"] == {"name": "left"}


def _parts(setup: MonitorSetup) -> dict[str, Any]:
    return {"source": setup.source, "options": setup.options}


WRONG = [
    ("source", "", "nothing to listen to: a bus as can0, or a log file as run.log"),
    ("source", "can0 'x", "No closing quotation"),
    ("source", "-", "standard input can be named at the start only"),
    ("source", "none.log", "none.log: No such file or directory"),
    ("interface", "sockcan", "'sockcan' is not an interface of python-can: "),
    ("bitrate", "fast", "'fast' is not a bit rate like 500000, 500k or 1M"),
    ("data_bitrate", "0", "'0' is not a bit rate like 500000, 500k or 1M"),
    ("bus_kwargs", "port", "'port' is not KEY=VALUE, as port=43113"),
    ("eds", "200=x.eds", "'200=x.eds' is not NODE=FILE with a node-ID 1..127, as 3=drive.eds"),
    ("eds", "3=none.eds", "none.eds: No such file or directory"),
    ("eds", f"3={DRIVE}", "drive.log"),
    ("eds_dir", "none", "none: No such file or directory"),
    ("dbc", "none.dbc", "none.dbc: No such file or directory"),
    ("filter", "node =", "filter 'node =', column 7: a value is missing"),
    ("rules", "no_luck = true", "no_luck"),
    ("rules", "no_emcy = 1", "no_emcy = 1 is not true or false"),
    ("rules", "[", "Invalid initial character for a key part (at end of document)"),
]


@pytest.mark.parametrize(("field", "text", "reason"), WRONG)
def test_a_wrong_value_is_refused_below_its_field(
    wire: Wire, folder: Path, field: str, text: str, reason: str
) -> None:
    session = wire_session(wire)

    async def act(form: Form) -> None:
        await form.open()
        await form.apply(**{"filter": "node=9", field: text})
        assert form.shown
        assert list(form.wrong()) == [field]
        assert reason in form.wrong()[field]
        assert form.monitor.focused is form.monitor.screen.query_one(f"#field-{field}")
        await form.pilot.press("escape")
        assert form.monitor.session is session
        assert not form.monitor.query_one(TracePanel).filter_text
        hear(session, wire, "705#05")

    on_form(session, setup_of(wire), act)


def test_cancel_leaves_everything_as_it_was(wire: Wire) -> None:
    session = wire_session(wire)

    async def act(form: Form) -> None:
        before = form.monitor.panel_settings
        await form.open()
        form.set(source="socketcan:nowhere0", bitrate="1", filter="node=3", rules="")
        await form.pilot.press("escape")
        assert (form.monitor.session, form.monitor.panel_settings) == (session, before)
        await form.open()
        assert form.monitor.screen.query_one("#field-bitrate", Input).value == "500000"

    on_form(session, setup_of(wire), act)


def test_a_rule_that_needs_the_bit_rate_is_refused_without_one(wire: Wire) -> None:
    async def act(form: Form) -> None:
        await form.open()
        await form.apply(bitrate="", rules="max_load = 50")
        assert "needs the bit rate" in form.wrong()["rules"]
        hear(form.monitor.session, wire, "705#05")

    on_form(wire_session(wire), setup_of(wire), act)


def test_a_recording_is_not_cut_short(wire: Wire, folder: Path) -> None:
    async def act(form: Form) -> None:
        form.monitor.recorder.start("run.log")
        await form.open()
        await form.apply(bitrate="250k")
        assert form.wrong() == {"source": "a recording runs: F8 ends it"}
        form.monitor.recorder.end()

    on_form(wire_session(wire), setup_of(wire), act)


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
def test_all_fields_are_on_the_screen(wire: Wire, size: tuple[int, int]) -> None:
    async def act(form: Form) -> None:
        await form.pilot.resize_terminal(*size)
        await form.open()
        text = screen_text(form.monitor)
        for word in ("bus or file", "EDS of nodes", "EDS folders", "alarms", "F5 apply"):
            assert word in text
        assert "no_lost_heartbeat = true" in text
        await form.pilot.press("f1")
        await until(form.pilot, lambda: "A field is as on the" in screen_text(form.monitor))

    on_form(wire_session(wire), setup_of(wire), act)


def test_a_running_monitor_goes_on_with_the_other_bus(wire: Wire) -> None:
    session = wire_session(wire)
    session.start()

    async def act(form: Form) -> None:
        await form.open()
        await form.apply(source=str(DRIVE))
        await until(form.pilot, lambda: form.monitor.session.model.frames == 134)

    on_form(session, setup_of(wire), act)


def test_what_is_written_is_read_back() -> None:
    texts = {
        **EMPTY,
        "source": "can0 'my log.log'",
        "interface": "virtual",
        "bitrate": "500000",
        "data_bitrate": "2000000",
        "bus_kwargs": "port=1",
        "eds": "3=a.eds",
        "dbc": "b.dbc",
        "filter": "emcy",
        "rules": "no_emcy = true\n",
    }
    settings = parse_settings(texts)
    assert setting_texts(settings) == texts
    with pytest.raises(InputError, match="nothing to listen to"):
        parse_settings(EMPTY)


def test_options_without_a_field_stay() -> None:
    before = MonitorSetup(options=BusOptions(timing=("brp=2",), fd=True))
    found = parse_settings({**EMPTY, "source": "can0"}, before).setup.options
    assert (found.timing, found.fd) == (("brp=2",), True)
