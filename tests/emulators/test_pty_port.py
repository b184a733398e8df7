from __future__ import annotations

import os
import select
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tickrig.device.core import NEVER
from tickrig.emulators.bridge import Bridge
from tickrig.emulators.pty_port import PtyPort
from tickrig.emulators.serial_line import SerialLine
from tickrig.emulators.tap import Tap
from tickrig.emulators.trace import Mark

pytestmark = pytest.mark.realtime


@contextmanager
def opened(link: Path | None = None, buffer_bytes: int = 4_096) -> Iterator[tuple[PtyPort, int]]:
    """Open a pty port, and its other side as a host would."""
    port = PtyPort(link, buffer_bytes)
    host = os.open(link or port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        yield port, host
    finally:
        os.close(host)
        port.close()


def arrived(port: PtyPort, size: int) -> bytes:
    """Poll until `size` bytes came: the kernel passes them on when it gets to it."""
    received, deadline = b"", time.monotonic() + 5.0
    while len(received) < size and time.monotonic() < deadline:
        received += port.poll(0)
    return received


def at_host(host: int, size: int) -> bytes:
    """Read `size` bytes on the host's side."""
    received = b""
    while len(received) < size and select.select([host], [], [], 5.0)[0]:
        received += os.read(host, size - len(received))
    return received


def test_bytes_pass_as_they_are_both_ways() -> None:
    every = bytes(range(256))
    with opened() as (port, host):
        port.send(0, every)
        assert at_host(host, 256) == every
        os.write(host, every)
        assert arrived(port, 256) == every
        assert port.poll(0) == b""
        assert port.due_us == NEVER


def test_what_nobody_reads_is_dropped_and_counted() -> None:
    with opened(buffer_bytes=1_000) as (port, host):
        for _ in range(100):
            port.send(0, bytes(1_000))
        received = b""
        while True:
            port.poll(0)
            try:
                received += os.read(host, 100_000)
            except BlockingIOError:
                break
        assert port.lost > 0
        assert len(received) + port.lost == 100_000


def test_a_host_may_go_and_another_come() -> None:
    with opened() as (port, host):
        again = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
        os.write(host, b"a")
        os.write(again, b"b")
        os.close(again)
        assert arrived(port, 2) == b"ab"


def test_the_link_is_there_while_the_port_is(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with opened(link) as (port, _):
        assert os.readlink(link) == port.path
    assert not link.is_symlink()


@pytest.mark.parametrize("target", ["/dev/pts/99999", "own"])
def test_a_dead_link_is_replaced(target: str, tmp_path: Path) -> None:
    link = tmp_path / "tty"
    if target == "own":  # the kernel gives the lowest free number: the next port's
        probe = PtyPort()
        target = probe.path
        probe.close()
    link.symlink_to(target)
    with opened(link) as (port, _):
        assert os.readlink(link) == port.path


@pytest.mark.parametrize("make", [Path.mkdir, Path.touch, lambda path: path.symlink_to("/")])
def test_what_is_no_dead_link_stays(make: object, tmp_path: Path) -> None:
    link = tmp_path / "tty"
    make(link)  # type: ignore[operator]
    with pytest.raises(FileExistsError):
        PtyPort(link)
    assert link.exists()


def test_a_link_that_somebody_else_took_over_stays(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    port = PtyPort(link)
    link.unlink()
    link.symlink_to("/")
    port.close()
    assert link.is_symlink()


def test_a_bridge_hands_on_what_its_tap_hears() -> None:
    heard, line = list[tuple[int, Mark, bytes]](), SerialLine()
    with opened() as (port, host):
        bridge = Bridge(line.b, Tap(port, lambda *traffic: heard.append(traffic)))
        os.write(host, b"in")
        bridge.take_in(1_000)
        assert line.a.poll(2_000) == b"in"
        line.a.send(2_000, b"out")
        assert bridge.due_us == 2_261
        bridge.give_out(3_000)
        assert os.read(host, 10) == b"out"
    assert heard == [(1_000, Mark.TO_DEVICE, b"in"), (3_000, Mark.FROM_DEVICE, b"out")]
