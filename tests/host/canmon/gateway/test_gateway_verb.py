"""`canmon gateway`: standard input, TCP and a Unix socket."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.gateway.gateway_verb import parse_address

RIG = '[device.drive]\ntype = "epos"\nnode_id = 5\n'
PROGRAM = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()", "gateway")
PATIENCE_S = 30


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    path = tmp_path / "bench.toml"
    path.write_text(RIG)
    return path


def gateway(*words: object, lines: str = "") -> Result:
    arguments = ["gateway", *map(str, words)]
    return CliRunner().invoke(main, arguments, input=lines, catch_exceptions=False)


def test_standard_input_is_answered_line_by_line(rig: Path) -> None:
    result = gateway(rig, lines="[1] 5 w 0x1017 0 u16 500\n\n# so\n[2] 5 r 0x1017 0 u16\n")
    assert (result.exit_code, result.stdout) == (0, "[1] OK\n[2] 500\n")


def test_an_error_goes_on_and_ends_with_status_1(rig: Path) -> None:
    result = gateway(rig, lines="[1] 5 r 0x5000 0\n[2] 5 start\n")
    assert result.exit_code == 1
    assert result.stdout.splitlines() == [
        "[1] ERROR:0x06020000 #object does not exist (06020000h)",
        "[2] OK",
    ]


def test_bytes_of_a_text_come_back_as_they_went_in(rig: Path) -> None:
    said = b'[1] 5 w 0x1008 0 vs "\xec"\n[2] 5 r 0x1000 0 u32 # \xc3\xa9\n[3] \xec\n'
    result = CliRunner().invoke(main, ["gateway", str(rig)], input=said, catch_exceptions=False)
    lines = result.stdout_bytes.splitlines()
    assert (len(lines), lines[1]) == (3, b"[2] 131474")
    assert b"\xec" in lines[2]


@pytest.mark.parametrize(
    "text", ["", "x", "127.0.0.1:", ":80", "65536", "0100000", "-1", "1e3", "9" * 5_000]
)
def test_an_address_that_is_none_is_refused(rig: Path, text: str) -> None:
    result = gateway(rig, "--listen", text)
    assert result.exit_code == 2
    assert f"--listen {text!r}: a port 0..65535 is wanted, or HOST:PORT" in result.stderr


def test_it_binds_to_loopback_unless_asked() -> None:
    assert parse_address("60000") == ("127.0.0.1", 60_000)
    assert parse_address("0.0.0.0:1") == ("0.0.0.0", 1)
    assert parse_address("[::1]:0") == ("::1", 0)


def test_a_port_that_is_taken_is_told_in_a_line(rig: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        result = gateway(rig, "--listen", port)
    assert result.exit_code == 3
    assert f"Error: --listen 127.0.0.1:{port}: Address already in use\n" in result.stderr
    assert len(result.stderr.splitlines()) <= 3


def test_it_listens_at_one_place(rig: Path, tmp_path: Path) -> None:
    result = gateway(rig, "--listen", "0", "--socket", tmp_path / "s")
    assert result.exit_code == 2
    assert "--listen and --socket: give one of them" in result.stderr


@contextmanager
def serving(*words: object) -> Iterator[tuple[subprocess.Popen[str], str]]:
    command = [*PROGRAM, *map(str, words)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            greeting = process.stderr.readline()
            assert " at " in greeting, greeting
            yield process, greeting.rpartition(" at ")[2].removesuffix(". Ctrl-C ends.\n")
        finally:
            process.kill()


def ask(connection: socket.socket, line: str) -> str:
    connection.sendall(line.encode("latin-1"))
    with connection.makefile("rb") as answers:
        return answers.readline().decode("latin-1")


@pytest.mark.realtime
def test_clients_over_tcp_have_their_own_settings(rig: Path) -> None:
    with serving(rig, "--listen", "0", "--net", "3") as (process, where):
        host, _, port = where.rpartition(":")
        address = host, int(port)
        with (
            socket.create_connection(address, PATIENCE_S) as one,
            socket.create_connection(address, PATIENCE_S) as other,
        ):
            assert ask(one, "[1] 3 set node 5\r\n") == "[1] OK\r\n"
            assert ask(one, "[2] r 0x1000 0 x32\r\n") == "[2] 0x00020192\r\n"
            assert ask(other, "[1] r 0x1000 0\n").startswith("[1] ERROR:105 ")
            assert ask(other, "\n") == "\r\n"
            text = "x" * 10_000
            assert ask(one, f'[3] 5 w 0x1017 0 vs "{text}"\n').startswith("[3] ERROR:0x0607")
        with socket.create_connection(address, PATIENCE_S) as late:
            late.sendall(b"[1] 5 start\n" * 100)
            late.shutdown(socket.SHUT_WR)
            with late.makefile("rb") as answers:
                assert answers.read() == b"[1] OK\r\n" * 100
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0


@pytest.mark.realtime
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no Unix sockets")
def test_a_unix_socket_is_there_while_it_runs(rig: Path, tmp_path: Path) -> None:
    path = tmp_path / "command"
    with serving(rig, "--socket", path) as (process, where):
        assert where == str(path)
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(PATIENCE_S)
            client.connect(str(path))
            assert ask(client, "[7] 5 r 0x1008 0 vs\r\n") == '[7] "EPOS"\r\n'
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE_S) == 0
    assert not path.exists()
