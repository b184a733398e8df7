from __future__ import annotations

from typing import Protocol

import pytest

from tickrig.host.rtc import Consumer, Provider, ReturnCode, RtcRefused, ServicePort, connect


class RefHard(Protocol):
    def stop(self) -> str: ...


class Cart:
    def __init__(self, name: str) -> None:
        self.name = name

    def stop(self) -> str:
        return f"{self.name} stops"


def provider(name: str, type_name: str = "RefHard") -> Provider[RefHard]:
    return Provider(name, type_name, Cart(name))


def ports() -> tuple[ServicePort, ServicePort, Consumer[RefHard]]:
    """Return a port with two carts, one that calls, and what it calls with."""
    carts, caller = ServicePort("carts"), ServicePort("caller")
    carts.provide(provider("first"))
    carts.provide(provider("second"))
    return carts, caller, caller.require(Consumer[RefHard]("second", "RefHard"))


def test_a_consumer_calls_the_provider_of_its_name() -> None:
    carts, caller, consumer = ports()
    connect(caller, carts)
    assert consumer.connected
    assert consumer.service.stop() == "second stops"


def test_a_consumer_without_a_provider_of_its_name_takes_the_first_of_its_type() -> None:
    carts, caller, _ = ports()
    other = caller.require(Consumer[RefHard]("other", "RefHard"))
    connect(carts, caller)
    assert other.service.stop() == "first stops"


def test_both_ports_may_provide_and_require() -> None:
    carts, caller, consumer = ports()
    back = carts.require(Consumer[RefHard]("back", "Back"))
    caller.provide(provider("behind", "Back"))
    connect(carts, caller)
    assert (back.service.stop(), consumer.service.stop()) == ("behind stops", "second stops")


def test_a_call_without_a_provider_is_refused() -> None:
    carts, caller, consumer = ports()
    with pytest.raises(RtcRefused, match="second is not connected") as refused:
        _ = consumer.service
    assert refused.value.code is ReturnCode.PRECONDITION_NOT_MET
    connector = connect(carts, caller)
    connector.end()
    connector.end()
    assert not consumer.connected


def test_an_old_connector_ended_twice_does_not_take_a_new_provider_away() -> None:
    carts, caller, consumer = ports()
    old = connect(carts, caller)
    old.end()
    connect(carts, caller)
    old.end()
    assert consumer.connected


def test_a_consumer_that_is_served_keeps_its_provider() -> None:
    carts, caller, consumer = ports()
    connect(carts, caller)
    other = ServicePort("other")
    other.provide(provider("second"))
    with pytest.raises(RtcRefused, match="no interface"):
        connect(other, caller)
    assert consumer.connected


def test_ports_without_a_common_interface_are_not_connected() -> None:
    carts, _, _ = ports()
    stranger = ServicePort("stranger")
    stranger.require(Consumer[RefHard]("second", "Other"))
    with pytest.raises(RtcRefused, match="carts and stranger share no interface type"):
        connect(carts, stranger)


def test_a_profile_lists_the_interfaces() -> None:
    carts, caller, _ = ports()
    assert carts.profile.properties == {"port.port_type": "CorbaPort"}
    found = [(i.instance_name, i.type_name, i.polarity) for i in caller.profile.interfaces]
    assert found == [("second", "RefHard", "REQUIRED")]
    assert [i.polarity for i in carts.profile.interfaces] == ["PROVIDED", "PROVIDED"]
