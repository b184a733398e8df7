"""RefHard is called both ways: by a foreign component, and at one."""

from __future__ import annotations

from typing import Any

import pytest

from tests.host.rtc.engines.openrtm.ports.foreign import Peer, Served
from tickrig.host.rtc import RtComponent
from tickrig.host.rtc.engines.openrtm.connector_ends import texts
from tickrig.host.rtc.motion.components.ref_hard import RefHardRh3
from tickrig.host.rtc.motion.options.obstacles import CollisionDetection

BOTH_WAYS = pytest.mark.parametrize("first", ["ours", "theirs"])


@pytest.fixture
def base(system: Served) -> Any:
    """Return the component that provides RefHard; it has no line, and needs none for that."""
    return system.serve(system.manager.add(RefHardRh3("RefHardRh30")))


@pytest.fixture
def bumper(system: Served) -> RtComponent:
    """Return the component that calls RefHard: Stop when it is activated, Go at the end."""
    bumper = system.manager.add(CollisionDetection("CollisionDetection0"))
    system.serve(bumper)
    return bumper


def join(system: Served, peer: Peer, first: str, ours: str, theirs: str) -> None:
    ports = [system.service(ours), system.reference(peer.iors[theirs])]
    if first == "theirs":
        ports.reverse()
    assert system.connect(*ports, connector_id="a")[0] == "RTC_OK"


def test_a_service_port_says_what_it_is(system: Served, base: Any) -> None:
    profile = system.do(system.service("RefHardRh30.BumpRefHard").get_port_profile)
    (interface,) = profile.interfaces
    assert (interface.instance_name, interface.type_name) == ("service", "RefHard")
    assert str(interface.polarity) == "PROVIDED"
    assert texts(profile.properties) == {"port.port_type": "CorbaPort"}


@BOTH_WAYS
def test_a_peer_calls_a_service_of_ours(system: Served, peer: Peer, base: Any, first: str) -> None:
    join(system, peer, first, "RefHardRh30.BumpRefHard", "requires")
    assert not base._stopped
    system.do(lambda: peer.ask("call", "Stop"))
    assert base._stopped
    system.do(lambda: peer.ask("call", "Go"))
    assert not base._stopped
    connectors = system.do(system.service("RefHardRh30.BumpRefHard").get_connector_profiles)
    assert "RefHardRh30.port.BumpRefHard.provided.RefHard.service" in texts(
        connectors[0].properties
    )


@BOTH_WAYS
def test_we_call_a_service_of_a_peer(
    system: Served, peer: Peer, bumper: RtComponent, first: str
) -> None:
    join(system, peer, first, "CollisionDetection0.BumpRefHard", "provides")
    system.manager.activate("CollisionDetection0")
    system.until(lambda: peer.ask("called") == ["Stop"])
    system.manager.deactivate("CollisionDetection0")
    system.until(lambda: peer.ask("called") == ["Stop", "Go"])


@pytest.mark.parametrize("lie", ["raise", "gone"])
def test_a_call_that_fails_costs_a_line_and_nothing_waits(
    system: Served, peer: Peer, bumper: RtComponent, lie: str, caplog: pytest.LogCaptureFixture
) -> None:
    join(system, peer, "ours", "CollisionDetection0.BumpRefHard", "provides")
    peer.ask("lie", "stop", lie)
    system.manager.activate("CollisionDetection0")
    system.until(lambda: caplog.records)
    assert "CollisionDetection0.BumpRefHard to" in caplog.records[0].getMessage()
    assert system.manager.state_of("CollisionDetection0").name == "ACTIVE"


def test_a_port_that_does_not_provide_what_is_wanted_is_refused(
    system: Served, peer: Peer, bumper: RtComponent, caplog: pytest.LogCaptureFixture
) -> None:
    port = system.service("CollisionDetection0.BumpRefHard")
    code, _ = system.connect(port, system.reference(peer.iors["in"]))
    assert code == "BAD_PARAMETER"
    assert "share no interface type" in caplog.records[0].getMessage()
    assert peer.ask("connectors") == {}


def test_services_of_ours_are_joined_here(system: Served, base: Any, bumper: RtComponent) -> None:
    ports = [
        system.service(f"{name}.BumpRefHard") for name in ("RefHardRh30", "CollisionDetection0")
    ]
    assert system.connect(*ports)[0] == "RTC_OK"
    system.manager.activate("CollisionDetection0")
    system.until(lambda: base._stopped)
    found = [system.do(port.get_connector_profiles) for port in ports]
    assert [len(profiles) for profiles in found] == [1, 1]
