from __future__ import annotations

import os
import pty
import threading
import tty
from collections.abc import Iterator
from contextlib import suppress

import pytest

from tickrig.host.links.terminal import MOST_WAITING, TerminalOutput

pytestmark = pytest.mark.realtime

PATIENCE_S = 20.0


class Pty:
    """Both ends of a terminal."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)

    def read(self, count: int) -> bytes:
        got = b""
        while len(got) < count:
            got += os.read(self.master, count - len(got))
        return got

    def close(self) -> None:
        for name in ("master", "slave"):
            with suppress(OSError):
                os.close(getattr(self, name))


@pytest.fixture
def terminal() -> Iterator[Pty]:
    terminal = Pty()
    yield terminal
    terminal.close()


def test_text_is_written_in_its_order(terminal: Pty) -> None:
    output = TerminalOutput(terminal.slave)
    output.write("a")
    output.write("b")
    assert output.close()
    assert terminal.read(2) == b"ab"


def test_who_writes_to_a_stuck_terminal_does_not_wait(terminal: Pty) -> None:
    caught_up = threading.Event()
    output = TerminalOutput(terminal.slave, caught_up.set)
    for _ in range(10):
        output.write("x" * (MOST_WAITING // 2))
    assert output.is_behind
    output.write("last", last=True)
    while terminal.read(1) != b"l":
        pass
    assert terminal.read(3) == b"ast"
    assert caught_up.wait(PATIENCE_S)
    assert output.close()


def test_a_stuck_terminal_is_given_up_at_the_end(terminal: Pty) -> None:
    output = TerminalOutput(terminal.slave)
    output.write("x" * MOST_WAITING)
    assert not output.close()


def test_a_terminal_that_is_closed_is_noticed_though_nothing_is_written(terminal: Pty) -> None:
    lost = threading.Event()
    output = TerminalOutput(terminal.slave, lost=lost.set)
    os.close(terminal.master)
    assert lost.wait(PATIENCE_S)
    output.write("x")
    assert output.gone
    assert not output.is_behind
    assert not output.close()


def test_a_terminal_that_is_closed_ends_a_write(terminal: Pty) -> None:
    lost = threading.Event()
    output = TerminalOutput(terminal.slave, lost=lost.set)
    output.write("x" * MOST_WAITING)
    os.close(terminal.master)
    assert lost.wait(PATIENCE_S)
