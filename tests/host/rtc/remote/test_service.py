"""A service of another system: called by bytes, in the thread of the peer."""

from __future__ import annotations

import threading
from typing import Protocol

from tests.host.rtc.remote.engine import Engine, Pair, Reference
from tickrig.host.rtc import Consumer, Provider, RtComponent, ServicePort, connect
from tickrig.host.rtc.component import ModuleSpec


class RefHard(Protocol):
    def stop(self, why: int) -> None: ...


class Cart(RtComponent):
    """Provides RefHard."""

    spec = ModuleSpec("Cart")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.stops: list[tuple[int, int]] = []
        port = self.add_port(ServicePort("service"))
        port.provide(Provider[RefHard]("refhard", "RefHard", self))

    def stop(self, why: int) -> None:
        self.stops.append((why, threading.get_ident()))


class Bumper(RtComponent):
    """Calls RefHard."""

    spec = ModuleSpec("Bumper")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        port = self.add_port(ServicePort("service"))
        self.ref_hard = port.require(Consumer[RefHard]("refhard", "RefHard"))


class Stub:
    """RefHard of a peer: a call returns at once, and is made in the thread of the peer."""

    def __init__(self, engine: Engine, reference: Reference) -> None:
        self._engine, self._reference = engine, reference

    def stop(self, why: int) -> None:
        def call() -> None:
            assert self._reference.request(bytes([why])) == b"\0"

        self._engine.thread.submit(call)


def answer(engine: Engine, port: ServicePort, message: bytes) -> bytes:
    """Carry a call out, in the thread of the manager."""
    (provider,) = port.providers
    engine.calls.call(lambda: provider.servant.stop(message[0]))
    return b"\0"


def test_a_service_is_called_in_the_thread_of_its_manager(pair: Pair) -> None:
    cart, bumper = pair.far.manager.add(Cart("Cart0")), pair.near.manager.add(Bumper("Bumper0"))
    provided, required = cart.ports["service"], bumper.ports["service"]
    assert isinstance(provided, ServicePort)
    servant = pair.far.serve(lambda message: answer(pair.far, provided, message))
    shadow = ServicePort("far/Cart0.rtc:service")
    stub: RefHard = Stub(pair.near, pair.near.refer(servant))
    shadow.provide(Provider[RefHard]("refhard", "RefHard", stub))
    connector = connect(required, shadow, connector_id="9c1f")
    assert connector.profile.ports == ("Bumper0.service", "far/Cart0.rtc:service")
    assert pair.near.manager.connectors == ()
    bumper.ref_hard.service.stop(3)
    assert cart.stops == []
    pair.until(lambda: cart.stops)
    assert cart.stops == [(3, threading.get_ident())]
    connector.end()
    assert not bumper.ref_hard.connected
