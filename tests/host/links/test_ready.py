"""Waiting for descriptors of which more are open than `select` takes."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.interop.buses import GROUP
from tickrig.host.links import ready as module
from tickrig.host.links.ready import ready

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX")

MANY = """
import os, resource, sys
_, most = resource.getrlimit(resource.RLIMIT_NOFILE)
resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, 4_096) if most > 0 else 4_096, most))
kept = [os.open(os.devnull, os.O_RDONLY) for _ in range(1_100)]
"""
"""Opens so many that all further ones have high numbers."""


def run(program: str, *words: str, typed: bytes = b"") -> str:
    """Run a program with more than 1100 descriptors open, and return what it says."""
    done = subprocess.run(
        [sys.executable, "-c", MANY + program, *words],
        input=typed,
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout.decode()


@pytest.mark.realtime
def test_a_bench_and_its_ports_work() -> None:
    program = """
import serial
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.host.links.serial_link import SerialLink
with Bench("rrc", mode="real") as bench:
    port = bench.serial(timeout=5)
    bench.press("power_button")
    print(port.fileno() >= 1_024, port.read(1), port.write(b"beep\\n"))
ours, theirs = os.openpty()
link = SerialLink(os.ttyname(theirs))
os.write(ours, b"hello")
print(link.receive(5_000_000))
link.send(b"back")
print(os.read(ours, 4))
"""
    assert run(program).split("\n")[:3] == ["True b'E' 5", "b'hello'", "b'back'"]


def test_a_control_socket_works(tmp_path: Path) -> None:
    program = """
import threading
from tests.emulators.lamp import Lamp
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.client import ControlClient
from tickrig.host.control.server import ControlServer
from pathlib import Path
server = ControlServer(Path(sys.argv[1]), EmulatorControl(Emulator("lamp", Lamp())))
def serve():
    while not answered:
        server.serve(10_000)
answered = []
thread = threading.Thread(target=serve)
thread.start()
with ControlClient(sys.argv[1]) as client:
    print(client.request("status")["ok"])
answered.append(True)
thread.join()
"""
    assert run(program, str(tmp_path / "socket")) == "True\n"


@pytest.mark.realtime
def test_canmon_hears_a_bus_and_standard_input() -> None:
    dump = """
from tickrig.host.canmon.cli import main
main(sys.argv[1:], standalone_mode=False)
"""
    log = b"(1.000000) can0 123#0102\n"
    assert "123   [2]  01 02" in run(dump, "dump", "-", typed=log)
    heard = """
import can
from tickrig.host.links.can_link import CanLink
from tickrig.wire.can import CanFrame
link = CanLink.open(sys.argv[1], "udp_multicast")
other = can.Bus(interface="udp_multicast", channel=sys.argv[1], hop_limit=0)
other.send(can.Message(arbitration_id=0x123, data=[1], is_extended_id=False))
print(*link.receive(5_000_000))
link.send((CanFrame(0x124),))
print([hex(other.recv(5).arbitration_id) for _ in range(2)])
"""
    assert run(heard, GROUP) == "123#01\n['0x123', '0x124']\n"


@pytest.fixture
def polled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all descriptors count as high ones."""
    monkeypatch.setattr(module, "SELECTABLE", 0)


@pytest.mark.usefixtures("polled")
def test_what_can_be_read_and_written_is_told() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        assert ready([ours], [ours], 0) == ([], [ours])
        theirs.send(b"a")
        assert ready([ours, theirs], [], None) == ([ours], [])
        theirs.close()
        assert ready([ours], [ours], 1.5) == ([ours], [ours])


@pytest.mark.usefixtures("polled")
def test_a_wait_ends_when_its_time_is_over() -> None:
    reader, writer = os.pipe()
    assert ready([reader], wait_s=0.0015) == ([], [])
    os.close(writer)
    assert ready([reader], wait_s=0.0015) == ([reader], [])
    os.close(reader)
    with pytest.raises(OSError, match="Bad file descriptor"):
        ready([reader], wait_s=0)


def test_nothing_else_waits_with_select() -> None:
    """But what stands in for it where hosts wait in virtual time."""
    root = Path(__file__).parents[3]
    waiting = {
        str(path.relative_to(root))
        for floor in ("wire", "device", "host", "emulators")
        for path in (root / floor).rglob("*.py")
        if re.search(r"(?m)^(import select$|from select import)", path.read_text("utf-8"))
    }
    assert waiting - {"host/links/ready.py"} == {
        "emulators/serial/pty_port.py",  # epoll
        "host/cli/start.py",  # poll
        "host/links/terminal.py",  # poll
        "emulators/testing/host_clock/patched_time.py",
        "emulators/testing/host_clock/host_code.py",
    }
