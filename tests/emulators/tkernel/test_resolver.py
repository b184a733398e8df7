"""The command `ucode-resolver`."""

from __future__ import annotations

import signal
import socket
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.rtc.ucode.bench import DOOR
from tests.host.rtc.ucode.test_http_source import DEADLINE_S, get
from tickrig.emulators.bench.child import Child, running
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.tkernel.commands.resolver_cli import main as resolver
from tickrig.emulators.tkernel.ucode_table import EXAMPLE
from tickrig.host.rtc.ucode.cache import SourceStatus

MODULE = "tickrig.emulators.tkernel.commands.resolver_cli"


def ctl(child: Child, *words: str) -> str:
    result = CliRunner().invoke(tickrig, ["ctl", str(child.control), *words])
    assert result.exit_code == 0, result.output
    return result.stdout


def until(address: str, status: SourceStatus) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while get(address).status is not status:
        assert time.monotonic() < deadline_s


@pytest.mark.realtime
def test_it_serves_a_table_and_has_its_faults_by_name(tmp_path: Path) -> None:
    table = tmp_path / "places.toml"
    table.write_text(EXAMPLE)
    with running(MODULE, str(table), "--port", "0", linked=False) as child:
        url = child.log.read_text().split("\n")[0]
        address = f"{url}/ucodes/{DOOR}"
        assert get(address).text == f"{url}/contents/door"
        assert "unknown_ucode" in ctl(child, "describe")
        ctl(child, "fault", "unreachable")
        until(address, SourceStatus.FAILED)
        ctl(child, "clear", "unreachable")
        until(address, SourceStatus.FOUND)
        ctl(child, "set", "unknown_ucode", "1")
        until(address, SourceStatus.UNKNOWN)
        assert "unknown 1" in ctl(child, "get", "requests", "unknown")
        assert "faults ['unknown_ucode']" in ctl(child, "status")
        child.process.send_signal(signal.SIGINT)
        assert child.process.wait(DEADLINE_S) == 0
        assert "Traceback" not in child.log.read_text()


def test_the_example_is_a_table(tmp_path: Path) -> None:
    result = CliRunner().invoke(resolver, ["--example"])
    assert (result.exit_code, result.stdout) == (0, EXAMPLE)


def test_mistakes_are_one_line(tmp_path: Path) -> None:
    table = tmp_path / "places.toml"
    table.write_text(EXAMPLE)
    bad = tmp_path / "bad.toml"
    bad.write_text("[ucode]")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        for words, told in {
            (): "give a TABLE, or --example",
            ("/nowhere",): "table /nowhere: No such file",
            (str(bad),): "line 1: no key 'ucode'",
            (str(table), "--port", port): f"--port {port}: Address already in use",
            (str(table), "--fault", "nope"): "--fault: no fault 'nope'",
            (str(table), "--fault", "slow=0.5"): "--fault: slow takes no argument",
        }.items():
            result = CliRunner().invoke(resolver, list(words))
            assert result.exit_code == 2
            assert told in result.stderr
            assert result.stderr.count("\n") == 1
