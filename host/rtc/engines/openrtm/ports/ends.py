"""Our end of a connector with a peer: what it tells the peer, and what it needs of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.port import ConnectorBase
from tickrig.host.rtc.remote.call_queue import CallQueue
from tickrig.host.rtc.remote.peer_end import PeerEnd
from tickrig.host.rtc.remote.peer_thread import PeerThread
from tickrig.host.rtc.remote.peer_threads import PeerThreads
from tickrig.host.rtc.states import RtcRefused


@dataclass(frozen=True, slots=True)
class Place:
    """Where a connector is made.

    Attributes:
        orb: of this process.
        calls: those of the manager's thread.
        threads: call peers, for all data ports.
        post: has a call made there before the next tick.
        connector_id: of the connector.
        name: of the connector, for people.
        peer: the peer's port, for people.
    """

    orb: Orb
    calls: CallQueue
    threads: PeerThreads
    post: Callable[[Callable[[], object]], object]
    connector_id: str
    name: str
    peer: str

    def end(self, properties: dict[str, str]) -> PeerEnd:
        """Return the peer's end with the properties that hold."""
        return PeerEnd(self.peer, self.connector_id, properties, self.name)


class End(ABC):
    """Our end of a connector; all this is in the manager's thread.

    Attributes:
        thread: calls the peer, one call after the other; None as long as nobody does.
    """

    def __init__(self, place: Place) -> None:
        self._place = place
        self._served: list[Reference] = []
        self.thread: PeerThread | None = None

    @abstractmethod
    def publish(self, values: dict[str, str]) -> dict[str, str]:
        """Serve what the peer is to call.

        Args:
            values: properties of the connector.

        Returns:
            Properties that lead the peer there.

        Raises:
            RtcRefused: the properties cannot be.
        """

    @abstractmethod
    def join(self, values: dict[str, str]) -> ConnectorBase:
        """Take what is to be called at the peer, who is not called yet, and join the connector.

        Args:
            values: properties of the connector, with those of the peer.

        Raises:
            RtcRefused: they cannot be.
        """

    def close(self) -> None:
        """Serve nobody any more."""
        for reference in self._served:
            self._place.orb.withdraw(reference)
        self._served.clear()

    def calling_thread(self) -> PeerThread:
        """Return the thread that calls the peer."""
        if self.thread is None:
            self.thread = PeerThread(self._place.peer)
        return self.thread

    def serve(self, interface: str, answers: object) -> str:
        """Serve an object until the end; return its IOR."""
        self._served.append(self._place.orb.serve(stubs().skeleton(interface), answers))
        return self._place.orb.text(self._served[-1])

    def reference(self, ior: str, kind: Any) -> Reference:
        """Return the reference that an IOR stands for, as one of an interface.

        The peer is not asked whether it has this interface: it says so in the IOR, and who lies
        answers its first call with an error.

        Raises:
            RtcRefused: it is no reference.
        """
        try:
            found = self._place.orb.reference(ior)
        except ValueError as error:
            raise RtcRefused(str(error)) from error
        if found is None:
            raise RtcRefused("the peer gives no reference")
        return found._unchecked_narrow(kind)
