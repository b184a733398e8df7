from __future__ import annotations

import contextlib
import grp
import os
import socket
import threading
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import pytest

from tests.host.live import LiveRrc, live_rrc, pty, served
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rrc import RrcClient
from tickrig.wire.rrc.replies import RrcEvent


def test_a_loop_gives_back_what_was_sent() -> None:
    link = SerialLink("loop://")
    link.send(b"OK:beep\n")
    assert link.receive(100_000) == b"OK:beep\n"


def test_nothing_comes_without_waiting() -> None:
    assert SerialLink("loop://").receive(0) == b""


def test_a_closed_link_neither_sends_nor_receives() -> None:
    link = SerialLink("loop://")
    link.close()
    with pytest.raises(LinkClosed, match="cannot write to 'loop://'"):
        link.send(b"x")
    with pytest.raises(LinkClosed, match="cannot read from 'loop://'"):
        link.receive(0)


@pytest.mark.parametrize("url", ["/dev/no-such-port", "nonsense://x", "socket://127.0.0.1:1"])
def test_a_port_that_cannot_be_opened_is_named(url: str) -> None:
    with pytest.raises(LinkClosed, match=f"cannot open '{url}'"):
        RrcClient.open(url)


def test_a_port_that_another_program_uses_is_refused_with_its_name() -> None:
    with pty() as port, contextlib.closing(SerialLink(port.path)):
        with pytest.raises(LinkClosed) as refused:
            SerialLink(port.path)
        told = f"cannot open '{port.path}': another program uses it: "
        assert str(refused.value).startswith(told)
        assert str(refused.value).endswith(f" (process {os.getpid()})")
        SerialLink(port.path, exclusive=False).close()


def test_a_port_is_free_again_after_it_was_closed() -> None:
    with pty() as port:
        SerialLink(port.path).close()
        SerialLink(port.path).close()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody else")
@pytest.mark.parametrize(
    ("mode", "remedy"),
    [
        (0o660, r"join its group: sudo usermod -aG daemon \$USER, then log in again"),
        (0o620, "its owner alone may use it"),
    ],
)
def test_a_port_that_is_forbidden_is_told_once_with_the_remedy(mode: int, remedy: str) -> None:
    with pty() as port:
        os.chown(port.path, 0, grp.getgrnam("daemon").gr_gid)
        Path(port.path).chmod(mode)
        os.seteuid(65_534)
        try:
            with pytest.raises(LinkClosed, match=f"': permission denied; {remedy}$"):
                SerialLink(port.path)
        finally:
            os.seteuid(0)


def test_a_port_that_is_not_there_is_told_in_few_words() -> None:
    with pytest.raises(LinkClosed) as refused:
        SerialLink("/dev/no-such-port")
    assert str(refused.value) == "cannot open '/dev/no-such-port': No such file or directory"


def test_a_file_that_is_no_port_is_told() -> None:
    with pytest.raises(LinkClosed, match=r"'/dev/null': it is no serial port$"):
        SerialLink("/dev/null")


@pytest.mark.realtime
def test_the_client_works_on_a_pty() -> None:
    with pty() as port, live_rrc(port) as rrc, RrcClient.open(port.path) as client:
        drive_forward(client, rrc)
        assert (rrc.read("state"), rrc.read("out_v_pct")) == ("Output", 30)


@pytest.mark.realtime
def test_the_client_works_on_a_socket() -> None:
    with socket_client() as (client, rrc):
        drive_forward(client, rrc)
        assert (rrc.read("state"), rrc.read("out_v_pct")) == ("Output", 30)


@pytest.mark.realtime
@pytest.mark.filterwarnings("ignore:set:DeprecationWarning")  # of pyserial's own thread
def test_the_client_works_on_a_serial_server_of_rfc_2217() -> None:
    with (
        served("rfc2217") as port,
        live_rrc(port) as rrc,
        RrcClient.open(port.url) as client,
    ):
        drive_forward(client, rrc)
        assert (rrc.read("state"), rrc.read("out_v_pct")) == ("Output", 30)
        start_us = client.now_us
        client.run_for(100_000)
        assert client.now_us - start_us < 1_000_000


@pytest.mark.realtime
def test_a_socket_gives_all_that_is_there_at_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = SerialLink("socket://{}:{}".format(*server.getsockname()))
        connection, _ = server.accept()
        with contextlib.closing(link):
            connection.sendall(bytes(100))
            assert len(link.receive(5_000_000)) == 100
            connection.sendall(b"x")
            connection.close()
            assert link.receive(5_000_000) == b"x"
            with pytest.raises(LinkClosed, match="cannot read from 'socket:"):
                link.receive(5_000_000)


@pytest.mark.realtime
def test_status_lines_are_whole_on_a_socket() -> None:
    with socket_client() as (client, rrc):
        rrc.set("power_button", 1)
        client.wait_for(RrcEvent.POWER_ON_SUCCESS, 3_000_000)
        client.status()
        assert len(list(islice(client.statuses(100_000), 50))) == 50
        assert not client.unknown


@contextlib.contextmanager
def socket_client() -> Iterator[tuple[RrcClient, LiveRrc]]:
    """A client on a TCP socket, and the emulator at the other end."""
    with contextlib.ExitStack() as stack:
        port = stack.enter_context(served("socket"))
        rrc = stack.enter_context(live_rrc(port))
        client = RrcClient.open(port.url)
        yield stack.enter_context(client), rrc


def drive_forward(client: RrcClient, rrc: LiveRrc) -> None:
    """Switch VR2 on, set up what safe driving needs, drive for longer than the watchdog."""
    rrc.set("power_button", 1)
    client.wait_for(RrcEvent.POWER_ON_SUCCESS, 3_000_000)
    client.stablemode()
    client.watchdog(200_000)
    client.output(30, 0, confirm=True)
    client.run_for(400_000)


@pytest.fixture(params=["pty", "socket"])
def lost_client(request: pytest.FixtureRequest) -> Iterator[RrcClient]:
    """A client whose emulator has ended."""
    with contextlib.ExitStack() as emulator:
        if request.param == "pty":
            port = emulator.enter_context(pty())
            url = port.path
            emulator.enter_context(live_rrc(port))
        else:
            network = emulator.enter_context(served("socket"))
            url = network.url
            emulator.enter_context(live_rrc(network))
        client = RrcClient.open(url)
    with client:
        yield client


CALLS: list[Callable[[RrcClient], object]] = [
    lambda client: client.run_for(1_000_000),
    lambda client: list(client.events(1_000_000)),
    lambda client: list(client.statuses(1_000_000)),
    lambda client: client.wait_for(RrcEvent.INITIALIZED, 1_000_000),
    lambda client: client.device(),
    lambda client: client.start(),
]


@pytest.mark.realtime
def test_a_lost_connection_comes_out_of_every_call(lost_client: RrcClient) -> None:
    before_us = lost_client.now_us
    for call in CALLS:
        with pytest.raises(LinkClosed):
            call(lost_client)
    assert lost_client.now_us - before_us < 1_000_000


@pytest.mark.realtime
def test_a_port_that_closes_meanwhile_ends_the_wait() -> None:
    with pty() as port:
        link = SerialLink(port.path)
        unplugging = threading.Timer(0.05, port.close)
        unplugging.start()
        with contextlib.closing(link), pytest.raises(LinkClosed, match="cannot read"):
            link.receive(10_000_000)
        unplugging.join()
