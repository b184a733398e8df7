"""The end of a connector that is at a peer, and what passes between."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import Any, Final, Generic, TypeVar

from tickrig.host.rtc.ports.connect import refuse_known_id
from tickrig.host.rtc.ports.connector import ConnectorOptions
from tickrig.host.rtc.ports.data_port import DataPort, InPort
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.states import PortStatus
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.cdr import Endian, decode, encode
from tickrig.wire.rtc_types.idl import Struct

# Whether the peer of a connector answers.

_LOG: Final = log_of(__name__)


class PeerState(StrEnum):
    """What is known of a peer."""

    CONNECTED = "connected"  # it answered the latest call, or none was made
    LOST = "lost"  # the latest call had no answer


class PeerWatch:
    """Notes how each call into a peer ended; a peer that goes or comes back is logged in a line.

    One thread notes, any thread looks.

    Args:
        who: the connector, for people.

    Attributes:
        state: of the peer.
        status: what the latest call gave; CONNECTION_LOST without an answer.
    """

    def __init__(self, who: str) -> None:
        self._who, self._lost_s = who, 0.0
        self.state, self.status = PeerState.CONNECTED, PortStatus.PORT_OK

    def answered(self, status: PortStatus) -> None:
        """Note an answer."""
        if self.state is PeerState.LOST:
            gone_s = time.monotonic() - self._lost_s
            _LOG.warning("%s: the peer answers again, after %.1f s", self._who, gone_s)
        self.state, self.status = PeerState.CONNECTED, status

    def unanswered(self, error: Exception) -> None:
        """Note that there was no answer, and why."""
        if self.state is PeerState.CONNECTED:
            reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
            _LOG.warning("%s: the peer does not answer: %s", self._who, reason)
            self._lost_s = time.monotonic()
        self.state, self.status = PeerState.LOST, PortStatus.CONNECTION_LOST


T = TypeVar("T", bound=Struct)
P = TypeVar("P")

_SEND_LENGTH: Final = "64"
"""Values that wait for a peer, if the properties do not say how many."""


@dataclass(frozen=True, slots=True)
class Codec(Generic[T, P]):
    """How values of a port pass to a peer and back: as bytes, or as messages of an engine.

    Attributes:
        encode: makes what passes of a value; ValueError if that cannot be.
        decode: makes a value of what passed; ValueError if it is none.
    """

    encode: Callable[[T], P]
    decode: Callable[[P], T]


def cdr(data_type: type[T], endian: Endian = Endian.LITTLE) -> Codec[T, bytes]:
    """Return the codec for plain CDR."""
    return Codec(partial(encode, endian=endian), partial(decode, data_type, endian=endian))


@dataclass(frozen=True, slots=True)
class PeerEnd:
    """What is agreed about a connector with a peer.

    Attributes:
        port: how the peer's port is called, such as `other/ConsoleOut0.rtc:in`.
        connector_id: unique here.
        properties: `dataport.*`, as `ConnectorOptions.parse` takes them; others are kept.
        name: for people; the ID if left out.
    """

    port: str
    connector_id: str
    properties: Mapping[str, str] = field(default_factory=dict)
    name: str = ""

    @property
    def options(self) -> ConnectorOptions:
        """What the properties say; RtcRefused if they cannot be."""
        lengths = {"dataport.buffer.length", "dataport.outport.buffer.length"}
        if lengths.isdisjoint(self.properties):
            return ConnectorOptions.parse(
                {**self.properties, "dataport.outport.buffer.length": _SEND_LENGTH}
            )
        return ConnectorOptions.parse(self.properties)

    def profile(self, port: DataPort[Any]) -> ConnectorProfile:
        """Return how the connector with a port of ours is described.

        Raises:
            RtcRefused: the port has a connector of this ID.
        """
        refuse_known_id(port, self.connector_id)
        data_type = {"dataport.data_type": port.data_type.idl_id()}
        properties = {**data_type, **self.options.stated, **self.properties}
        ends = (port.full_name, self.port)
        if isinstance(port, InPort):
            ends = (self.port, port.full_name)
        return ConnectorProfile(self.name or self.connector_id, self.connector_id, ends, properties)
