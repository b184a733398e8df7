from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from tickrig.emulators.serial.network import LEAVING_US, DismissedHost


@pytest.fixture
def ends() -> Iterator[tuple[DismissedHost, socket.socket]]:
    """A host that has sent something and is told to leave, and its end of the connection."""
    ours, theirs = socket.socketpair()
    theirs.send(b"device\n")
    dismissed = DismissedHost(ours, 5, "the line is busy")
    yield dismissed, theirs
    theirs.close()
    dismissed.close()


def test_it_reads_why_whatever_it_sends(ends: tuple[DismissedHost, socket.socket]) -> None:
    dismissed, host = ends
    for now_us in range(10):
        host.send(b"more\n")
        assert not dismissed.is_gone(now_us)
    assert host.recv(100) == b"the line is busy\r\n"
    assert host.recv(100) == b""
    host.close()
    assert dismissed.is_gone(10) or dismissed.is_gone(11)


def test_it_is_hung_up_on_when_its_time_is_over(ends: tuple[DismissedHost, socket.socket]) -> None:
    dismissed, host = ends
    assert not dismissed.is_gone(5 + LEAVING_US - 1)
    assert dismissed.is_gone(5 + LEAVING_US)
    with pytest.raises(BrokenPipeError):
        host.send(b"too late\n")


def test_one_that_is_gone_already_is_no_trouble() -> None:
    ours, theirs = socket.socketpair()
    theirs.close()
    assert DismissedHost(ours, 0, "the line is busy").is_gone(0)
