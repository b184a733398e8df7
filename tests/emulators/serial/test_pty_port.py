from __future__ import annotations

import os
import select
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
import serial

from tickrig.emulators.serial.bridge import Bridge, Tap
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.text.trace import Mark
from tickrig.wire.instant import NEVER

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


@contextmanager
def terminal_of_somebody() -> Iterator[str]:
    ends = os.openpty()
    try:
        yield os.ttyname(ends[1])
    finally:
        for end in ends:
            os.close(end)


def test_a_link_of_a_killed_emulator_is_replaced_though_its_terminal_is_anothers(
    tmp_path: Path,
) -> None:
    link = tmp_path / "tty"
    with terminal_of_somebody() as taken:
        link.symlink_to(taken)
        (tmp_path / ".tty.emulator").write_text(f"123 {taken}\n")
        with opened(link) as (port, _):
            assert os.readlink(link) == port.path
    assert list(tmp_path.iterdir()) == []


def test_a_link_to_another_terminal_than_the_noted_one_stays(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with terminal_of_somebody() as taken:
        link.symlink_to(taken)
        (tmp_path / ".tty.emulator").write_text("123 /dev/pts/99999\n")
        with pytest.raises(FileExistsError, match="exists; remove it if no emulator uses it"):
            PtyPort(link)
        assert os.readlink(link) == taken


def test_a_link_in_use_is_refused_with_the_process_that_uses_it(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with opened(link) as (port, _):
        used = rf"another emulator uses it \(process {os.getpid()}\): '{link}'"
        with pytest.raises(FileExistsError, match=used):
            PtyPort(link)
        assert os.readlink(link) == port.path


def test_a_folder_without_room_for_a_link_is_named(tmp_path: Path) -> None:
    link = tmp_path / "missing" / "tty"
    with pytest.raises(FileNotFoundError, match=str(link)):
        PtyPort(link)


def settings_told(
    baud: int, host_baud: int, bits: int = 8, parity: str = "N", stops: int = 1
) -> list[str]:
    """Return what a port of this rate tells of a host with this setting."""
    told: list[str] = []
    with closing(PtyPort()) as port:
        port.watch_setting(baud, told.append)
        port.poll(0)
        with serial.Serial(port.path, host_baud, bits, parity, stops):
            for now_us in range(1_000_000, 3_000_000, 10_000):
                port.poll(now_us)
            told.append(port.host_setting)
    return told


def test_a_host_that_is_set_as_the_device_is_fine() -> None:
    assert settings_told(115_200, 115_200) == [""]


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ((9_600,), "9600 8N1"),
        ((115_200, 8, "N", 2), "115200 8N2"),
        ((115_200, 8, "O"), "115200 8O1"),
        ((12_345,), "another rate, 8N1"),
        # The kernel's pseudo-terminals drop the size and even parity.
        ((9_600, 7, "E"), "9600 8N1"),
    ],
)
def test_another_setting_is_told_once(setting: tuple[Any, ...], told: str) -> None:
    assert settings_told(115_200, *setting) == [told, told]


def test_a_rate_without_a_name_is_not_judged() -> None:
    assert settings_told(12_000_000, 9_600) == [""]


def test_each_setting_is_told_once_and_the_present_one_is_known() -> None:
    told: list[str] = []
    with closing(PtyPort()) as port:
        port.watch_setting(57_600, told.append)
        for number, baud in enumerate((9_600, 57_600, 9_600, 19_200), 1):
            with serial.Serial(port.path, baud):
                port.poll(number * 1_000_000)
            assert port.host_setting == ("" if baud == 57_600 else f"{baud} 8N1")
    assert told == ["9600 8N1", "19200 8N1"]


EVEN: dict[str, Any] = {"bytesize": 7, "parity": "E"}


def test_hosts_of_even_parity_come_one_after_another() -> None:
    with closing(PtyPort()) as port:
        port.watch_setting(115_200, pytest.fail)
        for number in range(3):
            with serial.Serial(port.path, 115_200, **EVEN):
                pass
            assert select.select([port], [], [], 0)[0]  # the close wakes the emulator
            port.attend(number)


def test_a_host_of_even_parity_changes_its_settings_after_a_request() -> None:
    with closing(PtyPort()) as port, serial.Serial(port.path, 9_600, **EVEN) as host:
        host.write(b"?")
        assert arrived(port, 1) == b"?"
        host.timeout = 1


def test_what_wakes_the_emulator_is_taken() -> None:
    with closing(PtyPort()) as port:
        with serial.Serial(port.path, 115_200) as host:
            host.write(b"x")
        assert select.select([port], [], [], 0)[0]
        assert arrived(port, 1) == b"x"
        assert not select.select([port], [], [], 0)[0]


def test_a_host_that_has_left_before_the_next_look_is_told() -> None:
    told: list[str] = []
    with closing(PtyPort()) as port:
        port.watch_setting(115_200, told.append)
        port.attend(0)
        with serial.Serial(port.path, 19_200):
            pass
        port.attend(1)
        assert (told, port.host_setting) == (["19200 8N1"], "19200 8N1")


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


def test_hosts_that_lock_refuse_each_other_and_others_take_each_others_bytes() -> None:
    port = PtyPort()
    with closing(port), serial.Serial(port.path, timeout=5, exclusive=True) as host:
        with pytest.raises(serial.SerialException, match="exclusively lock"):
            serial.Serial(port.path, exclusive=True)
        with serial.Serial(port.path, timeout=5) as second:
            port.send(0, b"once")
            assert second.read(4) == b"once"
            assert host.in_waiting == 0
