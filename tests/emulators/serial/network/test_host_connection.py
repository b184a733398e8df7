"""A host on a connection that is half of a pair of sockets: no network, no waiting."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import suppress

import pytest

from tickrig.emulators.serial.network import LAST_WORDS_US, READ_BYTES, STUCK_US, HostConnection

Ends = tuple[HostConnection, socket.socket]


@pytest.fixture
def ends() -> Iterator[Ends]:
    """The connection, and the host's end of it."""
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    connection = HostConnection(ours, buffer_bytes=1_000)
    yield connection, theirs
    theirs.close()
    connection.close()


def read_all(host: socket.socket) -> bytes:
    received = b""
    with suppress(BlockingIOError):
        while data := host.recv(65_536):
            received += data
    return received


def fill(connection: HostConnection, now_us: int = 0) -> None:
    """Send until nothing more is taken."""
    while not connection.lost:
        connection.send(now_us, bytes(500))


def test_bytes_pass_as_they_are_both_ways(ends: Ends) -> None:
    connection, host = ends
    every = bytes(range(256))
    connection.send(0, every)
    assert host.recv(1_000) == every
    host.send(every)
    assert connection.poll(0) == every
    assert connection.poll(0) == b""


def test_a_poll_takes_some_of_much(ends: Ends) -> None:
    connection, host = ends
    host.send(bytes(READ_BYTES + 1))
    assert len(connection.poll(0)) == READ_BYTES
    assert not connection.is_idle
    assert len(connection.poll(0)) == 1
    assert connection.poll(0) == b""
    assert connection.is_idle


def test_what_is_not_read_is_dropped_whole_and_counted(ends: Ends) -> None:
    connection, host = ends
    sent = 0
    while not connection.lost:
        connection.send(0, bytes(500))
        sent += 500
    received = read_all(host)
    while len(received) + connection.lost < sent:
        connection.poll(0)
        received += read_all(host)
    assert connection.lost == 500
    assert len(received) == sent - 500


def test_a_host_that_reads_again_is_not_stuck(ends: Ends) -> None:
    connection, host = ends
    fill(connection)
    assert not connection.has_ended(STUCK_US - 1)
    assert connection.has_ended(STUCK_US)
    read_all(host)
    connection.poll(STUCK_US)
    assert not connection.has_ended(STUCK_US)
    assert not connection.over


def test_a_host_that_sends_no_more_still_hears_the_answer(ends: Ends) -> None:
    connection, host = ends
    host.send(b"device\n")
    host.shutdown(socket.SHUT_WR)
    assert connection.poll(0) == b"device\n"
    assert not connection.has_ended(0)
    assert connection.poll(10) == b""
    assert connection.has_ended(10)
    connection.send(20, b"RRC\n")
    assert host.recv(100) == b"RRC\n"
    connection.poll(10 + LAST_WORDS_US - 1)
    assert not connection.over
    connection.poll(10 + LAST_WORDS_US)
    assert connection.over


def test_a_host_that_is_gone_is_over_and_sending_to_it_is_nothing(ends: Ends) -> None:
    connection, host = ends
    host.close()
    connection.send(0, b"RRC\n")
    assert connection.over
    connection.send(0, b"RRC\n")
    assert connection.poll(0) == b""


def test_what_is_held_comes_first_and_is_little(ends: Ends) -> None:
    connection, host = ends
    host.send(b"a" * 3 * READ_BYTES)
    for _ in range(5):
        connection.hold(0)
    assert connection.poll(0) == b"a" * READ_BYTES
    assert not connection.is_idle
    host.send(b"b")
    rest = b"".join(connection.poll(0) for _ in range(4))
    assert rest == b"a" * 2 * READ_BYTES + b"b"


def test_one_that_ended_while_it_was_held_is_answered_from_its_turn_on(ends: Ends) -> None:
    connection, host = ends
    host.send(b"device\n")
    host.shutdown(socket.SHUT_WR)
    for now_us in (0, 1, 5 * LAST_WORDS_US):
        connection.hold(now_us)
    assert (connection.over, connection.poll(9 * LAST_WORDS_US)) == (False, b"device\n")
    assert connection.poll(10 * LAST_WORDS_US - 1) == b""
    connection.send(10 * LAST_WORDS_US - 1, b"RRC\n")
    assert (connection.over, read_all(host)) == (False, b"RRC\n")


def test_one_that_left_while_it_was_held_is_over(ends: Ends) -> None:
    connection, host = ends
    host.close()
    connection.hold(0)
    assert connection.over
