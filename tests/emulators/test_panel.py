from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

import pytest

from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.control import Control
from tickrig.emulators.emulator import Emulator
from tickrig.emulators.inbox import EmulatorEnded, Inbox
from tickrig.emulators.requests import Object
from tickrig.emulators.rrc import panel_text
from tickrig.emulators.rrc.panel import RrcPanel
from tickrig.emulators.rrc.panel_picture import picture
from tickrig.emulators.rrc.panel_run import run_panel
from tickrig.emulators.rrc.panel_text import View

Act = Callable[[RrcPanel, Emulator, Any], Awaitable[None]]


def on_panel(act: Act, size: tuple[int, int] = (80, 24)) -> None:
    """Run a panel on an emulator in virtual time: 10 ms pass with each look at it."""
    emulator = Emulator("rrc", Rrc(), link="/tmp/rrc")
    control = Control(emulator)

    async def ask(requests: Sequence[Object]) -> list[Object]:
        pass_time(emulator, 10_000)
        return [control.answer(request) for request in requests]

    async def main() -> None:
        panel = RrcPanel(ask)
        async with panel.run_test(size=size) as pilot:
            await panel.look()
            await act(panel, emulator, pilot)

    asyncio.run(main())


def pass_time(emulator: Emulator, duration_us: int) -> None:
    until_us = emulator.rig.now_us + duration_us
    emulator.agenda.put("until", until_us, lambda now_us: None)
    while emulator.agenda.due_us <= until_us:
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


@pytest.mark.parametrize("size", [(40, 10), (200, 60)])
def test_it_lives_in_small_and_large_terminals(size: tuple[int, int]) -> None:
    async def act(panel: RrcPanel, emulator: Emulator, pilot: Any) -> None:
        await pilot.resize_terminal(*size)
        await panel.look()

    on_panel(act, (80, 24))


def test_the_picture_is_the_panel() -> None:
    svg = picture().replace("&#160;", " ")
    for text in ("Limit", "hold", "statusA1", "ER:CommandUnknown"):
        assert text in svg


def test_a_bar_begins_at_zero() -> None:
    assert panel_text.bar(0).plain == "░" * 15 + "│" + "░" * 15 + "    0 %"
    assert panel_text.bar(100).plain == "░" * 15 + "│" + "█" * 15 + " +100 %"
    assert panel_text.bar(-40).plain == "░" * 9 + "█" * 6 + "│" + "░" * 15 + "  -40 %"


@pytest.mark.parametrize(
    ("v_pct", "w_pct", "row", "column"),
    [(0, 0, 5, 10), (100, 100, 0, 20), (-100, -100, 10, 0), (100, -100, 0, 0), (50, 0, 3, 10)],
)
def test_the_stick_is_where_it_is(v_pct: int, w_pct: int, row: int, column: int) -> None:
    rows = panel_text.stick_pad(v_pct, w_pct).plain.split("\n")
    assert [(y, line.index("●")) for y, line in enumerate(rows) if "●" in line] == [(row, column)]


def test_trouble_is_in_the_status_line() -> None:
    status: dict[str, int | str] = {
        **{"link": "/tmp/rrc", "now_us": 1_500_000, "late_steps": 3, "lost_bytes": 4},
        **{"host_setting": "9600 8N1", "trace_error": "disk full"},
    }
    assert panel_text.status_line(View(status=status)).plain == (
        " /tmp/rrc   1.5 s   late ticks 3   lost bytes 4   host at 9600 8N1"
        "   trace ended: disk full"
    )
    assert panel_text.status_line(View()).plain == "    0.0 s   late ticks 0   lost bytes 0"


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
    inbox = Inbox(Control(Emulator("rrc", Rrc())))
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
