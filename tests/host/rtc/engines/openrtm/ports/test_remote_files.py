"""System files with remote components, by `tickrig rtc run`."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.environment import ROOT
from tests.host.rtc.chain import make_manager
from tests.host.rtc.engines.openrtm.live_system import start_system
from tests.host.rtc.engines.openrtm.name_server import DEADLINE_S, OmniNames, eventually
from tests.host.rtc.engines.openrtm.ports.foreign import Peer
from tickrig.host.cli.engine_options import Endpoint
from tickrig.host.rtc.engines.openrtm.peers import parse_path
from tickrig.host.rtc.system.system import restore
from tickrig.host.rtc.system.system_file import parse_toml

SYSTEM = """
[[component]]
name = "ConsoleOut0"
type = "ConsoleOut"
rate_hz = 100.0
active = true

[[connection]]
ports = ["Joystick0.out", "ConsoleOut0.in"]

[[remote]]
name = "Joystick0"
path = "{path}"
"""


@pytest.fixture
def peer(foreign_stubs: Path, omni_names: OmniNames) -> Iterator[Peer]:
    """Return a foreign component that is bound in the name server."""
    peer = Peer(foreign_stubs, name_server=omni_names.address)
    try:
        yield peer
    finally:
        peer.kill()


def test_a_foreign_component_writes_into_a_system_that_is_run(
    tmp_path: Path, omni_names: OmniNames, peer: Peer
) -> None:
    file, saved = tmp_path / "system.toml", tmp_path / "after.toml"
    file.write_text(SYSTEM.format(path=f"{omni_names.address}/peer.host_cxt/Peer0.rtc"))
    system = start_system(omni_names, tmp_path, str(file), "--save", str(saved))
    try:
        eventually(lambda: bool(peer.ask("connectors")), "no connector")
        eventually(lambda: peer.ask("put", 42) == ["PORT_OK"], "no value")
        assert system.process.stdout is not None
        assert "42" in system.process.stdout.readline()
        status, _ = system.end()
        assert status == 0
        eventually(lambda: peer.ask("connectors") == {}, "the peer was not told")
        assert 'name = "Joystick0"' in saved.read_text()
        assert 'ports = ["Joystick0.out", "ConsoleOut0.in"]' in saved.read_text()
    finally:
        system.process.kill()
        system.process.communicate()


def test_a_system_ends_although_a_peer_hangs(
    tmp_path: Path, omni_names: OmniNames, peer: Peer
) -> None:
    file = tmp_path / "system.toml"
    file.write_text(SYSTEM.format(path=f"{omni_names.address}/peer.host_cxt/Peer0.rtc"))
    system = start_system(omni_names, tmp_path, str(file))
    try:
        eventually(lambda: bool(peer.ask("connectors")), "no connector")
        peer.pause()
        status, said = system.end()
        assert (status, "Traceback" in said) == (0, False)
    finally:
        system.process.kill()
        system.process.communicate()


@pytest.mark.parametrize(
    ("path", "openrtm", "said"),
    [
        ("localhost/a.rtc", "", "Joystick0 runs elsewhere: --openrtm HOST says where"),
        ("nowhere", "localhost:1", "--openrtm: path 'nowhere' is not like localhost:2809/"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(
    tmp_path: Path, path: str, openrtm: str, said: str
) -> None:
    file = tmp_path / "system.toml"
    file.write_text(SYSTEM.format(path=path))
    words = ["--openrtm", openrtm] if openrtm else []
    command = [sys.executable, "-m", "tickrig", "rtc", "run", str(file), *words]
    command += ["--control", str(tmp_path / "ctl")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    assert done.returncode == 2
    assert said in done.stderr
    errors = [line for line in done.stderr.splitlines() if not line.startswith("name server ")]
    assert len(errors) == 1, done.stderr


def test_the_file_of_the_page_is_one() -> None:
    page = (ROOT / "docs" / "howto" / "openrtm.md").read_text("utf-8")
    (block,) = re.findall(r"```toml\n(# joystick\.toml\n.*?)```", page, re.DOTALL)
    manager = make_manager()
    restore(manager, parse_toml(block))
    (wanted,) = manager.remotes.connections
    where = Endpoint("localhost", 2809), "robot.host_cxt/Joystick0.rtc"
    assert parse_path(wanted.remote.path) == where
