"""RTSProfiles go both ways between rtshell and `tickrig rtc`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.live_system import LiveSystem, has_components, live_system

pytestmark = [OMNIORB, pytest.mark.realtime]

CHAIN = """
[[component]]
name = "ConsoleIn0"
type = "ConsoleIn"
rate_hz = 100.0

[[component]]
name = "ConsoleOut0"
type = "ConsoleOut"
rate_hz = 100.0

[[connection]]
ports = ["ConsoleIn0.out", "ConsoleOut0.in"]

[connection.properties]
"dataport.subscription_type" = "new"
"""


@pytest.fixture
def system(tmp_path: Path) -> Iterator[LiveSystem]:
    (tmp_path / "chain.toml").write_text(CHAIN, "utf-8")
    with live_system(tmp_path, str(tmp_path / "chain.toml")) as system:
        has_components(system, "ConsoleIn0", "ConsoleOut0")
        yield system


def states(system: LiveSystem) -> set[str]:
    return {state for name, state in system.listed().items() if name.endswith(".rtc")}


def test_what_rtcryo_saved_is_started_stopped_torn_down_and_resurrected(
    system: LiveSystem, tmp_path: Path
) -> None:
    saved = str(tmp_path / "saved.xml")
    assert system.tool("rtcryo", "-o", saved, system.names.address) == (0, "", "")
    assert system.tool("rtstart", saved)[0] == 0
    assert states(system) == {"Active"}
    assert system.tool("rtcheck", saved) == (0, "", "")
    assert system.tool("rtteardown", saved) == (0, "", "")
    code, _, said = system.tool("rtcheck", saved)
    assert code == 1
    assert said.startswith("No connection between ")
    assert system.tool("rtresurrect", saved) == (0, "", "")
    assert system.tool("rtcheck", saved) == (0, "", "")
    assert system.tool("rtstop", saved)[0] == 0
    assert states(system) == {"Inactive"}
    assert system.tool("rtcheck", "-s", "Inactive", saved) == (0, "", "")


def test_what_rtcryo_saved_is_run_by_us(system: LiveSystem, tmp_path: Path) -> None:
    saved = str(tmp_path / "saved.xml")
    assert system.tool("rtcryo", "-o", saved, system.names.address) == (0, "", "")
    system.ours("check", saved)
    assert system.end()[0] == 0
    (tmp_path / "other").mkdir()
    with live_system(tmp_path / "other", saved) as other:
        has_components(other, "ConsoleIn0", "ConsoleOut0")
        other.ours("check", str(tmp_path / "chain.toml"))


def test_what_we_saved_is_resurrected(system: LiveSystem, tmp_path: Path) -> None:
    saved = str(tmp_path / "ours.xml")
    system.ours("save", saved)
    system.ours("dis", "ConsoleIn0")
    assert system.tool("rtcheck", "-s", "Inactive", saved)[0] == 1
    assert system.tool("rtresurrect", saved) == (0, "", "")
    assert system.tool("rtcheck", "-s", "Inactive", saved) == (0, "", "")
    system.ours("check", saved)
