"""Our end of a connector of service ports: calls both ways (OpenRTM-aist 1.x, CorbaPort)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Final

from omniORB import CORBA

from tickrig.host.rtc.engines.openrtm.orb import Reference, explain
from tickrig.host.rtc.engines.openrtm.ports.cdr import NoAnswerError
from tickrig.host.rtc.engines.openrtm.ports.ends import End, Place
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ports.port import ConnectorBase, InterfaceProfile
from tickrig.host.rtc.ports.service_port import Consumer, Provider, ServicePort
from tickrig.host.rtc.remote.call_queue import CallQueue
from tickrig.host.rtc.remote.peer_state import PeerWatch
from tickrig.host.rtc.remote.peer_thread import PeerThread
from tickrig.host.rtc.states import PortStatus

OPERATIONS: Final[Mapping[str, tuple[str, ...]]] = {"RefHard": ("Go", "Stop")}
"""Interface types of our IDL: operations without arguments and without a result."""


class ServiceEnd(End):
    """The end of a connector of service ports.

    A call of a peer is carried out in the manager's thread. A call of ours returns at once and
    is made in the thread of the peer; one that has no answer is a line in the log and not
    made again.

    Not there: interfaces whose operations have arguments or results.

    Args:
        place: where it is.
        port: of ours.
    """

    def __init__(self, place: Place, port: ServicePort) -> None:
        super().__init__(place)
        self._port = port

    def publish(self, values: dict[str, str]) -> dict[str, str]:
        """Serve what our port provides, under the names that OpenRTM 1.0 and later look for."""
        found: dict[str, str] = {}
        for provider in self._port.providers:
            if (operations := OPERATIONS.get(provider.profile.type_name)) is not None:
                answers = _Answers(provider.servant, operations, self._place.calls)
                ior = self.serve(provider.profile.type_name, answers)
                found[self._name("provided", provider.profile)] = ior
                found[_old_name(provider.profile)] = ior
        return found

    def join(self, values: dict[str, str]) -> ConnectorBase:
        """Join a port that stands for the peer's: it provides what was published, and calls."""
        peer = ServicePort(self._place.peer)
        for provider in self._port.providers:
            wanted = provider.profile
            peer.require(Consumer[Any](wanted.instance_name, wanted.type_name))
        for consumer in self._port.consumers:
            wanted = consumer.profile
            if wanted.type_name in OPERATIONS and (ior := self._ior(wanted, values)):
                calls = self._calls(self.reference(ior, _interface(wanted.type_name)), wanted)
                peer.provide(Provider[Any](wanted.instance_name, wanted.type_name, calls))
        names = {"name": self._place.name, "connector_id": self._place.connector_id}
        return connect(self._port, peer, values, **names)

    def _calls(self, reference: Reference, wanted: InterfaceProfile) -> object:
        watch = PeerWatch(f"{self._port.full_name} to {self._place.peer}")
        return _Calls(reference, OPERATIONS[wanted.type_name], self.calling_thread(), watch)

    def _ior(self, wanted: InterfaceProfile, values: dict[str, str]) -> str:
        """Return the reference for an interface that our port requires, empty without one."""
        for text in self._candidates(wanted, values):
            if text and text not in {"null", "nil"}:
                return text
        return ""

    def _candidates(self, wanted: InterfaceProfile, values: dict[str, str]) -> Iterator[str]:
        mapped = values.get(self._name("required", wanted), "")  # what a tool mapped it to
        yield values.get(mapped, "")
        yield values.get(_old_name(wanted), "")
        kind = f".provided.{wanted.type_name}."
        yield from (text for name, text in values.items() if kind in name)

    def _name(self, polarity: str, interface: InterfaceProfile) -> str:
        port, kind = self._port, f"{interface.type_name}.{interface.instance_name}"
        return f"{port.owner}.port.{port.name}.{polarity}.{kind}"


class _Answers:
    """Carries operations out in the manager's thread."""

    def __init__(self, servant: object, operations: tuple[str, ...], calls: CallQueue) -> None:
        for name in operations:
            setattr(self, name, partial(calls.call, getattr(servant, name)))


class _Calls:
    """Makes operations calls into a peer, in its thread."""

    def __init__(
        self,
        reference: Reference,
        operations: tuple[str, ...],
        thread: PeerThread,
        watch: PeerWatch,
    ) -> None:
        for name in operations:
            call = partial(_call, getattr(reference, name), watch)
            setattr(self, name, partial(thread.submit, call))


def _call(operation: Callable[[], None], watch: PeerWatch) -> None:
    """Call a peer, in its thread."""
    try:
        operation()
    except CORBA.SystemException as error:
        watch.unanswered(NoAnswerError(explain(error)))
    else:
        watch.answered(PortStatus.PORT_OK)


def _old_name(interface: InterfaceProfile) -> str:
    return f"port.{interface.type_name}.{interface.instance_name}"


def _interface(type_name: str) -> Any:
    return getattr(stubs().services, type_name)
