"""The same calls to a port on a pseudo-terminal and to one on a rig: equal, or on the page."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import pytest
import serial

from tests.emulators.serial.outside.test_like_pyserial import OnPty, OnRig
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS

pytestmark = pytest.mark.realtime

PAGE: Final = Path(__file__).parents[4] / "docs/reference/bench/hosts.md"


class Rig(OnRig):
    """A port on a rig, by its URL."""

    def later(self, data: bytes) -> None:
        """Let the device send something in 20 ms."""
        self.line.at(self.line.rig.now_us + 20_000, data)

    def second(self, **options: Any) -> Any:
        """Open the port once more."""
        with SERIAL_PORTS.offer("calls", self.line.side):
            return serial.serial_for_url("tickrig://calls", **options)


class Pty(OnPty):
    """A port on a pseudo-terminal."""

    def later(self, data: bytes) -> None:
        """Let the device send something in 20 ms."""
        threading.Timer(0.02, os.write, (self._master, data)).start()

    def second(self, **options: Any) -> Any:
        """Open the port once more."""
        return serial.serial_for_url(self.port.port, **options)


Bench = Any  # a Rig or a Pty: what is called wrongly on purpose has no type
Call = Callable[[Bench], object]


def fed(data: bytes, timeout: float | None = 0.05) -> Callable[[Callable[[Any], object]], Call]:
    """Make a scenario of a call to a port at which bytes wait."""

    def scenario(call: Callable[[Any], object]) -> Call:
        def run(bench: Bench) -> object:
            bench.port.timeout = timeout
            bench.feed(data)
            return call(bench.port)

        return run

    return scenario


def late(data: bytes, timeout: float | None = 2) -> Callable[[Callable[[Any], object]], Call]:
    """Make a scenario of a call to a port whose bytes come while it waits."""

    def scenario(call: Callable[[Any], object]) -> Call:
        def run(bench: Bench) -> object:
            bench.port.timeout = timeout
            bench.later(data)
            return call(bench.port)

        return run

    return scenario


def with_gap(bench: Bench) -> object:
    bench.port.timeout, bench.port.inter_byte_timeout = 2, 0.001
    bench.feed(b"ab")
    bench.later(b"cd")
    return bench.port.read(4)


def buffered(port: Any) -> object:
    return io.BufferedReader(port).readline()


def text(port: Any) -> object:
    both: Any = io.BufferedRWPair(port, port)
    wrapper = io.TextIOWrapper(both, newline="\n")
    line = wrapper.readline()
    wrapper.write("ok\n")
    wrapper.flush()
    wrapper.detach()
    return line


def closed_and_opened(bench: Bench) -> object:
    bench.feed(b"old")
    bench.port.close()
    bench.port.open()
    return bench.port.in_waiting, bench.port.read(3)


def written_and_dropped(bench: Bench) -> object:
    bench.port.write(b"x")
    bench.heard(1)
    bench.port.reset_output_buffer()
    return bench.port.out_waiting, bench.port.flush()


def opened_twice(bench: Bench) -> object:
    bench.port.open()
    return None


def opened_as_context(bench: Bench) -> object:
    bench.port.close()
    bench.port.close()
    with bench.port as port:
        inside = port.is_open
    return inside, bench.port.is_open


def second_exclusive(bench: Bench) -> object:
    bench.port.exclusive = True
    with pytest.raises(serial.SerialException):
        bench.second(exclusive=True)
    return bench.port.is_open


def second_shared(bench: Bench) -> object:
    with bench.second() as port:
        return port.is_open


def changed_while_open(bench: Bench) -> object:
    bench.port.baudrate, bench.port.stopbits = 115_200, 2
    before = bench.port.get_settings()
    bench.port.apply_settings({**before, "timeout": 1})
    return before, bench.port.get_settings()


def full(bench: Bench) -> object:
    bench.port.write_timeout = 0.05
    bench.port.rtscts = False
    return bench.port.write(bytes(100_000))


def lines_set(bench: Bench) -> object:
    bench.port.dtr = bench.port.rts = False
    return bench.port.dtr, bench.port.rts


def break_set(bench: Bench) -> object:
    bench.port.break_condition = True
    bench.port.break_condition = False
    return bench.port.break_condition


def cancelled(bench: Bench) -> object:
    bench.port.timeout = None
    bench.port.cancel_read()
    return bench.port.read(1)


EQUAL: Final[dict[str, Call]] = {
    "read(0)": fed(b"abc")(lambda port: port.read(0)),
    "read(-1)": fed(b"abc")(lambda port: port.read(-1)),
    "read() takes one": fed(b"abc")(lambda port: port.read()),
    "read what is there": fed(b"abc", None)(lambda port: port.read(3)),
    "read more than comes": fed(b"abc")(lambda port: port.read(9)),
    "read nothing": fed(b"")(lambda port: port.read(9)),
    "read at once": fed(b"abc", 0)(lambda port: port.read(9)),
    "read later bytes": late(b"abc")(lambda port: port.read(3)),
    "read without a time-out": late(b"abc", None)(lambda port: port.read(3)),
    "read over a gap": with_gap,
    "read_all": fed(b"abc")(lambda port: port.read_all()),
    "readinto": fed(b"abc")(lambda port: (port.readinto(memoryview(bytearray(2))), port.read(1))),
    "readline": fed(b"a\nb")(lambda port: (port.readline(), port.readline(), port.readline())),
    "readline of a size": fed(b"abc\n")(lambda port: (port.readline(2), port.readline(None))),
    "readline of later bytes": late(b"a\nb")(lambda port: port.readline()),
    "readlines": fed(b"a\nb\nc")(lambda port: (port.readlines(1), port.readlines())),
    "lines": fed(b"a\nb\n")(list),
    "read_until": fed(b"a>b>>c")(lambda port: (port.read_until(b">>"), port.read_until(b">", 1))),
    "read_until of text": fed(b"a\nb")(lambda port: port.read_until("\n")),
    "read_until of nothing": fed(b"ab")(lambda port: port.read_until(b"")),
    "iread_until": fed(b"a>b>c")(lambda port: list(port.iread_until(b">"))),
    "readall": fed(b"abc")(lambda port: port.readall()),
    "BufferedReader": fed(b"a\nb")(buffered),
    "TextIOWrapper": fed(b"a\n")(text),
    "in_waiting": fed(b"abc")(lambda port: (port.in_waiting, port.read(1), port.inWaiting())),
    "reset_input_buffer": fed(b"abc")(lambda port: (port.reset_input_buffer(), port.read(1))),
    "cancel_read": cancelled,
    "closed and opened": closed_and_opened,
    "write and reset_output_buffer": written_and_dropped,
    "write nothing": lambda bench: bench.port.write(b""),
    "write text": lambda bench: bench.port.write("x"),
    "write numbers": lambda bench: (bench.port.write([104, 105]), bench.heard(2)),
    "write a number": lambda bench: bench.port.write(3),
    "write more than there is room for": full,
    "open twice": opened_twice,
    "close twice, and with": opened_as_context,
    "exclusive": second_exclusive,
    "settings": changed_while_open,
    "send_break": lambda bench: bench.port.send_break(0.01),
    "break_condition": break_set,
    "isatty": lambda bench: bench.port.isatty(),
    "files": lambda bench: (bench.port.seekable(), bench.port.readable(), bench.port.writable()),
    "tell": lambda bench: bench.port.tell(),
    "truncate": lambda bench: bench.port.truncate(1),
}
"""What a call does on a pseudo-terminal it does in virtual time."""

DIFFERENT: Final[dict[str, tuple[Call, str]]] = {
    "fileno": (lambda bench: bench.port.fileno() >= 0, "`fileno`"),
    "modem lines": (lambda bench: bench.port.cts, "Modem lines"),
    "dtr and rts": (lines_set, "Modem lines"),
    "a second host": (second_shared, "One line has one host at a time"),
}
"""A call that does something else, and the words of the page that say so."""


def outcome(bench: Bench, call: Call) -> object:
    try:
        return call(bench)
    except Exception as error:
        words = str(error).replace(str(bench.port.port), "PORT")
        return type(error).__mro__[-4:], words.partition(":")[0]


@pytest.fixture
def benches(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Rig, Pty]]:
    real = Pty()
    try:
        yield Rig(), real
    finally:
        real.close()


@pytest.mark.parametrize("name", EQUAL)
def test_a_call_does_the_same_on_a_pty_and_in_virtual_time(
    name: str, benches: tuple[Rig, Pty]
) -> None:
    rig, real = (outcome(bench, EQUAL[name]) for bench in benches)
    assert rig == real


@pytest.mark.parametrize("name", DIFFERENT)
def test_a_call_that_differs_is_on_the_page(name: str, benches: tuple[Rig, Pty]) -> None:
    call, words = DIFFERENT[name]
    rig, real = (outcome(bench, call) for bench in benches)
    assert rig != real
    assert words in PAGE.read_text(encoding="utf-8")
