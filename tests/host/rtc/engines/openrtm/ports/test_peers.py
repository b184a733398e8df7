"""Components that run elsewhere, in a system file: found, joined, and joined again."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.rtc.engines.openrtm.name_server import OmniNames
from tests.host.rtc.engines.openrtm.ports.foreign import Peer, Served
from tickrig.host.cli.engine_options import parse_endpoint
from tickrig.host.rtc.engines.openrtm.names import NameServer
from tickrig.host.rtc.engines.openrtm.peers import Peers, parse_path
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.system import describe, restore
from tickrig.host.rtc.system.system_file import parse_toml, write_toml

FILE = """
[[connection]]
ports = ["Far0.{theirs}", "{ours}"]
name = "far"

[connection.properties]
"dataport.dataflow_type" = "{dataflow}"

[[remote]]
name = "Far0"
path = "{server}/peer.host_cxt/Peer0.rtc"
"""


class Kept:
    """A system whose connector with a foreign component is kept."""

    def __init__(self, system: Served, names: OmniNames, foreign_stubs: Path) -> None:
        self.system, self._names, self._stubs = system, names, foreign_stubs
        self.peers: Peers | None = None
        self.peer: Peer | None = None

    def keep(self, ours: str, theirs: str, dataflow: str = "push") -> None:
        text = FILE.format(ours=ours, theirs=theirs, dataflow=dataflow, server=self._names.address)
        restore(self.system.manager, parse_toml(text))
        self.peers = Peers(self.system.ports, self.system.manager, look_us=50_000)

    def start(self) -> Peer:
        self.peer = Peer(self._stubs, name_server=self._names.address)
        return self.peer

    def close(self) -> None:
        if self.peers is not None:
            self.peers.close()
        if self.peer is not None:
            self.peer.kill()


@pytest.fixture
def kept(system: Served, omni_names: OmniNames, foreign_stubs: Path) -> Iterator[Kept]:
    kept = Kept(system, omni_names, foreign_stubs)
    try:
        yield kept
    finally:
        kept.close()


def joined(peer: Peer) -> bool:
    return bool(peer.ask("connectors"))


@pytest.mark.parametrize("dataflow", ["push", "pull"])
def test_a_component_that_comes_later_and_again_is_joined(
    kept: Kept, dataflow: str, caplog: pytest.LogCaptureFixture
) -> None:
    system = kept.system
    with caplog.at_level(logging.WARNING):
        kept.keep("ConsoleOut0.in", "out", dataflow)
        system.until(lambda: caplog.records)
        for number in (1, 2):
            peer = kept.start()
            system.until(lambda: joined(peer))  # noqa: B023 - called at once
            if dataflow == "push":
                peer.ask("put", number)
            else:
                peer.ask("wait", number)
            system.until(lambda: len(system.numbers) == number)  # noqa: B023
            system.until(lambda: caplog.text.count("Far0.out: connected") == number)  # noqa: B023
            peer.kill()
    assert system.numbers == [1, 2]
    assert len(system.console_out.in_.connectors) == 1
    lines = [record.getMessage() for record in caplog.records]
    first = "Far0.out: no such name: NotFound; asked again every second"
    assert lines[:2] == [first, "Far0.out: connected"]
    own = [line for line in lines if line.startswith("Far0.out: ")]
    assert len(own) == 4 + (own[-1] != "Far0.out: connected")


@pytest.mark.parametrize(("ours", "theirs"), [("ConsoleOut0.in", "out"), ("ConsoleIn0.out", "in")])
def test_a_connector_names_its_data_type_as_rtcryo_wants_it(
    kept: Kept, ours: str, theirs: str
) -> None:
    peer = kept.start()
    kept.keep(ours, theirs)
    kept.system.until(lambda: joined(peer))
    ((connector_id,),) = peer.ask("connectors").values()
    properties = peer.ask("properties", connector_id)[theirs]
    assert properties["dataport.data_type"] == "IDL:RTC/TimedLong:1.0"


def test_a_component_that_hangs_is_kept(kept: Kept, caplog: pytest.LogCaptureFixture) -> None:
    system, peer = kept.system, kept.start()
    with caplog.at_level(logging.INFO):
        kept.keep("ConsoleIn0.out", "in")
        system.until(lambda: "Far0.in: connected" in caplog.text)
    (connector,) = system.console_in.out.connectors
    peer.pause()
    system.console_in.enter(1)
    system.until(lambda: connector.state == "lost")
    peer.resume()
    system.until(lambda: connector.state == "connected")
    assert system.console_in.out.connectors == (connector,)
    assert [received[2] for received in peer.ask("received")] == [1]


@pytest.mark.parametrize("by", ["us", "them"])
def test_a_connector_that_somebody_ended_is_left_so(
    kept: Kept, by: str, caplog: pytest.LogCaptureFixture
) -> None:
    system, peer = kept.system, kept.start()
    with caplog.at_level(logging.INFO):
        kept.keep("ConsoleIn0.out", "in")
        system.until(lambda: joined(peer) and system.console_in.out.connectors)
        (connector,) = system.console_in.out.connectors
        if by == "us":
            connector.end()
        else:
            system.do(lambda: peer.ask("disconnect", "in", connector.profile.connector_id))
        system.until(lambda: "the connector was ended" in caplog.text)
    assert not joined(peer)
    assert system.console_in.out.connectors == ()


def test_a_port_that_is_not_there_or_does_not_fit_costs_a_line(
    kept: Kept, caplog: pytest.LogCaptureFixture
) -> None:
    kept.start()
    kept.keep("ConsoleIn0.out", "none")
    kept.system.until(lambda: caplog.records)
    for _ in range(200):
        kept.system.step()
    (record,) = caplog.records
    known = "known: out, in, path_out, path_in, provides, requires"
    expected = f"Far0.none: it has no port 'none'; {known}; asked again every second"
    assert record.getMessage() == expected


class NoPorts:
    """A component that gives nothing for a port."""

    def get_ports(self) -> list[None]:
        return [None]


def test_a_peer_that_gives_nothing_for_a_port_costs_a_line(
    kept: Kept, omni_names: OmniNames, caplog: pytest.LogCaptureFixture
) -> None:
    orb = kept.system.orb
    names = NameServer(orb, parse_endpoint(omni_names.address))
    names.bind("peer.host_cxt/Peer0.rtc", orb.serve(stubs().skeleton("RTC.RTObject"), NoPorts()))
    kept.keep("ConsoleIn0.out", "in")
    reason = "Far0.in: it has no port 'in'; known: none; asked again every second"
    kept.system.until(lambda: reason in caplog.messages)
    names.close()
    assert "a call raised" not in caplog.text
    kept.start()  # under the same name, and it is still asked for
    kept.system.until(lambda: "Far0.in: connected" in caplog.messages)


def test_a_name_server_that_is_not_there_costs_a_line(
    kept: Kept, omni_names: OmniNames, caplog: pytest.LogCaptureFixture
) -> None:
    omni_names.kill()
    kept.keep("ConsoleIn0.out", "in")
    kept.system.until(lambda: caplog.records)
    for _ in range(200):
        kept.system.step()
    (record,) = caplog.records
    assert record.getMessage() == "Far0.in: not reachable; asked again every second"
    omni_names.start()
    peer = kept.start()
    kept.system.until(lambda: joined(peer))


def test_a_system_with_remote_components_is_saved_as_it_was(
    kept: Kept, omni_names: OmniNames
) -> None:
    kept.keep("ConsoleIn0.out", "in")
    text = write_toml(describe(kept.system.manager))
    assert f'path = "{omni_names.address}/peer.host_cxt/Peer0.rtc"' in text
    saved = parse_toml(text)
    assert [connection.ports for connection in saved.connections] == [("Far0.in", "ConsoleIn0.out")]
    assert saved == describe(kept.system.manager)


@pytest.mark.parametrize("path", ["", "localhost", "localhost/", "localhost//a", "a b/x", "h:0/x"])
def test_a_path_that_leads_nowhere_is_refused(path: str) -> None:
    with pytest.raises(RtcRefused, match="path "):
        parse_path(path)
