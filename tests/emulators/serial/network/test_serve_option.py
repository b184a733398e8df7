"""`--serve` of the command lines, and the programs that people connect with."""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pexpect
import pytest
import serial
from click import Command
from click.testing import CliRunner

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rh3.cli import main as rh3_emu
from tickrig.emulators.rrc.cli import main as rrc_emu
from tickrig.emulators.rtc_lite.cli import main as rtc_lite_emu
from tickrig.emulators.urg.cli import main as urg_emu
from tickrig.host.rrc import RrcClient

ROOT = Path(__file__).parents[4]
PROGRAM = "from tickrig.emulators.rrc.cli import main; main()"
PATIENCE_S = 20.0


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("--serve 7000", "--serve: '7000' is not rfc2217://[HOST:]PORT or socket://[HOST:]PORT"),
        ("--serve socket://a:b", "--serve: 'socket://a:b': port 'b' is not in 0..65535"),
        ("--serve socket://a..b:0", "--serve socket://a..b:0: 'a..b' is no name of a host"),
        ("--serve rfc2217://TAKEN", "--serve rfc2217://127.0.0.1:TAKEN: Address already in use"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(words: str, error: str, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        number = str(taken.getsockname()[1])
        words = words.replace("TAKEN", number)
        result = CliRunner().invoke(rrc_emu, [*words.split(), "--link", str(tmp_path / "tty")])
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"Error: {error.replace('TAKEN', number)}\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("command", "words", "talk"),
    [
        (rrc_emu, "", "python -m serial.tools.miniterm --eol LF -e URL 115200"),
        (tickrig, "emu urg", "python -m serial.tools.miniterm --eol LF -e URL 115200"),
        (urg_emu, "", "python -m serial.tools.miniterm --eol LF -e URL 115200"),
        (rh3_emu, "--baud 57600", "rh3 goto 1 0 0 --device URL --baud 57600"),
        (rtc_lite_emu, "", "tickrig rtc run SYSTEM.toml --lite NAME=URL@57600"),
    ],
)
def test_a_greeting_says_where_and_how_without_any_pty(
    command: Command, words: str, talk: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "openpty")
    words += " --serve rfc2217://0 --scenario -"
    result = CliRunner().invoke(command, words.split(), input="0.02 end\n")
    url = result.stdout.splitlines()[0]
    assert re.fullmatch(r"rfc2217://127\.0\.0\.1:\d+", url)
    assert f" at {url}, " in result.stderr
    assert f"\n  {talk.replace('URL', url)}\n" in result.stderr
    assert result.exit_code == 0


@pytest.mark.realtime
def test_a_pty_and_ports_are_told_in_this_order(tmp_path: Path) -> None:
    words = f"--serve socket://0 --serve rfc2217://0 --link {tmp_path}/tty --scenario -"
    result = CliRunner().invoke(rrc_emu, words.split(), input="0.02 end\n")
    places = result.stdout.splitlines()[:3]
    assert [place.rpartition(":")[0] for place in places[1:]] == [
        "socket://127.0.0.1",
        "rfc2217://127.0.0.1",
    ]
    assert places[0] == f"{tmp_path}/tty"
    assert f"RRC at {', '.join(places)}, 115200 8N1." in result.stderr
    assert "no password" not in result.stderr


@pytest.mark.realtime
def test_a_port_open_to_others_is_warned_of_in_a_line() -> None:
    words = "--serve socket://0.0.0.0:0 --scenario -"
    result = CliRunner().invoke(rrc_emu, words.split(), input="0.02 end\n")
    number = result.stdout.splitlines()[0].rpartition(":")[2]
    assert result.stderr.splitlines()[0] == (
        f"Anyone who reaches port {number} of 0.0.0.0 can drive this device: there is no password."
        " Leave out the host to serve this machine alone."
    )


@pytest.mark.realtime
def test_a_system_without_ptys_serves_all_the_same() -> None:
    words = [sys.executable, "-m", "tests.emulators.serial.network.without_ptys"]
    said = subprocess.run(words, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    refusal = "2 Error: this system has no ptys: serve the line, as --serve rfc2217://7000 2"
    served, refused = said.splitlines()[::2], said.splitlines()[1::2]
    assert [line.partition(" s; late")[0] for line in served] == ["0 ran 0.020"] * 4
    assert refused == [refusal] * 4


class Served:
    """`rrc-emu` in a process of its own, at both kinds of URL and a link."""

    def __init__(self, process: subprocess.Popen[str], control: Path) -> None:
        self.process, self.control = process, control
        assert process.stdout is not None
        self.link, self.rfc2217, self.socket = (process.stdout.readline().strip() for _ in "123")
        self.number = self.socket.rpartition(":")[2]


@pytest.fixture(scope="module")
def rrc(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("serve")
    urls = ["--serve", "rfc2217://0", "--serve", "socket://0"]
    paths = ["--link", str(folder / "tty"), "--control", str(folder / "ctl")]
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *urls, *paths], stdout=subprocess.PIPE, text=True
    )
    try:
        yield Served(process, folder / "ctl")
    finally:
        process.terminate()
        out, _ = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out) == (0, "")


@contextmanager
def serial_port(url: str, baud: int, bits: int = 8, parity: str = "N") -> Iterator[serial.Serial]:
    port = serial.serial_for_url(
        url, baudrate=baud, bytesize=bits, parity=parity, timeout=PATIENCE_S
    )
    with closing(port):
        yield port


@pytest.mark.realtime
@pytest.mark.parametrize("door", ["rfc2217", "socket"])
@pytest.mark.filterwarnings("ignore:set:DeprecationWarning")  # of pyserial's own thread
def test_our_client_talks_at_every_place_and_comes_again(rrc: Served, door: str) -> None:
    for _ in range(2):
        with RrcClient.open(getattr(rrc, door)) as client:
            assert client.device() == "RRC"


@pytest.mark.realtime
@pytest.mark.filterwarnings("ignore:set:DeprecationWarning")
def test_pyserial_has_a_port_with_all_that_belongs_to_one(rrc: Served) -> None:
    with serial_port(rrc.rfc2217, 115_200) as port:
        assert (port.cts, port.dsr, port.ri, port.cd) == (False,) * 4
        port.dtr = port.rts = False
        port.break_condition = True
        port.break_condition = False
        port.reset_input_buffer()
        port.reset_output_buffer()
        port.write(b"device\n")
        assert port.read_until(b"RRC\n") == b"OK:device\nRRC\n"


@pytest.mark.realtime
@pytest.mark.filterwarnings("ignore:set:DeprecationWarning")
def test_a_host_of_another_setting_is_not_understood(rrc: Served) -> None:
    with serial_port(rrc.rfc2217, 9_600, 7, "E") as port:
        port.timeout = 0.3
        port.write(b"device\n")
        assert b"RRC" not in port.read_until(b"RRC\n")
        port.timeout = PATIENCE_S
        port.baudrate, port.bytesize, port.parity = 115_200, 8, "N"
        port.write(b"\ndevice\n")
        assert port.read_until(b"RRC\n").endswith(b"OK:device\nRRC\n")


@pytest.mark.realtime
@pytest.mark.filterwarnings("ignore:set:DeprecationWarning")
def test_the_setting_of_a_host_is_seen_at_the_control_socket(rrc: Served) -> None:
    def status() -> str:
        return CliRunner().invoke(tickrig, ["ctl", str(rrc.control), "status"]).stdout

    with serial_port(rrc.rfc2217, 9_600):
        for _ in range(1_000):
            if "host_setting 9600 8N1\n" in status():
                break
    assert "host_setting 9600 8N1\n" in status()


@pytest.mark.realtime
@pytest.mark.parametrize("words", ["ncat HOST PORT", "socat -t2 - TCP:HOST:PORT", "nc HOST PORT"])
def test_a_program_for_sockets_asks_and_is_answered(rrc: Served, words: str) -> None:
    program, *rest = words.replace("HOST", "127.0.0.1").replace("PORT", rrc.number).split()
    if shutil.which(program) is None:
        pytest.skip(f"no {program} here")
    done = subprocess.run(
        [program, *rest],
        input="device\n",
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    )
    assert done.stdout == "OK:device\nRRC\n"


@pytest.mark.realtime
def test_miniterm_talks_to_it(rrc: Served) -> None:
    miniterm = ["-m", "serial.tools.miniterm", "--eol", "LF", "-e", rrc.rfc2217, "115200"]
    terminal = pexpect.spawn(sys.executable, miniterm, timeout=PATIENCE_S)
    terminal.expect_exact("Quit: Ctrl+]")
    terminal.sendline("device")
    terminal.expect_exact("RRC")
    terminal.send("\x1d")
    terminal.expect(pexpect.EOF)
    terminal.close()
    assert terminal.exitstatus == 0
