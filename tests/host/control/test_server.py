from __future__ import annotations

import json
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.emulators.lamp import Lamp
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.server import IDLE_S, MAX_CLIENTS, MAX_LINE, MAX_UNSENT, ControlServer


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "ctl"


@pytest.fixture
def server(path: Path) -> Iterator[ControlServer]:
    server = ControlServer(path, EmulatorControl(Emulator("lamp", Lamp())))
    yield server
    server.close()


class Client:
    def __init__(self, server: ControlServer, path: Path) -> None:
        self.server, self.received = server, b""
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(str(path))
        self.socket.setblocking(False)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *error: object) -> None:
        self.socket.close()

    def send(self, data: bytes) -> None:
        self.socket.sendall(data)

    def answers(self, rounds: int = 5) -> list[Any]:
        for _ in range(rounds):
            self.server.serve(0)
            try:
                self.received += self.socket.recv(1_000_000)
            except BlockingIOError:
                continue
        *lines, self.received = self.received.split(b"\n")
        return [json.loads(line) for line in lines]


GET = b'{"v":1,"do":"get","names":["lamp"]}\n'


def test_only_this_user_may_connect(server: ControlServer, path: Path) -> None:
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_request_may_come_in_pieces_or_several_at_once(server: ControlServer, path: Path) -> None:
    with Client(server, path) as client:
        client.send(GET[:10])
        assert client.answers() == []
        client.send(GET[10:] + GET + GET)
        assert [answer["values"] for answer in client.answers()] == [{"lamp": 1}] * 3


def test_clients_do_not_hear_each_other(server: ControlServer, path: Path) -> None:
    with Client(server, path) as first, Client(server, path) as second:
        first.send(b'{"v":1,"do":"get","id":1}\n')
        second.send(b'{"v":1,"do":"get","id":2}\n')
        assert [answer["id"] for answer in first.answers()] == [1]
        assert [answer["id"] for answer in second.answers()] == [2]


def test_a_bad_line_costs_nobody_the_connection(server: ControlServer, path: Path) -> None:
    with Client(server, path) as client:
        client.send(b"nonsense\n" + GET)
        assert [answer["ok"] for answer in client.answers()] == [False, True]


@pytest.mark.parametrize("size", [MAX_LINE + 1, 3 * MAX_LINE, 20 * MAX_LINE])
def test_an_oversize_line_is_answered_once_and_skipped(
    server: ControlServer, path: Path, size: int
) -> None:
    with Client(server, path) as client:
        client.send(b" " * size)
        answers = client.answers(30)
        client.send(b"\n" + GET)
        answers += client.answers(30)
        assert [answer["ok"] for answer in answers] == [False, True]
        assert answers[0]["error"] == f"the line is longer than {MAX_LINE} bytes"


def test_a_line_of_the_greatest_length_is_read(server: ControlServer, path: Path) -> None:
    with Client(server, path) as client:
        client.send(GET[:-1] + b" " * (MAX_LINE - len(GET) + 1) + b"\n")
        assert [answer["ok"] for answer in client.answers()] == [True]


def test_a_round_answers_one_line_of_each_client(server: ControlServer, path: Path) -> None:
    with Client(server, path) as client:
        client.send(GET * 20)
        assert len(client.answers(rounds=7)) <= 7
        assert len(client.answers(rounds=20)) >= 13


def test_a_client_that_does_not_read_is_not_read_from(server: ControlServer, path: Path) -> None:
    with Client(server, path) as client:
        sent = 0
        for _ in range(3_000):
            server.serve(0)
            try:
                sent += client.socket.send(b'{"v":1,"do":"describe"}\n')
            except BlockingIOError:
                break
        for _ in range(3_000):
            server.serve(0)
        unsent = max(len(c._unsent) for c in server._clients.values())
        assert MAX_UNSENT <= unsent < 2 * MAX_UNSENT
        with Client(server, path) as other:
            other.send(GET)
            assert [answer["ok"] for answer in other.answers()] == [True]


def test_a_client_that_goes_is_forgotten(server: ControlServer, path: Path) -> None:
    for farewell in (b"", GET, b"{", GET * 50):
        with Client(server, path) as client:
            client.send(farewell)
            server.serve(0)
        for _ in range(60):
            server.serve(0)
        assert server._clients == {}


def test_there_is_room_for_some_clients_only(server: ControlServer, path: Path) -> None:
    clients = []
    for _ in range(MAX_CLIENTS):
        clients.append(Client(server, path))
        server.serve(0)
    with Client(server, path) as late:
        (answer,) = late.answers()
        assert answer["error"] == f"there are {MAX_CLIENTS} clients already"
    for client in clients:
        client.socket.close()


Full = tuple[ControlServer, list[Client], list[float]]
"""A server without a free place, its clients, and its time in seconds."""


@pytest.fixture
def full(path: Path) -> Iterator[Full]:
    now_s = [0.0]
    server = ControlServer(path, EmulatorControl(Emulator("lamp", Lamp())), lambda: now_s[0])
    clients = []
    for _ in range(MAX_CLIENTS):
        clients.append(Client(server, path))
        server.serve(0)
    yield server, clients, now_s
    for client in clients:
        client.socket.close()
    server.close()


def test_a_silent_client_makes_room(full: Full, path: Path) -> None:
    server, clients, now_s = full
    silent = clients.pop(7)
    now_s[0] = 1.0
    for client in clients:
        client.send(GET)
        assert client.answers()[0]["ok"]
    now_s[0] = IDLE_S
    with Client(server, path) as late, silent:
        late.send(GET)
        assert [answer["ok"] for answer in late.answers()] == [True]
        assert silent.answers()[0]["error"].startswith("silent for 60 s")
        assert silent.socket.recv(1) == b""
    for client in clients:
        client.send(GET)
        assert [answer["ok"] for answer in client.answers()] == [True]


def test_a_silent_client_stays_where_there_is_room(full: Full, path: Path) -> None:
    server, clients, now_s = full
    clients.pop().socket.close()
    server.serve(0)
    now_s[0] = 1_000 * IDLE_S
    with Client(server, path) as late:
        late.send(GET)
        assert [answer["ok"] for answer in late.answers()] == [True]
    for client in clients:
        client.send(GET)
        assert [answer["ok"] for answer in client.answers()] == [True]


def test_a_client_that_does_not_read_makes_room(full: Full, path: Path) -> None:
    server, clients, now_s = full
    for _ in range(3_000):
        server.serve(0)
        try:
            clients[3].socket.send(b'{"v":1,"do":"describe"}\n')
        except BlockingIOError:
            break
    now_s[0] = IDLE_S
    with Client(server, path) as late:
        for client in [*clients[:3], *clients[4:], late]:
            client.send(GET)
        assert [answer["ok"] for answer in late.answers()] == [True]


def test_waiting_ends_when_its_time_is_over(server: ControlServer) -> None:
    server.serve(1_000)


def test_the_file_of_a_killed_emulator_is_replaced(path: Path) -> None:
    dead = socket.socket(socket.AF_UNIX)
    dead.bind(str(path))
    dead.close()
    server = ControlServer(path, EmulatorControl(Emulator("lamp", Lamp())))
    with Client(server, path) as client:
        client.send(GET)
        assert [answer["ok"] for answer in client.answers()] == [True]
    server.close()
    assert not path.exists()


def test_a_live_one_is_left_alone(server: ControlServer, path: Path) -> None:
    with pytest.raises(FileExistsError, match="another process listens there"):
        ControlServer(path, EmulatorControl(Emulator("lamp", Lamp())))
    with Client(server, path) as client:
        client.send(GET)
        assert [answer["ok"] for answer in client.answers()] == [True]


def test_another_file_is_left_alone(path: Path) -> None:
    path.write_text("precious")
    with pytest.raises(FileExistsError):
        ControlServer(path, EmulatorControl(Emulator("lamp", Lamp())))
    assert path.read_text() == "precious"


def test_a_path_that_is_too_long_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="too long"):
        ControlServer(tmp_path / ("x" * 120), EmulatorControl(Emulator("lamp", Lamp())))


def test_a_socket_that_somebody_else_put_there_stays(server: ControlServer, path: Path) -> None:
    os.rename(path, path.with_suffix(".old"))
    path.write_text("somebody else's")
    server.close()
    assert path.exists()


def test_the_last_answer_is_sent_before_hanging_up(path: Path) -> None:
    server = ControlServer(path, EmulatorControl(Emulator("lamp", Lamp())))
    with Client(server, path) as client:
        client.send(b'{"v":1,"do":"stop"}\n')
        server.serve(0)
        server.serve(0)
        server.close()
        assert json.loads(client.socket.recv(100))["ok"]
