"""`canmon top` in a terminal, fed by python-can over the loopback."""

from __future__ import annotations

import signal
import termios
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest

from tests.host.canmon.terminal import Terminal
from tests.interop.buses import GROUP, PORT
from tickrig.host.canmon.output.listening import ENTER, LEAVE

pytestmark = pytest.mark.realtime

BUS = (f"udp:{GROUP}", "--bus-kwargs", f"port={PORT}")
BURST = 10_000


@pytest.fixture
def bus() -> Iterator[can.BusABC]:
    with can.Bus(interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0) as bus:
        yield bus


def send(bus: can.BusABC, can_id: int, data: str) -> None:
    bus.send(can.Message(arbitration_id=can_id, data=bytes.fromhex(data), is_extended_id=False))


def top(*words: str, columns: int = 100) -> Terminal:
    terminal = Terminal("top", *BUS, *words, columns=columns)
    terminal.wait_for("0 identifiers")
    return terminal


def by_key(terminal: Terminal) -> None:
    terminal.child.send("q")


def by_interrupt(terminal: Terminal) -> None:
    terminal.child.sendintr()


def by_signal(terminal: Terminal) -> None:
    terminal.child.kill(signal.SIGTERM)


@pytest.mark.parametrize("leave", [by_key, by_interrupt, by_signal])
def test_a_frame_is_shown_and_the_terminal_is_left_as_it_was(
    bus: can.BusABC, leave: Callable[[Terminal], None]
) -> None:
    terminal = top()
    send(bus, 0x181, "DEAD")
    terminal.wait_for("DE AD")
    leave(terminal)
    assert terminal.end() == 0
    screen, _, after = terminal.written.rpartition(LEAVE)
    assert ENTER in screen
    assert "DE AD" in after, "the last table stays"
    assert "Traceback" not in after


def test_the_modes_of_the_terminal_come_back(bus: can.BusABC) -> None:
    terminal = top()
    descriptor = terminal.child.child_fd
    assert not termios.tcgetattr(descriptor)[3] & termios.ICANON
    terminal.child.sendintr()
    terminal.child.expect_exact(LEAVE)
    terminal.child.expect_exact("identifiers by id")
    assert termios.tcgetattr(descriptor)[3] == terminal.modes[3]
    assert terminal.end() == 0


def test_it_cannot_be_left_half_by_ctrl_z(bus: can.BusABC) -> None:
    terminal = top()
    terminal.child.sendcontrol("z")
    send(bus, 0x181, "DEAD")
    terminal.wait_for("DE AD")
    by_key(terminal)
    assert terminal.end() == 0


def test_a_wider_window_has_more_columns(bus: can.BusABC) -> None:
    terminal = top(columns=60)
    assert "jitter" not in terminal.text()
    terminal.resize(140, 30)
    terminal.wait_for("jitter")
    terminal.resize(60, 10)
    send(bus, 0x181, "DEAD")
    terminal.wait_for("DE AD")
    assert "jitter" not in terminal.text()
    by_key(terminal)
    assert terminal.end() == 0


def test_keys_change_the_view(bus: can.BusABC) -> None:
    terminal = top()
    send(bus, 0x181, "00")
    send(bus, 0x181, "80")
    terminal.wait_for("80")
    terminal.child.send("b")
    terminal.wait_for("█·······")
    terminal.child.send("s")
    terminal.wait_for("by rate")
    terminal.child.send("c")
    terminal.wait_for("0 identifiers")
    by_key(terminal)
    assert terminal.end() == 0


def test_it_ends_after_the_time_that_is_given() -> None:
    terminal = Terminal("top", *BUS, "--for", "300ms")
    assert terminal.end() == 0


def test_a_burst_is_counted_whole(tmp_path: Path) -> None:
    log = tmp_path / "burst"
    lines = (f"(1.{n:06d}) can0 {0x181 + n % 50:03X}#{n:08X}\n" for n in range(BURST))
    log.write_text("".join(lines), "ascii")
    terminal = Terminal("top", "-", feed=log)
    assert terminal.end() == 0
    assert f"can0: {BURST} frames" in terminal.written
    assert "lost 0, 50 identifiers" in terminal.written
