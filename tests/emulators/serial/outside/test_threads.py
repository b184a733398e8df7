"""Hosts with a thread that reads: told at once, in a line, and never left to wait."""

from __future__ import annotations

import logging
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
import serial
import serial.threaded

from tests.emulators.serial.outside.lines import OpenLine, echo
from tickrig.emulators.serial.outside.sim_serial import SimSerial

TOLD = (
    "rig: a second thread cannot make virtual time pass; read and write in the thread that made"
    " the rig, or run in real time"
)


class Lines(serial.threaded.LineReader):
    """Keeps what came, and why it ended."""

    def __init__(self) -> None:
        super().__init__()
        self.ended = threading.Event()
        self.lost: Any = None

    def connection_lost(self, exc: Any) -> None:
        """Keep the reason."""
        self.lost = exc
        self.ended.set()


def test_a_reader_thread_is_told_and_ends(caplog: pytest.LogCaptureFixture) -> None:
    port = echo(timeout=1)
    reader = serial.threaded.ReaderThread(port, Lines)  # type: ignore[arg-type]
    with caplog.at_level(logging.ERROR):
        reader.start()
        reader.join(10)
    assert not reader.is_alive()
    assert [record.getMessage() for record in caplog.records] == [TOLD]


def test_the_protocol_of_a_reader_thread_hears_why_it_ended() -> None:
    port, protocol = echo(timeout=1), Lines()
    reader = serial.threaded.ReaderThread(port, lambda: protocol)  # type: ignore[arg-type]
    reader.start()
    assert protocol.ended.wait(10)
    reader.join(10)
    assert isinstance(protocol.lost, serial.SerialException)
    assert str(protocol.lost) == TOLD


def test_the_thread_that_may_use_it_is_told_too() -> None:
    port = echo(timeout=1)
    with ThreadPoolExecutor(1) as pool, pytest.raises(serial.SerialException, match=TOLD):
        pool.submit(port.write, b"x").result(10)
    with pytest.raises(serial.SerialException, match=TOLD):
        port.read()
    port.close()


def test_another_thread_may_cancel_and_close() -> None:
    port = echo(timeout=1)
    with ThreadPoolExecutor(1) as pool:
        pool.submit(port.cancel_read).result(10)
        assert (port.read(), port.in_waiting) == (b"", 0)
        pool.submit(port.cancel_write).result(10)
        pool.submit(port.close).result(10)
    assert not port.is_open


def test_a_port_belongs_to_the_thread_that_made_its_rig() -> None:
    bench = OpenLine()
    bench.port.close()
    with ThreadPoolExecutor(1) as pool, pytest.raises(serial.SerialException, match=TOLD):
        pool.submit(SimSerial, bench.side).result(10)
    with ThreadPoolExecutor(1) as pool:

        def work() -> bytes:
            with echo(timeout=0.01) as port:
                port.write(b"x")
                return port.read()

        assert pool.submit(work).result(10) == b"x"
