"""The panel of a chair: what its keys do, in virtual time."""

from __future__ import annotations

import asyncio
import runpy
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from tests.host.rrc.chair_bench import Bench
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc import panel as chair_panel
from tickrig.host.rrc.chair import ChairStopped
from tickrig.host.rrc.panel import HELP, ChairPanel
from tickrig.host.rrc.pilot import Drives, Pilot

TOOL = Path(__file__).parents[3] / "tools" / "rrc_panel_picture.py"

Act = Callable[["Seat", Any], Awaitable[None]]


class Seat:
    """A panel, and the chair that it drives."""

    def __init__(self, bench: Bench) -> None:
        self.bench, self.pilot = bench, Pilot(bench.chair)
        self.panel = ChairPanel(self.pilot, "/dev/rrc")

    def step(self, duration_us: int = 100_000) -> None:
        """Let time pass, and look."""
        until_us = self.bench.rig.now_us + duration_us
        while self.bench.rig.now_us < until_us:
            self.pilot.step()
        self.panel.look()

    def shown(self, name: str) -> str:
        return str(self.panel.query_one(f"#{name}").render())


def on_panel(act: Act, *, on: bool = True, size: tuple[int, int] = (80, 24)) -> None:
    seat = Seat(Bench(on=on))

    async def main() -> None:
        async with seat.panel.run_test(size=size) as keys:
            seat.step()
            await act(seat, keys)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chair_panel, "REFRESH_S", 3_600.0)  # it looks when it is told to
        asyncio.run(main())


def test_the_chair_drives_while_the_key_is_pressed_again() -> None:
    async def act(seat: Seat, keys: Any) -> None:
        await keys.press("h", "up", "up", "up", "left")
        seat.step()
        assert seat.bench.out_pct() == (0, 0)
        for _ in range(3):
            await keys.press("space")
            seat.step(900_000)
            assert seat.bench.out_pct() == (30, -10)
            assert " DRIVES  host drives" in seat.shown("state")
        seat.step(200_000)
        assert seat.bench.out_pct() == (0, 0)
        assert " released  host drives" in seat.shown("state")

    on_panel(act)


def test_nothing_drives_before_somebody_was_chosen() -> None:
    async def act(seat: Seat, keys: Any) -> None:
        await keys.press("up", "space")
        seat.step()
        assert seat.bench.out_pct() == (0, 0)
        assert seat.bench.rrc.read("state") == "Standby"

    on_panel(act)


@pytest.mark.parametrize("key", ["x", "n", "P"])
def test_a_key_lets_go_at_once(key: str) -> None:
    async def act(seat: Seat, keys: Any) -> None:
        await keys.press("h", "up", "space")
        seat.step()
        assert seat.bench.out_pct() == (10, 0)
        await keys.press(key)
        seat.step()
        assert seat.bench.out_pct() == (0, 0)
        assert seat.pilot.view.aim_pct == (0, 0)

    on_panel(act)


def test_the_stick_drives_within_the_limit() -> None:
    async def act(seat: Seat, keys: Any) -> None:
        seat.bench.rrc.inputs.set("stick_v_pct", 100)
        await keys.press("3", "s", "plus")
        seat.step()
        assert seat.bench.out_pct() == (60, 0)
        assert seat.bench.rrc.read("speed_mode") == 3
        assert "stick drives, at most 60 %" in seat.shown("state")
        await keys.press("minus", "minus", "b")
        seat.step()
        assert (seat.bench.out_pct(), seat.bench.rrc.read("buzzer")) == ((40, 0), 1)

    on_panel(act)


def test_a_power_cycle_sets_the_guard_again() -> None:
    async def act(seat: Seat, keys: Any) -> None:
        await keys.press("h", "up", "space")
        seat.step()
        seat.bench.rrc.inputs.set("power_button", 1)
        seat.step(50_000)
        seat.bench.rrc.inputs.set("power_button", 0)
        seat.step(1_000_000)
        assert "EV:PowerOffWaitByButton" in seat.shown("lines")
        assert "VR2 is off: press its power button" in seat.shown("state")
        assert seat.pilot.view.drives is Drives.STOPPED
        client = seat.bench.chair.client
        assert (client.stable, client.watchdog_us) == (True, 500_000)
        seat.bench.rrc.inputs.set("power_button", 1)
        seat.step(500_000)
        assert seat.pilot.view.status is not None
        await keys.press("h", "up", "space")
        seat.step()
        assert seat.bench.out_pct() == (10, 0)

    on_panel(act)


def test_what_is_asked_while_vr2_is_off_is_said() -> None:
    async def act(seat: Seat, keys: Any) -> None:
        await keys.press("h")
        seat.step(500_000)
        assert "! VR2 is off: press its power button" in seat.shown("lines")
        await keys.press("P")
        seat.step()
        assert "ER:poweroff" in seat.shown("lines")

    on_panel(act, on=False)


def test_help_names_every_key_and_can_be_left() -> None:
    async def act(seat: Seat, keys: Any) -> None:
        helps = []
        for key in ("f1", "escape"):
            await keys.press(key)
            helps.append(seat.panel.helps)
        assert helps == [True, False]
        for key in ("space", "arrows", "x ", "h ", "s ", "n ", "1-5", "b ", "P ", "q "):
            assert f"\n{key}" in f"\n{HELP}"

    on_panel(act)


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (60, 15)])
def test_it_fits_the_terminal(size: tuple[int, int]) -> None:
    async def act(seat: Seat, keys: Any) -> None:
        state = seat.panel.query_one("#state")
        rows = seat.shown("state").split("\n")
        assert len(rows) <= state.content_size.height
        assert max(map(len, rows)) <= state.content_size.width
        assert seat.panel.query_one("#keys").region.bottom == size[1]

    on_panel(act, size=size)


def test_a_terminal_that_is_too_small_says_so() -> None:
    async def act(seat: Seat, keys: Any) -> None:
        assert "terminal too small: 40 x 10, at least 60 x 15" in seat.shown("tiny")

    on_panel(act, size=(40, 10))


def step_for_2_s(pilot: Pilot) -> None:
    for _ in range(100):
        pilot.step()


def test_an_rrc_that_falls_silent_ends_the_pilot() -> None:
    seat = Bench()
    pilot = Pilot(seat.chair)
    seat.rrc.inputs.set("rrc_power", 0)
    with pytest.raises(LinkTimeout, match="no status line for 300 ms"):
        step_for_2_s(pilot)


class Pad:
    """A game pad whose stick a test moves."""

    hand: tuple[int, int] | None = 0, 0

    def poll(self, now_us: int, /) -> tuple[int, int]:
        if self.hand is None:
            raise ChairStopped("the pad is gone")
        return self.hand


def test_a_pad_drives_while_its_button_is_held() -> None:
    bench, pad = Bench(), Pad()
    pilot = Pilot(bench.chair, pad)
    pilot.take(Drives.HOST)
    pad.hand = 50, -20
    for _ in range(10):
        pilot.step()
    assert bench.out_pct() == (50, -20)
    pad.hand = 0, 0
    pilot.step()
    assert bench.out_pct() == (0, 0)


def test_a_pad_that_is_gone_stops_the_chair() -> None:
    bench, pad = Bench(), Pad()
    pilot = Pilot(bench.chair, pad)
    pilot.take(Drives.HOST)
    pad.hand = 50, -20
    for _ in range(10):
        pilot.step()
    pad.hand = None
    pilot.step()
    assert bench.out_pct() == (0, 0)
    assert [text for _, _, text in pilot.view.lines][-1] == "the pad is gone"
    assert pilot.view.drives is Drives.STOPPED


def test_the_picture_is_the_panel() -> None:
    drawn = runpy.run_path(str(TOOL))["host_picture"]().replace("&#160;", " ")
    for text in ("DRIVES", "host drives", "/dev/ttyACM0", "speed mode 2"):
        assert text in drawn
    assert "@font-face" not in drawn
