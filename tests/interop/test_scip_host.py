"""A foreign SCIP host at the emulated sensor: hokuyolx, which speaks TCP."""

from __future__ import annotations

import os
import selectors
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from math import hypot
from pathlib import Path

import pytest
from hokuyolx import HokuyoLX

from tickrig.emulators.bench.child import running
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.urg import UrgClient, UrgScan

pytestmark = pytest.mark.realtime

ROOM = ("--room", "4,3", "--post", "1,0,0.25")


@contextmanager
def relayed(tty: Path) -> Iterator[tuple[str, int]]:
    """Give a terminal a TCP port on the loopback, for one connection."""
    listener = socket.create_server(("127.0.0.1", 0))
    fd = os.open(tty, os.O_RDWR | os.O_NOCTTY)
    thread = threading.Thread(target=relay, args=(listener, fd), daemon=True)
    thread.start()
    yield listener.getsockname()
    thread.join(5.0)
    os.close(fd)
    listener.close()


def relay(listener: socket.socket, fd: int) -> None:
    host, _ = listener.accept()
    with host, selectors.DefaultSelector() as selector:
        selector.register(host, selectors.EVENT_READ)
        selector.register(fd, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                if key.fileobj is not host:
                    host.sendall(os.read(fd, 4_096))
                elif data := host.recv(4_096):
                    os.write(fd, data)
                else:
                    return


@pytest.fixture
def laser() -> Iterator[HokuyoLX]:
    words = (*ROOM, "--scip", "2.0")  # it does not switch
    with running("tickrig.emulators.urg.cli", *words) as child, relayed(child.link) as address:
        found = HokuyoLX(activate=False, tsync=False, addr=address, convert_time=False)
        yield found
        found.close()


def test_a_foreign_host_measures(laser: HokuyoLX) -> None:
    assert (laser.dmin, laser.dmax, laser.amin, laser.amax) == (20, 5_600, 44, 725)
    assert (laser.aforw, laser.scan_freq) == (384, 10)
    assert laser.version()["SERI"] == "H0614967"
    assert laser.activate()[0] == 0
    assert laser.sensor_state()["LASR"] == "ON"
    _, distances = laser.get_dist()
    assert len(distances) == 682
    assert distances[384 - 44] == 750
    assert distances[44 - 44 + 596] == pytest.approx(1_500, abs=1)  # to the left
    assert max(distances) < 1_000 * hypot(2, 1.5) + 1


def test_a_foreign_host_measures_one_scan_after_the_other(laser: HokuyoLX) -> None:
    scans = list(laser.iter_dist(3, 384, 384))
    assert [(list(scan), pending) for scan, _, pending in scans] == [
        ([750], 2),
        ([750], 1),
        ([750], 0),
    ]
    stamps = [stamp for _, stamp, _ in scans]
    assert [b - a for a, b in pairwise(stamps)] == [100, 100]


def test_a_foreign_host_reads_the_timer(laser: HokuyoLX) -> None:
    assert laser.tsync_enter()[0] == "00"
    first, second = laser.tsync_get(), laser.tsync_get()
    assert 0 <= second - first < 5_000
    assert laser.tsync_exit()[0] == "00"
    laser.reset()
    laser.standby()


def test_our_host_measures_on_a_pty() -> None:
    with running("tickrig.emulators.urg.cli", *ROOM) as child:
        client, deadline_s = UrgClient(SerialLink(str(child.link))), time.monotonic() + 10.0
        scans: list[UrgScan] = []
        while len(scans) < 3:
            assert time.monotonic() < deadline_s
            scans += client.poll()
        client.close()
    assert {dict(scan.points())[0.0] for scan in scans} == {0.75}
