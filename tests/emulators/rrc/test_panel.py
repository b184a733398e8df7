from __future__ import annotations

import asyncio
import runpy
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.bench.control import EmulatorControl, EmulatorEnded, RequestInbox
from tickrig.emulators.rrc import panel as rrc_panel
from tickrig.emulators.rrc import panel_text, small_panel_text
from tickrig.emulators.rrc.panel import HELP, RrcPanel, run_panel
from tickrig.emulators.rrc.panel_text import PanelView
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.requests import Object
from tickrig.host.rrc import gauges

TOOL = Path(__file__).parents[3] / "tools" / "rrc_panel_picture.py"

Act = Callable[[RrcPanel, Emulator, Any], Awaitable[None]]


def on_panel(act: Act, size: tuple[int, int] = (80, 24)) -> None:
    """Run a panel on an emulator in virtual time: 10 ms pass with each look at it."""
    emulator = Emulator("rrc", Rrc(), link="/tmp/rrc")
    control = EmulatorControl(emulator)

    async def ask(requests: Sequence[Object]) -> list[Object]:
        pass_time(emulator, 10_000)
        return [control.answer(request) for request in requests]

    async def main() -> None:
        panel = RrcPanel(ask)
        async with panel.run_test(size=size) as pilot:
            await panel.look()
            await act(panel, emulator, pilot)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rrc_panel, "_REFRESH_S", 3_600.0)  # it looks when it is told to
        asyncio.run(main())


def pass_time(emulator: Emulator, duration_us: int) -> None:
    until_us = emulator.rig.now_us + duration_us
    emulator.event_queue.put("until", until_us, lambda now_us: None)
    while emulator.event_queue.due_us <= until_us:
        emulator.step()


def shown(panel: RrcPanel, name: str) -> str:
    return str(panel.query_one(f"#{name}").render())


def inputs(emulator: Emulator, *names: str) -> list[object]:
    return [emulator.device.inputs[name] for name in names]


def test_the_arrows_move_the_stick_by_steps_and_space_lets_it_go() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.press("up", "up", "up", "left", "right", "right")
        assert inputs(emulator, "stick_v_pct", "stick_w_pct") == [30, 10]
        emulator.operator.set("stick", -90, -90)
        await panel.look()
        await pilot.press("down", "down", "left", "left")
        assert inputs(emulator, "stick_v_pct", "stick_w_pct") == [-100, -100]
        assert "v -100 %     w -100 %" in shown(panel, "stick")
        await pilot.press("space")
        assert inputs(emulator, "stick_v_pct", "stick_w_pct") == [0, 0]

    on_panel(act)


def test_the_power_key_is_a_pulse_that_switches_vr2_on() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.press("p")
        pass_time(emulator, 500_000)
        await panel.look()
        assert inputs(emulator, "power_button") == [0]
        assert "Standby" in shown(panel, "outputs")
        assert "● VR2 runs" in shown(panel, "outputs")
        assert "< EV:PowerOnSuccess" in shown(panel, "wire")

    on_panel(act)


def test_held_speed_buttons_and_alarm_choose_how_the_stick_drives() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.press("p")
        pass_time(emulator, 500_000)
        await panel.look()
        await pilot.press("D")
        assert inputs(emulator, "speed_down_button") == [1]
        await pilot.press("a", "down", "down", "right")
        assert emulator.device.read("out_v_pct") == 0
        assert emulator.device.read("out_w_pct") == 10
        await pilot.press("D", "U", "U", "u", "d")
        assert inputs(emulator, "speed_up_button") == [1]
        pass_time(emulator, 200_000)
        assert inputs(emulator, "speed_up_button", "speed_down_button") == [0, 0]

    on_panel(act)


def test_number_keys_let_faults_come_and_go() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.press("4", "6")
        assert emulator.status()["faults"] == "cut vr2_fault"
        await pilot.press("4", "6")
        assert emulator.status()["faults"] == ""

    on_panel(act)


def test_the_wire_is_shown_without_the_stream_of_sa_lines() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.press("p")
        pass_time(emulator, 500_000)
        emulator.send(emulator.rig.now_us, b"statusA1\n[b]hello\n")
        pass_time(emulator, 50_000)
        await panel.look()
        text = shown(panel, "wire")
        assert "> statusA1" in text
        assert "> [b]hello" in text
        assert "< ER:CommandUnknown" in text
        assert "SA:" not in text
        assert panel.view.report.startswith("SA:0000")

    on_panel(act)


@pytest.mark.parametrize("key", ["q", "ctrl+c"])
def test_it_can_be_left(key: str) -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.press(key)
        await pilot.pause()
        assert not panel.is_running

    on_panel(act)


@pytest.mark.parametrize("key", ["q", "ctrl+c"])
def test_it_can_be_left_while_the_emulator_does_not_answer(key: str) -> None:
    async def main() -> None:
        asked = asyncio.Event()

        async def ask(requests: Sequence[Object]) -> list[Object]:
            asked.set()
            return await asyncio.Future()

        panel = RrcPanel(ask)
        async with panel.run_test() as pilot:
            await asked.wait()
            await pilot.press(key)
            await pilot.pause()
            assert not panel.is_running

    asyncio.run(asyncio.wait_for(main(), 20))


def test_it_ends_with_its_emulator() -> None:
    async def ask(requests: Sequence[Object]) -> list[Object]:
        raise EmulatorEnded

    async def main() -> None:
        panel = RrcPanel(ask)
        async with panel.run_test() as pilot:
            await panel.look()
            await pilot.pause()
            assert not panel.is_running

    asyncio.run(main())


def on_screen(panel: RrcPanel) -> list[str]:
    """Return what stands on the screen, line by line."""
    return [
        "".join(segment.text for segment in line).rstrip()
        for line in panel.screen._compositor.render_strips()
    ]


def drive_in_limit_mode(emulator: Emulator) -> None:
    emulator.operator.press(emulator.effective_us, "power_button", 100_000)
    pass_time(emulator, 500_000)
    emulator.operator.set("stick", -100, -100)
    emulator.send(emulator.rig.now_us, b"statusA1\nlimit6464ffffff\n")
    pass_time(emulator, 100_000)


@pytest.mark.parametrize("size", [(60, 15), (60, 40), (79, 24), (200, 23)])
def test_in_60_columns_and_15_lines_all_is_there(size: tuple[int, int]) -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        drive_in_limit_mode(emulator)
        pass_time(emulator, 100_000)
        await pilot.pause()
        await panel.look()
        await pilot.pause()
        text = "\n".join(on_screen(panel))
        for words in (
            *("Limit", "● VR2 runs", "○ error LED", "○ buzzer", "stick drives, within limits load"),
            *("load 50 %, margin 50 % ≤100/s",),
            *("v stick -100  out", "w stick -100  out", "█│░░░░░░░░░░░░░░░ -100 %"),
            *(
                "speed ■□□□□ 1  gear N  gauge ■■■■■■■■■■ 10",
                "power   alarm   speed up",
            ),
            *("3 power_module_fault", "6 cut", "< OK:limit", "F1 help", "q quit", "1-6 faults"),
            *("in -100 -100 out -100 -100 gauge 10 speed 1 keys 0 0 0", "/tmp/rrc"),
        ):
            assert words in text

    on_panel(act, size)


def test_load_margin_and_pace_stand_in_one_row() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        drive_in_limit_mode(emulator)
        emulator.send(emulator.rig.now_us, b"limit6464ffffff\n" * 2)
        pass_time(emulator, 10_000)
        await panel.look()
        await pilot.pause()
        load_pct = panel.view.number("load_pct")
        row = f"load   {load_pct} %, margin {100 - load_pct} %; at most 100 lines/s"
        assert 50 < load_pct < 100
        assert row in "\n".join(on_screen(panel))

    on_panel(act)


def test_a_load_that_is_too_much_fits_and_is_marked() -> None:
    values: dict[str, int | str] = {
        "load_pct": 1_030,
        "margin_pct": -930,
        "pace_lines_s": 0,
        "state": "Standby",
    }
    view = PanelView(values)
    roomy, small = panel_text.outputs_pane(view), small_panel_text.outputs_pane(view)
    assert "load   1030 %, margin -930 %; at most 0 lines/s" in roomy.plain.split("\n")
    assert small.plain.split("\n")[1].endswith(" load 1030 %, margin -930 % ≤0/s")
    assert max(len(row) for row in small.plain.split("\n")) <= 60
    assert [panel_text.load(PanelView({"margin_pct": pct})).style for pct in (10, 9, -1)] == [
        "",
        gauges.ON,
        gauges.FAULT,
    ]


@pytest.mark.parametrize("size", [(59, 15), (60, 14), (20, 3)])
def test_a_terminal_that_is_too_small_is_told(size: tuple[int, int]) -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.pause()
        assert "v stick" in "\n".join(on_screen(panel))
        await pilot.resize_terminal(*size)
        await panel.look()
        await pilot.pause()
        shown = " ".join(line.strip() for line in on_screen(panel)).split()
        assert shown == f"terminal too small: {size[0]} x {size[1]}, at least 60 x 15".split()
        await pilot.resize_terminal(80, 24)
        await panel.look()
        await pilot.pause()
        assert "─ stick ─" in "\n".join(on_screen(panel))

    on_panel(act, (60, 15))


def test_it_lives_in_a_large_terminal() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.pause()
        assert "─ stick ─" in "\n".join(on_screen(panel))

    on_panel(act, (200, 60))


@pytest.mark.parametrize("size", [(60, 15), (80, 24)])
def test_f1_explains_the_keys_and_escape_leaves_the_help(size: tuple[int, int]) -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        for leave in ("escape", "f1", "question_mark"):
            await pilot.press("f1")
            await pilot.pause()
            lines = [line.strip() for line in on_screen(panel)]
            assert {line.strip() for line in HELP.splitlines()} <= set(lines)
            await pilot.press(leave)
            await pilot.pause()
            assert "q       end the emulator" not in on_screen(panel)
            assert "○ VR2 runs" in "\n".join(on_screen(panel))

    on_panel(act, size)


def test_the_sa_line_is_told_in_words_and_goes_with_the_stream() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        drive_in_limit_mode(emulator)
        emulator.operator.press(emulator.effective_us, "alarm_button", 20_000)
        pass_time(emulator, 50_000)
        await panel.look()
        told = "stick -100 -100  out -100 -100  gauge 10  speed 1  up 0 down 0 alarm 2"
        assert shown(panel, "report").strip() == told
        emulator.send(emulator.rig.now_us, b"statusA0\n")
        pass_time(emulator, 120_000)
        await panel.look()
        assert not shown(panel, "report")

    on_panel(act)


def test_the_sa_line_goes_at_once_when_vr2_does() -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        drive_in_limit_mode(emulator)
        await panel.look()
        assert shown(panel, "report")
        emulator.send(emulator.rig.now_us, b"poweroff\n")
        pass_time(emulator, 30_000)
        await panel.look()
        assert not shown(panel, "report")

    on_panel(act)


@pytest.mark.parametrize(
    ("state", "drives", "hint"),
    [
        ("Off", 0, "the RRC has no power"),
        ("WaitPowerOn", 0, "waits for p: VR2 off"),
        ("Standby", 0, "waits for limit, or a"),
        ("Standby", 1, "drives"),
        ("Limit", 1, "drives, within limits"),
        ("Output", 0, "the host drives"),
        ("PowerOffByButton", 0, "waits: VR2 goes off"),
        ("PowerOffByOthers", 0, "waits for p: stopped"),
    ],
)
def test_what_the_stick_waits_for_is_told(state: str, drives: int, hint: str) -> None:
    view = PanelView({"state": state, "stick_drives": drives})
    assert panel_text.stick_hint(view) == hint
    assert len(hint) <= 21


def test_an_sa_line_that_cannot_be_read_is_shown_as_it_is() -> None:
    for panes in (panel_text, small_panel_text):
        assert panes.report_line(PanelView(report="SA:nonsense")).plain == "SA:nonsense"
        assert panes.report_line(PanelView()).plain == ""


def test_the_picture_is_the_panel() -> None:
    svg = runpy.run_path(str(TOOL))["picture"]().replace("&#160;", " ")
    for text in ("Limit", "within limits", "stick +80 -30", "hello", "ER:CommandUnknown"):
        assert text in svg
    assert "@font-face" not in svg


def test_trouble_is_in_the_status_line() -> None:
    status: dict[str, int | str] = {
        **{"link": "/tmp/rrc", "now_us": 1_500_000, "late_steps": 3, "lost_bytes": 4},
        **{"host_setting": "9600 8N1", "trace_error": "disk full"},
    }
    assert panel_text.status_line(PanelView(status=status)).plain == (
        " /tmp/rrc   1.5 s   late ticks 3   lost bytes 4   host at 9600 8N1"
        "   trace ended: disk full"
    )
    assert panel_text.status_line(PanelView()).plain == "    0.0 s   late ticks 0   lost bytes 0"


def test_what_goes_wrong_in_the_rig_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: Emulator) -> None:
        raise ZeroDivisionError

    def show(self: RrcPanel) -> None:
        self._when_ready()

    monkeypatch.setattr(Emulator, "step", broken)
    monkeypatch.setattr(RrcPanel, "run", show)
    with pytest.raises(ZeroDivisionError):
        run_panel(Emulator("rrc", Rrc()))


def test_an_inbox_answers_together_and_refuses_after_the_end() -> None:
    inbox = RequestInbox(EmulatorControl(Emulator("rrc", Rrc())))
    asked = inbox.post([{"v": 1, "do": "get", "names": ["gauge"]}, {"v": 1, "do": "nope"}])
    assert not asked.done()
    inbox.serve()
    assert [answer["ok"] for answer in asked.result(0)] == [True, False]
    given_up = inbox.post([])
    given_up.cancel()
    inbox.serve()
    waiting = inbox.post([{"v": 1, "do": "get"}])
    inbox.close()
    assert isinstance(waiting.exception(0), EmulatorEnded)
    assert isinstance(inbox.post([]).exception(0), EmulatorEnded)
