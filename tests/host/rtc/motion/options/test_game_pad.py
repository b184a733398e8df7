from __future__ import annotations

import os
import pty
import termios

import pytest

from tests.host.rtc.motion.port_bench import PERIOD_US, PortBench
from tickrig.host.links.game_pad import StickPosition
from tickrig.host.links.link import LinkClosed
from tickrig.host.rtc.motion.options.game_pad import GamePad, KeyboardPad, open_pad
from tickrig.wire.rtc_types.rtc import Velocity2D


class Held:
    """A pad whose hand a test moves."""

    def __init__(self) -> None:
        self.hand, self.gone, self.closed = StickPosition(), False, 0

    def poll(self, now_us: int, /) -> StickPosition:
        if self.gone:
            raise LinkClosed("the pad is gone")
        return self.hand

    def close(self) -> None:
        self.closed += 1


def bench(**settings: str) -> tuple[PortBench[GamePad], Held]:
    held = Held()
    return PortBench(GamePad("GamePad0", lambda name: held), **settings), held


def written(on: PortBench[GamePad], periods: int = 1) -> list[Velocity2D]:
    on.taken("velocity")
    on.period(periods)
    return [value.data for value in on.taken("velocity")]


def test_a_hand_becomes_a_velocity_in_each_period() -> None:
    on, held = bench(max_v="0.5", max_w="1.0")
    held.hand = StickPosition(0.5, -1.0, 0.25)
    assert written(on, 3) == [Velocity2D(0.25, -0.3, 0.25)] * 3


def test_letting_go_is_told_once() -> None:
    on, held = bench()
    held.hand = StickPosition(forward=1.0)
    on.period()
    held.hand = StickPosition()
    assert written(on, 3) == [Velocity2D()]


def test_a_stick_near_its_middle_is_let_go() -> None:
    on, held = bench()
    held.hand = StickPosition(0.1, -0.1, 0.05)
    assert written(on, 2) == []


def test_a_pad_that_is_gone_lets_go_and_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    on, held = bench()
    held.hand = StickPosition(forward=1.0)
    on.period()
    held.gone = True
    assert written(on, 2) == [Velocity2D()]
    assert (on.state, held.closed) == ("ERROR", 1)
    assert "GamePad0: the pad is gone" in caplog.text
    held.gone = False
    on.manager.reset("GamePad0")
    on.period()
    on.activate()
    assert written(on)[-1].vx == 0.3


def test_deactivation_lets_go() -> None:
    on, held = bench()
    held.hand = StickPosition(turn=-1.0)
    on.period()
    on.taken("velocity")
    on.deactivate()
    assert [value.data for value in on.taken("velocity")] == [Velocity2D()]
    assert held.closed == 1


def test_a_pad_that_cannot_be_opened_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    on = PortBench(GamePad("GamePad0"), DeviceFileName="/dev/input/nothing")
    on.period()
    assert on.state == "ERROR"
    assert "GamePad0: " in caplog.text


def test_a_key_pushes_while_it_repeats() -> None:
    host, terminal = pty.openpty()
    pad = KeyboardPad(terminal)
    os.write(host, b"xw")
    assert pad.poll(PERIOD_US) == StickPosition(forward=1.0)
    assert pad.poll(PERIOD_US + 299_000) == StickPosition(forward=1.0)
    assert pad.poll(PERIOD_US + 300_000) == StickPosition()
    os.write(host, b"a ")
    assert pad.poll(2_000_000) == StickPosition()
    os.close(host)
    os.close(terminal)


def test_the_terminal_is_left_as_it_was() -> None:
    host, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    pad = KeyboardPad(terminal)
    assert not termios.tcgetattr(terminal)[3] & termios.ECHO
    pad.close()
    assert termios.tcgetattr(terminal) == before
    os.close(host)
    os.close(terminal)


def test_a_keyboard_that_is_no_terminal_is_refused() -> None:
    read_end, write_end = os.pipe()
    with pytest.raises(LinkClosed, match="the keyboard is no terminal"):
        KeyboardPad(read_end)
    os.close(read_end)
    os.close(write_end)


def test_the_keyboard_has_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    host, terminal = pty.openpty()
    with os.fdopen(terminal, "r") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        open_pad("keyboard").close()
    os.close(host)
