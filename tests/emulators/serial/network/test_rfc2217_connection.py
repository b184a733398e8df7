"""RFC 2217 byte for byte, on a pair of sockets, and what is thrown at it."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.emulators.serial.network import (
    MAX_SUBOPTION_BYTES,
    MAX_UNSENT_BYTES,
    READ_BYTES,
    Rfc2217Connection,
)
from tickrig.wire.uart import UartSetting

IAC, SE, SB, WILL, WONT, DO, DONT = b"\xff", b"\xf0", b"\xfa", b"\xfb", b"\xfc", b"\xfd", b"\xfe"
COM_PORT = b"\x2c"
BUFFER_BYTES = 1_000


def command(code: int, value: bytes = b"") -> bytes:
    """Return a command as a host sends it, and as the server answers with code + 100."""
    return IAC + SB + COM_PORT + bytes([code]) + value.replace(IAC, IAC * 2) + IAC + SE


class Bench:
    """A connection, and the host's end of it."""

    def __init__(self, ours: socket.socket, theirs: socket.socket) -> None:
        self.connection = Rfc2217Connection(ours, BUFFER_BYTES, UartSetting())
        self.host = theirs

    def exchange(self, sent: bytes) -> tuple[bytes, bytes]:
        """Send; return what the device gets and what is answered."""
        got = b""
        for start in range(0, len(sent), READ_BYTES):
            self.host.send(sent[start : start + READ_BYTES])
            got += self.connection.poll(0)
        return got, self.answered()

    def answered(self) -> bytes:
        self.connection.poll(0)
        received = b""
        with suppress(BlockingIOError):
            while data := self.host.recv(65_536):
                received += data
        return received


@contextmanager
def opened() -> Iterator[Bench]:
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    bench = Bench(ours, theirs)
    try:
        yield bench
    finally:
        theirs.close()
        bench.connection.close()


@pytest.fixture
def bench() -> Iterator[Bench]:
    """A connection that has said what it wants."""
    with opened() as bench:
        bench.answered()
        yield bench


def test_it_offers_the_serial_options_at_once() -> None:
    with opened() as bench:
        assert IAC + WILL + COM_PORT in bench.answered()


def test_a_host_that_agrees_is_told_the_modem_lines_of_a_quiet_adapter(bench: Bench) -> None:
    assert bench.exchange(IAC + DO + COM_PORT) == (b"", command(107, b"\0"))
    assert bench.exchange(command(7, b"\0")) == (b"", command(107, b"\0"))


@pytest.mark.parametrize(
    ("sent", "answer", "setting"),
    [
        (command(1, (9_600).to_bytes(4, "big")), command(101, b"\0\0\x25\x80"), "9600 8N1"),
        (command(1, (250_000).to_bytes(4, "big")), command(101, b"\0\x03\xd0\x90"), "250000 8N1"),
        (command(1, bytes(4)), command(101, b"\0\x01\xc2\0"), "115200 8N1"),
        (command(1, b"\xff" * 4), command(101, b"\xff" * 4), "4294967295 8N1"),
        (command(2, b"\x07"), command(102, b"\x07"), "115200 7N1"),
        (command(2, b"\x09"), command(102, b"\x08"), "115200 8N1"),
        (command(3, b"\x03"), command(103, b"\x03"), "115200 8E1"),
        (command(3, b"\x06"), command(103, b"\x01"), "115200 8N1"),
        (command(4, b"\x02"), command(104, b"\x02"), "115200 8N2"),
        (command(4, b"\x03"), command(104, b"\x03"), "115200 8N1.5"),
        (command(4, b"\x63"), command(104, b"\x01"), "115200 8N1"),
    ],
)
def test_what_a_host_sets_is_answered_with_what_is_set(
    bench: Bench, sent: bytes, answer: bytes, setting: str
) -> None:
    assert bench.exchange(sent) == (b"", answer)
    assert str(bench.connection.setting) == setting


@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        *((command(5, bytes([n])), command(105, bytes([n]))) for n in (1, 2, 3)),
        *((command(5, bytes([n])), command(105, bytes([n]))) for n in (5, 6, 8, 9, 11, 12)),
        (command(5, b"\0"), command(105, b"\x01")),
        (command(5, b"\x04"), command(105, b"\x06")),
        (command(5, b"\x07"), command(105, b"\x08")),
        (command(5, b"\x0a"), command(105, b"\x0b")),
        (command(5, b"\x09") + command(5, b"\x07"), command(105, b"\x09") * 2),
        (command(5, b"\x0d"), command(105, b"\x0e")),
        (command(5, b"\x10"), command(105, b"\x0e")),
        (command(5, b"\x13"), command(105, b"\x01")),
        (command(0), command(100, b"tickrig")),
        (command(6, b"\0"), command(106, b"\0")),
        (command(10, b"\x55"), command(110, b"\x55")),
        (command(11, b"\xff"), command(111, b"\xff")),
        *((command(12, bytes([n])), command(112, bytes([n]))) for n in (1, 2, 3)),
    ],
)
def test_every_command_is_answered(bench: Bench, sent: bytes, answer: bytes) -> None:
    assert bench.exchange(b"a" + sent + b"b") == (b"ab", answer)


@pytest.mark.parametrize(
    "sent",
    [
        *(command(n) for n in (1, 2, 3, 4, 5, 10, 11, 12)),
        command(1, b"\0\0\0"),
        command(99, b"x"),
        IAC + SB + b"\x18\x01" + IAC + SE,
        IAC + SB + IAC + SE,
    ],
)
def test_a_command_that_is_none_is_passed_over(bench: Bench, sent: bytes) -> None:
    assert bench.exchange(sent) == (b"", b"")
    assert not bench.connection.mistake
    assert bench.connection.setting == UartSetting()


def test_options_of_others_are_refused_and_telnet_commands_passed_over(bench: Bench) -> None:
    sent = IAC + WILL + b"\x18" + IAC + DO + b"\x27" + IAC + b"\xf6" + b"x" + IAC + WONT + b"\x63"
    assert bench.exchange(sent) == (b"x", IAC + DONT + b"\x18" + IAC + WONT + b"\x27")


@pytest.mark.parametrize(
    ("sent", "mistake"),
    [
        (b"abc" + IAC + SE, "IAC SE without IAC SB"),
        (IAC + SB + COM_PORT + bytes(300), f"IAC SB without IAC SE in {MAX_SUBOPTION_BYTES} bytes"),
    ],
)
def test_what_is_no_telnet_is_a_mistake(bench: Bench, sent: bytes, mistake: str) -> None:
    bench.exchange(sent)
    assert bench.connection.mistake == mistake


@given(st.binary(max_size=300), st.lists(st.integers(1, 40)))
def test_data_arrives_as_it_was_sent_in_whatever_pieces(data: bytes, cuts: list[int]) -> None:
    escaped, got = data.replace(IAC, IAC * 2), b""
    with opened() as bench:
        for size in [*cuts, len(escaped) or 1]:
            got += bench.exchange(escaped[:size])[0]
            escaped = escaped[size:]
    assert got == data


@given(st.lists(st.binary(max_size=100), max_size=8))
def test_what_the_device_sends_is_escaped(sent: list[bytes]) -> None:
    with opened() as bench:
        bench.answered()
        for data in sent:
            bench.connection.send(0, data)
        assert bench.answered() == b"".join(sent).replace(IAC, IAC * 2)


TOKENS = st.one_of(
    st.binary(max_size=40),
    st.sampled_from(
        [IAC, IAC + SB, IAC + SE, IAC + SB + COM_PORT, IAC + DO, IAC + WILL + COM_PORT]
    ),
    st.builds(command, st.integers(0, 255), st.binary(max_size=6)),
)


@settings(max_examples=300)
@given(st.lists(TOKENS, max_size=60))
def test_whatever_comes_the_lines_of_the_device_stay_whole(tokens: list[bytes]) -> None:
    line = b"EV:Alarm\n"
    with opened() as bench:
        answered, sent = b"", 0
        for token in tokens:
            if bench.connection.mistake:
                break
            answered += bench.exchange(token)[1]
            bench.connection.send(0, line)
            sent += 1
        answered += bench.answered()
    assert answered.count(line) == sent
    assert not bench.connection.lost


def test_a_storm_of_one_that_does_not_read_ends_at_the_hosts_own_buffer(bench: Bench) -> None:
    storm, sent = command(6, b"\0") * 100, 0
    with suppress(BlockingIOError):
        while True:
            sent += bench.host.send(storm)
            bench.connection.poll(0)
            assert len(bench.connection._unsent) < MAX_UNSENT_BYTES + 3 * READ_BYTES
    assert sent > 100_000
    assert bench.connection.is_idle
