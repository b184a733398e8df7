"""The recorder of the monitor: its key, its light, and what it keeps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.host.canmon.tui.pilot import drive_session, on_monitor, wire_session
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.model.frames import AnyRecord
from tickrig.host.canmon.model.logs.log_file import Mark, gone
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.tui.app import MonitorApp, RecorderTask, StatusLine
from tickrig.host.canmon.tui.session import Model, Session
from tickrig.host.canmon.workspace import MonitorSetup, PanelSettings, Workspace
from tickrig.host.tui import line_text
from tickrig.wire.can import CanFrame

TRIES = 200


def status(monitor: MonitorApp) -> str:
    monitor.refresh_view()
    return line_text(monitor.query_one(StatusLine).line)


def said(monitor: MonitorApp) -> list[str]:
    return [note.message for note in monitor._notifications]


async def record(monitor: MonitorApp, pilot: Any, words: str) -> None:
    await pilot.press("f8")
    monitor.screen.query_one("Input").value = words  # type: ignore[attr-defined]
    await pilot.press("enter")


def hear(session: Session, wire: Wire, *frames: str) -> None:
    """Send frames, and let the session take them: it is called by its recorder, too."""
    count = session.model.frames + len(frames)
    for frame in frames:
        wire.send(frame)
    for _ in range(TRIES):
        if session.model.frames == count:
            return
        session.step(100_000)
    raise AssertionError(session.model.frames)


def frames(path: Path) -> list[str]:
    return [str(one.frame) for one in read_log(path)]


def test_f8_records_what_comes_until_it_is_pressed_again(wire: Wire, tmp_path: Path) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        hear(session, wire, "701#00")
        assert "REC" not in status(monitor)
        for name in ("run-00001.log", "run-00002.log"):
            await record(monitor, pilot, str(tmp_path / "run.log"))
            assert " REC  0 frames " in status(monitor)
            hear(session, wire, "702#00", "703#00")
            assert " REC  2 frames " in status(monitor)
            await pilot.press("f8")
            assert "REC" not in status(monitor)
            assert said(monitor)[-1].startswith("2 frames in 1 file; ")
            hear(session, wire, "704#00")
            assert frames(tmp_path / name) == ["702#00", "703#00"]

    on_monitor(session, act).recorder.end()


def test_f4_triggers_a_recording_that_waits(wire: Wire, tmp_path: Path) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("f4")
        assert said(monitor)[-1].startswith("nothing waits for a trigger")
        await record(monitor, pilot, f"{tmp_path}/run.log --pre 1 --post 1 --trigger emcy")
        hear(session, wire, "701#00", "702#00", "703#00")
        assert " REC WAITS  0 frames " in status(monitor)
        await pilot.press("f4")
        assert " REC  2 frames " in status(monitor)
        hear(session, wire, "704#00", "705#00")
        assert " REC WAITS " in status(monitor)
        hear(session, wire, "085#3081110000000000")
        assert " REC  5 frames " in status(monitor)

    on_monitor(session, act).recorder.end()
    assert frames(tmp_path / "run-00001.log") == ["702#00", "703#00", "704#00"]
    assert frames(tmp_path / "run-00002.log")[-1] == "085#3081110000000000"


def test_what_this_program_sends_is_recorded_too(wire: Wire, tmp_path: Path) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await record(monitor, pilot, f"{tmp_path}/run.log")
        session.arm()
        session._send("", CanFrame.parse("000#0105"))
        session.step()

    on_monitor(session, act).recorder.end()
    assert [one.sent for one in read_log(tmp_path / "run-00001.log")] == [True]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("run.xyz", "run.xyz: a log's name ends in"),
        ("{folder}/no/run.log", "{folder}/no/run.index.jsonl: No such file or directory"),
        ("run.log --rotate 0M", "--rotate '0M' is too small: at least 64k"),
        ("run.log --trigger 'emcy and'", "--trigger: filter 'emcy and', column"),
        ("run.log --colour", "No such option"),
        ("run.log 'a", '"run.log \'a": No closing quotation'),
        ("--help", "--help: write FILE"),
        ("run.mf4", "run.mf4: mf4 is written as a whole"),
    ],
)
def test_a_mistake_is_told(wire: Wire, tmp_path: Path, words: str, text: str) -> None:
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await record(monitor, pilot, words.replace("{folder}", str(tmp_path)))
        assert said(monitor)[-1].startswith(text.replace("{folder}", str(tmp_path)))
        assert not monitor.recorder.running
        await pilot.press("f8", "escape")
        assert not monitor.recorder.running

    on_monitor(session, act).recorder.end()


def test_a_log_is_not_recorded(tmp_path: Path) -> None:
    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("f8")
        assert said(monitor) == ["all of a log is there: canmon conv writes it into another"]

    on_monitor(drive_session(), act)


def test_what_was_recorded_last_is_kept(wire: Wire, tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(f'[record]\nwords = "{tmp_path}/last.log --rotate 1M"\n')
    session, kept = wire_session(wire), []
    recorder = RecorderTask(session)
    settings = PanelSettings(Workspace.read(path), MonitorSetup(), [recorder])
    settings.load()
    kept = [recorder.words, *settings.unknown()]
    recorder.start(f"{tmp_path}/next.log")
    assert settings.save() == ""
    session.close()
    session.source.close()
    recorder.end()
    assert kept == [f"{tmp_path}/last.log --rotate 1M"]
    assert "next.log" in path.read_text()


class Gone(AnySource[AnyRecord]):
    """A bus that went away."""

    live, lost = True, 12
    away = ("can0",)

    def __init__(self) -> None:
        self.reopened = False

    def reopen(self) -> None:
        self.reopened = True

    def poll(self, timeout_us: int, /) -> Sequence[AnyRecord]:
        self.marks: Sequence[Mark] = (gone(5, "can0", "x"),)
        return ()


def test_a_bus_that_went_away_is_told_and_marked_once_it_is_recorded(tmp_path: Path) -> None:
    source = Gone()
    session = Session(source, Model())

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        session.step()
        assert "can0 is gone" in status(monitor)
        await record(monitor, pilot, f"{tmp_path}/run.jsonl")
        assert source.reopened
        session.step()
        index = (tmp_path / "run.index.jsonl").read_text()
        assert index.count('"ev":"gone"') == 1
        assert '"ev":"drop"' not in index  # what was lost before it began

    on_monitor(session, act).recorder.end()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_recording_that_fails_has_a_red_light_and_counts(wire: Wire, tmp_path: Path) -> None:
    (tmp_path / "run-00001.log").symlink_to("/dev/full")
    session = wire_session(wire)

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await record(monitor, pilot, f"{tmp_path}/run.log")
        (tmp_path / "run-00002.log").symlink_to("/dev/full")
        hear(session, wire, "701#00", "702#00")
        text = status(monitor)
        assert f"REC FAILED: {tmp_path}/run-00002.log: No space left on device" in text
        assert "2 frames missing" in text
        assert not monitor.recorder.running

    on_monitor(session, act).recorder.end()
