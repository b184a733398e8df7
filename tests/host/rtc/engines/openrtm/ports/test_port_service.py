"""Ports as tools and peers see them: profiles, connecting, the end of connectors."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
from omniORB import any as omni_any

from tests.host.rtc.engines.openrtm.ports.foreign import Peer, Served
from tickrig.host.rtc.engines.openrtm.connector_ends import texts
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.wire.rtc_types.rtc import TimedLong

OK = "RTC_OK"


def profile_of(system: Served, name: str) -> Any:
    return system.do(system.service(name).get_port_profile)


def ids(system: Served, name: str) -> list[str]:
    found = system.do(system.service(name).get_connector_profiles)
    return [profile.connector_id for profile in found]


def test_a_port_says_what_it_is(system: Served) -> None:
    out, in_ = (profile_of(system, name) for name in ("ConsoleIn0.out", "ConsoleOut0.in"))
    assert (out.name, out.interfaces, out.connector_profiles) == ("ConsoleIn0.out", [], [])
    assert out.port_ref._is_equivalent(system.service("ConsoleIn0.out"))
    assert texts(out.properties) == {
        "port.port_type": "DataOutPort",
        "dataport.data_type": "IDL:RTC/TimedLong:1.0",
        "dataport.dataflow_type": "push,pull",
        "dataport.interface_type": "corba_cdr,direct",
        "dataport.subscription_type": "flush,new,periodic",
    }
    assert texts(in_.properties)["port.port_type"] == "DataInPort"
    assert texts(in_.properties)["dataport.subscription_type"] == "Any"


def test_a_component_lists_its_ports_as_they_are(system: Served) -> None:
    ports, component = system.served["ConsoleIn0"], system.console_in
    assert system.do(ports.services) == [system.service("ConsoleIn0.out")]
    more = component.add_port(InPort("more", TimedLong))
    reference = system.do(ports.services)[1]
    assert system.do(reference.get_port_profile).name == "ConsoleIn0.more"
    component.remove_port(more)
    assert len(system.do(ports.services)) == 1
    assert system.do(reference._non_existent)


def test_two_ports_of_ours_are_joined_here(system: Served) -> None:
    ports = system.service("ConsoleIn0.out"), system.service("ConsoleOut0.in")
    code, profile = system.connect(*ports, dataport__subscription_type="new")
    assert (code, len(profile.connector_id)) == (OK, 36)
    system.console_in.enter(5)
    system.until(lambda: system.numbers == [5])
    for name in ("ConsoleIn0.out", "ConsoleOut0.in"):
        (found,) = profile_of(system, name).connector_profiles
        assert found.connector_id == profile.connector_id
        assert [one._is_equivalent(two) for one, two in zip(found.ports, ports, strict=True)] == [
            True,
            True,
        ]
        assert texts(found.properties)["dataport.subscription_type"] == "new"
    assert system.connect(*ports)[0] == "PRECONDITION_NOT_MET"
    assert str(system.do(lambda: ports[1].disconnect(profile.connector_id))) == OK
    assert ids(system, "ConsoleIn0.out") == []


def test_a_connector_of_probes_is_not_shown(system: Served) -> None:
    connect(system.manager.port("ConsoleIn0.out"), InPort("probe", TimedLong))
    assert ids(system, "ConsoleIn0.out") == []


def test_what_a_string_cannot_carry_hides_no_connector(system: Served) -> None:
    out, in_ = (system.manager.port(name) for name in ("ConsoleIn0.out", "ConsoleOut0.in"))
    connect(out, in_, {"note": "a\0b", "half\ud800": "c"}, name="d\0e")
    (found,) = profile_of(system, "ConsoleIn0.out").connector_profiles
    assert found.name == "d\ufffde"
    assert texts(found.properties)["note"] == "a\ufffdb"
    assert texts(found.properties)["half\ufffd"] == "c"


def test_properties_that_are_unknown_pass_unchanged(system: Served, peer: Peer) -> None:
    ports = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    profile = system.profile(*ports, connector_id="a", x__y="kept")
    profile.properties.append(stubs().sdo.NameValue("n", omni_any.to_any(5)))
    code, profile = system.do(lambda: ports[0].connect(profile))
    assert str(code) == OK
    told = peer.ask("properties", "a")["in"]
    assert (told["x.y"], told["n"]) == ("kept", 5)
    assert told["dataport.serializer.cdr.endian"] == "little,big"
    (shown,) = profile_of(system, "ConsoleIn0.out").connector_profiles
    assert texts(shown.properties)["n"] == "5"
    assert texts(shown.properties)["dataport.corba_cdr.inport_ior"].startswith("IOR:")


@pytest.mark.parametrize("first", ["ours", "theirs"])
@pytest.mark.parametrize("asked", ["ours", "theirs"])
def test_either_side_may_end_a_connector(
    system: Served, peer: Peer, first: str, asked: str
) -> None:
    ours, theirs = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    ports = [ours, theirs] if first == "ours" else [theirs, ours]
    assert system.connect(*ports, connector_id="a")[0] == OK
    end = ours if asked == "ours" else theirs
    assert str(system.do(lambda: end.disconnect("a"))) == OK
    assert peer.ask("connectors") == {}
    assert (ids(system, "ConsoleIn0.out"), system.console_in.out.connectors) == ([], ())
    assert system.connect(*ports, connector_id="a")[0] == OK


@pytest.mark.parametrize("first", ["ours", "theirs"])
def test_a_peer_is_told_when_a_component_ends(system: Served, peer: Peer, first: str) -> None:
    ports = [system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])]
    if first == "theirs":
        ports.reverse()
    assert system.connect(*ports, connector_id="a")[0] == OK
    system.manager.delete("ConsoleIn0")
    system.until(lambda: peer.ask("connectors") == {})


def test_the_peers_are_told_when_a_system_ends(system: Served, peer: Peer) -> None:
    ports = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    assert system.connect(*ports, connector_id="a")[0] == OK
    system.do(system.served.pop("ConsoleIn0").close)
    system.until(lambda: peer.ask("connectors") == {})


@pytest.mark.parametrize("first", ["ours", "theirs"])
def test_a_peer_that_is_gone_does_not_keep_a_connector(
    system: Served, peer: Peer, first: str
) -> None:
    ports = [system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])]
    if first == "theirs":
        ports.reverse()
    assert system.connect(*ports, connector_id="a")[0] == OK
    peer.kill()
    assert str(system.do(lambda: system.service("ConsoleIn0.out").disconnect("a"))) == OK
    assert ids(system, "ConsoleIn0.out") == []


def test_all_connectors_of_a_port_end(system: Served, peer: Peer) -> None:
    out = system.service("ConsoleIn0.out")
    assert system.connect(out, system.reference(peer.iors["in"]))[0] == OK
    assert system.connect(out, system.service("ConsoleOut0.in"))[0] == OK
    assert len(ids(system, "ConsoleIn0.out")) == 2
    assert str(system.do(out.disconnect_all)) == OK
    assert (ids(system, "ConsoleIn0.out"), peer.ask("connectors")) == ([], {})


def test_a_connector_is_looked_up_by_its_id(system: Served) -> None:
    out = system.service("ConsoleIn0.out")
    system.connect(out, system.service("ConsoleOut0.in"), connector_id="a")
    assert system.do(lambda: out.get_connector_profile("a")).connector_id == "a"
    assert system.do(lambda: out.get_connector_profile("b")).connector_id == ""


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"interface_type": "direct"}, "dataport.interface_type: 'direct' is not corba_cdr"),
        (
            {"data_type": "IDL:RTC/TimedShort:1.0"},
            "dataport.data_type: 'IDL:RTC/TimedShort:1.0' is not IDL:RTC/TimedLong:1.0",
        ),
        (
            {"serializer.cdr.endian": "middle"},
            "dataport.serializer.cdr.endian: 'middle' is not one of: little, big",
        ),
        (
            {"dataflow_type": "sideways"},
            "dataport.dataflow_type: 'sideways' is not one of: push, pull",
        ),
        ({"buffer.length": "0"}, "dataport.inport.buffer: buffer length 0 is not in 1..1000000"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(
    system: Served,
    peer: Peer,
    values: dict[str, str],
    reason: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    keys = {f"dataport.{key}": text for key, text in values.items()}
    ports = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    assert system.connect(*ports, **keys)[0] == "BAD_PARAMETER"
    (record,) = caplog.records
    assert record.getMessage() == f"ConsoleIn0.out is not connected: {reason}"


def test_ports_that_are_none_or_too_many_are_refused(system: Served, peer: Peer) -> None:
    out, in_ = system.service("ConsoleIn0.out"), system.service("ConsoleOut0.in")
    theirs = system.reference(peer.iors["in"])
    for ports in ((out,), (out, in_, theirs), (out, None), (out, out)):
        assert system.connect(*ports)[0] == "BAD_PARAMETER"
    for some in ((), (None, out)):
        connect_to = partial(out.connect, system.profile(*some))
        assert str(system.do(connect_to)[0]) == "BAD_PARAMETER"
    foreign = system.profile(in_, theirs, connector_id="a")
    assert str(system.do(lambda: out.notify_connect(foreign))[0]) == "BAD_PARAMETER"
    nameless = system.profile(out, theirs)
    assert str(system.do(lambda: out.notify_connect(nameless))[0]) == "BAD_PARAMETER"
    assert str(system.do(lambda: out.disconnect("nobody's"))) == "BAD_PARAMETER"
    assert str(system.do(lambda: out.notify_disconnect("nobody's"))) == "BAD_PARAMETER"
    assert system.console_in.out.connectors == ()


def test_a_second_connector_is_refused(system: Served, peer: Peer) -> None:
    ports = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    assert system.connect(*ports, connector_id="a")[0] == OK
    assert system.connect(*ports, connector_id="b")[0] == "PRECONDITION_NOT_MET"
    other = system.service("ConsoleIn0.out"), system.service("ConsoleOut0.in")
    assert system.connect(*other, connector_id="a")[0] == "PRECONDITION_NOT_MET"
    assert ids(system, "ConsoleIn0.out") == ["a"]


def test_a_peer_that_is_not_there_costs_a_line(
    system: Served, peer: Peer, caplog: pytest.LogCaptureFixture
) -> None:
    out, theirs = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    peer.kill()
    assert system.connect(out, theirs)[0] == "RTC_ERROR"
    (record,) = caplog.records
    assert record.getMessage() == "ConsoleIn0.out is not connected: the peer: not reachable"
    assert system.console_in.out.connectors == ()
