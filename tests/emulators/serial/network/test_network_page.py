"""The section "Over the network" of docs/reference/bench/hosts.md, command by command."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tickrig.host.rrc import RrcClient

pytestmark = pytest.mark.realtime

ROOT = Path(__file__).parents[4]
TEXT = (ROOT / "docs/reference/bench/hosts.md").read_text("utf-8")
SECTION = TEXT.partition("\n## Over the network\n")[2].partition("\n## ")[0]
PATIENCE_S = 20.0
ANSWER = "OK:device\nRRC\n"


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", SECTION, re.DOTALL | re.MULTILINE)


def commands() -> list[str]:
    return re.findall(r"^\$ (.*)$", "".join(blocks("console")), re.MULTILINE)


def command(program: str) -> str:
    """Return the one command of the section that names a program."""
    (found,) = (line for line in commands() if program in line)
    return found


@contextmanager
def running(line: str) -> Iterator[subprocess.Popen[str]]:
    """Run one of our commands as the page has it."""
    name, *words = line.split()
    assert name == "rrc-emu"
    program = "from tickrig.emulators.rrc.cli import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)


def free_ports(count: int, address: str = "127.0.0.1") -> list[str]:
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.create_server((address, 0))) for _ in range(count)]
        return [str(each.getsockname()[1]) for each in sockets]


@pytest.fixture(scope="module")
def ports() -> Iterator[dict[str, str]]:
    """Run the first command at free ports; return which stand for those of the page."""
    ports = dict(zip(("7000", "7001"), free_ports(2), strict=True))
    first, *_ = commands()
    (shown, *_) = blocks("console")
    with running(at(ports, first)) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        for line in at(ports, shown).splitlines()[1:3]:
            assert process.stdout.readline() == f"{line}\n"
        for line in at(ports, shown).splitlines()[3:]:
            assert process.stderr.readline() == f"{line}\n"
        yield ports


def at(ports: dict[str, str], text: str) -> str:
    for shown, used in ports.items():
        text = text.replace(shown, used)
    return text


def needs(program: str) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"no {program} here")


def test_every_command_of_the_section_is_run_here() -> None:
    assert [line.split()[0] for line in commands()] == [
        *("rrc-emu", "printf", "rrc-emu", "docker", "socat")
    ]
    assert len(blocks("python")) == len(blocks("js")) == 1


@pytest.mark.filterwarnings("ignore:set:DeprecationWarning")  # of pyserial's own thread
def test_pyserial_asks(ports: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    (program,) = blocks("python")
    exec(compile(at(ports, program), "docs/reference/bench/hosts.md", "exec"), {})
    assert capsys.readouterr().out == f"{ANSWER.encode()!r}\n"


def test_another_language_asks(ports: dict[str, str]) -> None:
    needs("node")
    (program,) = blocks("js")
    words = ["node", "-e", at(ports, program)]
    out = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    assert out.stdout.startswith("OK:device\n")


def test_a_shell_asks(ports: dict[str, str]) -> None:
    needs("nc")
    assert asked_in_a_shell(at(ports, command("printf 'device\\n' | nc -w 2 127"))) == ANSWER


def asked_in_a_shell(line: str) -> str:
    done = subprocess.run(
        ["sh", "-c", line], capture_output=True, text=True, timeout=PATIENCE_S, check=True
    )
    return done.stdout


def test_a_path_is_made_by_socat(ports: dict[str, str], tmp_path: Path) -> None:
    needs("socat")
    line = at(ports, command("socat")).replace("/tmp/rrc", f"{tmp_path}/tty")
    process = subprocess.Popen(line.split())
    try:
        deadline = time.monotonic() + PATIENCE_S
        while not (tmp_path / "tty").exists():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with RrcClient.open(f"{tmp_path}/tty") as client:
            assert client.device() == "RRC"
    finally:
        process.terminate()
        process.wait()


def own_address() -> str:
    """Return an address of this machine that others see: where a container would connect."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # a datagram socket sends nothing yet
        except OSError:
            pytest.skip("this machine has the loopback interface only")
        return str(probe.getsockname()[0])


def test_what_a_container_runs_reaches_the_emulator() -> None:
    """By another address than that of loopback; docker itself is not run."""
    needs("nc")
    bridge = own_address()
    used = {"172.17.0.1": bridge, "7001": free_ports(1, bridge)[0], "host.docker.internal": bridge}
    inner = command("docker run").partition('sh -c "')[2].removesuffix('"')
    with running(at(used, command("172.17.0.1"))) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == f"socket://{bridge}:{used['7001']}\n"
        assert asked_in_a_shell(at(used, inner)) == ANSWER
