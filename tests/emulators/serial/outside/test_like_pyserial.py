"""The same calls to ports of pyserial, `loop://` and a pseudo-terminal, and to one on a rig."""

from __future__ import annotations

import contextlib
import inspect
import os
import tty
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import serial
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.serial.outside.lines import OpenLine
from tickrig.emulators.serial.outside import protocol_tickrig
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.emulators.testing.bench.modes.door_watch import WatchedPort

OPTIONS: dict[str, Any] = {"timeout": 0, "write_timeout": 1}


class OnRig:
    """A port on a rig."""

    def __init__(self) -> None:
        self.line = OpenLine(**OPTIONS)
        self.port: Any = self.line.port

    def feed(self, data: bytes) -> None:
        """Let the device send, and wait until all is there."""
        self.line.far.send(self.line.rig.now_us, data)
        self.line.rig.run_for(100 * len(data))

    def heard(self, count: int) -> bytes:
        """Let all arrive that the host wrote."""
        self.port.flush()
        return self.line.heard()


class OnPty:
    """A port on a pseudo-terminal, whose master side is the device."""

    def __init__(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        self.port = serial.Serial(os.ttyname(slave), **OPTIONS)
        os.close(slave)

    def feed(self, data: bytes) -> None:
        """Let the device send, and wait until the kernel has handed on all of it."""
        wanted = self.port.in_waiting + os.write(self._master, data)
        while self.port.in_waiting < wanted:
            os.sched_yield()

    def heard(self, count: int) -> bytes:
        """Take what the host wrote, once the kernel has handed on so many bytes."""
        data = b""
        while len(data) < count:
            with contextlib.suppress(BlockingIOError):
                data += os.read(self._master, 65_536)
        return data

    def close(self) -> None:
        """Give the pseudo-terminal back."""
        self.port.close()
        os.close(self._master)


class OnLoop:
    """A port of `loop://`: it hears itself."""

    def __init__(self) -> None:
        self.port = serial.serial_for_url("loop://", baudrate=115_200, **OPTIONS)

    def feed(self, data: bytes) -> None:
        """Write, to have something to read."""
        self.port.write(data)


@contextlib.contextmanager
def pty() -> Iterator[OnPty]:
    bench = OnPty()
    try:
        yield bench
    finally:
        bench.close()


def reads() -> st.SearchStrategy[tuple[str, Any]]:
    """Return what a host may do that reads: what it sees depends on no clock."""
    return st.one_of(
        st.tuples(st.just("feed"), st.text("ab\n>", max_size=40).map(str.encode)),
        st.tuples(st.just("read"), st.integers(0, 50)),
        st.sampled_from([("readline", None), ("read_all", None), ("cancel", None), ("in", None)]),
        st.tuples(st.just("into"), st.integers(0, 20)),
        st.tuples(st.just("until"), st.sampled_from([(b">", None), (b"\n>", 7), (b"\n", 1)])),
        st.sampled_from([("reset", None), ("lines", None), ("reopen", None)]),
    )


def do(bench: OnRig | OnPty | OnLoop, verb: str, what: Any) -> object:  # noqa: PLR0911 - a table
    """Do one thing, and return what the host sees of it."""
    port: Any = bench.port
    match verb:
        case "feed":
            return bench.feed(what)
        case "in":
            return port.in_waiting
        case "cancel":
            return port.cancel_read()
        case "reset":
            return port.reset_input_buffer()
        case "into":
            data = bytearray(what)
            return port.readinto(data), bytes(data)
        case "until":
            return port.read_until(*what)
        case "lines":
            return list(port)
        case "reopen":
            port.close()
            return port.open()
        case _:
            return getattr(port, verb)(*([] if what is None else [what]))


@settings(deadline=None, max_examples=60)
@given(st.lists(reads(), max_size=25))
def test_reading_is_as_on_a_pseudo_terminal(steps: list[tuple[str, Any]]) -> None:
    rig = OnRig()
    with pty() as real:
        for step in steps:
            assert do(rig, *step) == do(real, *step), step


def test_what_was_cancelled_before_a_port_is_opened_again_is_over() -> None:
    rig = OnRig()
    with pty() as real:
        for bench in (rig, real):
            bench.port.cancel_read()
            do(bench, "reopen", None)
            bench.feed(b">")
            assert bench.port.read(1) == b">"


@given(st.lists(reads().filter(lambda step: step[0] not in {"cancel", "reopen"}), max_size=25))
def test_reading_is_as_on_a_loop(steps: list[tuple[str, Any]]) -> None:
    rig, loop = OnRig(), OnLoop()
    for step in steps:
        assert do(rig, *step) == do(loop, *step), step


@settings(deadline=None, max_examples=40)
@given(st.lists(st.binary(max_size=300), max_size=8))
def test_writing_is_as_on_a_pseudo_terminal(chunks: list[bytes]) -> None:
    rig = OnRig()
    with pty() as real:
        for chunk in chunks:
            assert rig.port.write(chunk) == real.port.write(chunk)
            assert rig.heard(len(chunk)) == real.heard(len(chunk)) == chunk


SETTINGS = [
    {"baudrate": 9_600},
    {"baudrate": "9600"},
    {"stopbits": 2},
    {"bytesize": 9},
    {"parity": "Q"},
    {"stopbits": 3},
    {"baudrate": -5},
    {"timeout": -1},
    {"timeout": "soon"},
    {"write_timeout": -1},
    {"inter_byte_timeout": 0.1},
    {"xonxoff": True, "rtscts": True, "dsrdtr": True},
    {"exclusive": True},
    {"writeTimeout": 3},
    {"port": 5},
    {"colour": "red"},
]


@pytest.mark.parametrize("options", SETTINGS, ids=str)
def test_settings_are_taken_and_refused_as_on_a_pseudo_terminal(options: dict[str, Any]) -> None:
    def outcome(port: Any) -> object:
        try:
            for name, value in options.items():
                setattr(port, name, value)
        except ValueError as error:
            return type(error), str(error)
        return port.get_settings(), port.is_open

    wanted = {"baudrate": 115_200, "write_timeout": None}
    rig = OnRig()
    with pty() as real:
        for port in (rig.port, real.port):
            port.apply_settings(wanted)
        assert outcome(rig.port) == outcome(real.port)


def attempts(port: Any) -> Iterator[object]:
    for name in ("read", "readline", "flush", "reset_input_buffer", "reset_output_buffer"):
        try:
            yield getattr(port, name)()
        except serial.SerialException as error:
            yield type(error), str(error)
    for data in ("text", b"bytes", [1, 2], bytearray(b"x"), memoryview(b"y")):
        try:
            yield port.write(data)
        except (TypeError, serial.SerialException) as error:
            yield type(error), str(error)
    yield port.is_open, port.closed, port.readable(), port.writable(), port.seekable()


def test_an_open_and_a_closed_port_answer_as_a_pseudo_terminal() -> None:
    rig = OnRig()
    with pty() as real:
        assert list(attempts(rig.port)) == list(attempts(real.port))
        rig.port.close()
        real.port.close()
        assert list(attempts(rig.port)) == list(attempts(real.port))


INSIDE = {
    *("fd", "pipe_abort_read_r", "pipe_abort_read_w", "pipe_abort_write_r", "pipe_abort_write_w"),
    *("BAUDRATE_CONSTANTS", "TIOCSBRK", "TIOCCBRK", "osx_version"),
}
"""Attributes of pyserial's port of this system that it does not document."""


def test_it_has_what_a_port_of_this_system_has() -> None:
    with pty() as real:
        names = {name for name in dir(real.port) if not name.startswith("_")}
    assert names - INSIDE <= set(dir(OnRig().port))


def parameters(function: Callable[..., object]) -> list[tuple[str, object, object]]:
    """Return name, kind and default of each parameter."""
    signature = inspect.signature(function)
    return [(each.name, each.kind, each.default) for each in signature.parameters.values()]


METHODS = [
    name
    for name, member in inspect.getmembers_static(serial.Serial, inspect.isfunction)
    if not name.startswith("_")
]


class InRealTime(WatchedPort, serial.Serial):
    """What `bench.serial()` returns in real time and on hardware."""


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("kind", [SimSerial, protocol_tickrig.Serial, InRealTime])
def test_a_call_takes_the_arguments_that_pyserial_takes(kind: type, name: str) -> None:
    assert parameters(getattr(kind, name)) == parameters(getattr(serial.Serial, name))


def keyword_calls(bench: OnRig | OnPty) -> Iterator[object]:
    port: Any = bench.port
    yield port.write(data=b"ab")
    yield bench.heard(2)
    bench.feed(b"one>two")
    yield port.read(size=2)
    yield port.read_until(expected=b">", size=9)
    yield port.read_until("\n")
    yield port.set_input_flow_control(enable=False), bench.heard(1)
    yield port.set_input_flow_control(), bench.heard(1)
    with pytest.warns(DeprecationWarning, match="no effect"):
        yield port.nonblocking()
    yield port.set_output_flow_control(enable=False), port.set_output_flow_control(enable=True)
    yield port.write(b"on"), bench.heard(2)
    yield isinstance(port, serial.SerialBase)
    port.close()
    for name in ("set_input_flow_control", "set_output_flow_control"):
        with pytest.raises(serial.PortNotOpenError):
            getattr(port, name)()


def test_calls_by_keyword_and_seldom_ones_do_as_on_a_pseudo_terminal() -> None:
    with pty() as real:
        assert list(keyword_calls(OnRig())) == list(keyword_calls(real))


def test_what_is_written_to_a_suspended_output_waits_as_at_a_uart() -> None:
    rig = OnRig()
    rig.port.set_output_flow_control(False)
    rig.port.write(b"held")
    rig.line.rig.run_for(1_000_000)
    assert (rig.line.heard(), rig.port.out_waiting) == (b"", 4)
    rig.port.set_output_flow_control()
    assert rig.heard(4) == b"held"


def test_a_port_that_is_renamed_is_opened_by_its_new_name() -> None:
    rig, other = OnRig(), OpenLine(**OPTIONS)
    other.port.close()
    with SERIAL_PORTS.offer("other", other.side):
        rig.port.port = "tickrig://other"
        rig.port.write(b"x")
        rig.port.flush()
        assert (other.heard(), rig.line.heard()) == (b"x", b"")
        rig.port.port = "rig"  # the name that it was made with
        rig.port.write(b"y")
        assert (other.heard(), rig.heard(1)) == (b"", b"y")
        with pytest.raises(serial.SerialException, match="not open port /dev/ttyUSB0"):
            rig.port.port = "/dev/ttyUSB0"
    assert not rig.port.is_open
