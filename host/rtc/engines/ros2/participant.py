"""Our participant in a domain of DDS: what it writes and reads, and what it hears of others."""

from __future__ import annotations

import socket
from typing import Any, Final

from cyclonedds.core import DDSException, Listener
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from tickrig.host.rtc.engines.ros2.dds_log import DdsLog
from tickrig.host.rtc.engines.ros2.message_types import message_type
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry

LOOPBACK: Final = "127.0.0.1"
MOST_PARTICIPANTS: Final = 32
"""On loopback nobody can call all: so many are looked for, as ROS 2 does."""

HISTORY: Final = 10

_CONFIGURATION: Final = """\
<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface {interface}/></Interfaces></General>
<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>
<Discovery>{discovery}</Discovery>
{log}
</Domain></CycloneDDS>"""
"""1.15 is Fast DDS: its type information of what has arrays does not match that of Cyclone."""

_PEERS: Final = (
    "<ParticipantIndex>auto</ParticipantIndex>"
    f"<MaxAutoParticipantIndex>{MOST_PARTICIPANTS}</MaxAutoParticipantIndex>"
    f'<Peers><Peer Address="{LOOPBACK}"/></Peers>'
)


class Participant:
    """Takes part in a domain until it is closed.

    Args:
        domain: 0..232.
        interface: of the machine, such as eth0; loopback if empty.

    Raises:
        ValueError: no such interface, or it cannot be used.
    """

    def __init__(self, domain: int, interface: str = "") -> None:
        self._topics: dict[str, Topic[Any]] = {}
        place, discovery = _place(interface)
        self._log = DdsLog()
        configuration = _CONFIGURATION.format(
            interface=place, discovery=discovery, log=self._log.configuration
        )
        try:
            self._domain: Any = Domain(domain, configuration)
            self.entity: Any = DomainParticipant(domain)
        except DDSException as error:
            self._log.close()
            where = f"domain {domain} on {interface or 'loopback'}"
            raise ValueError(f"{where} cannot be joined: {reason_of(error)}") from None

    def writer(self, entry: TopicEntry) -> Any:
        """Return a new DataWriter of a topic; DDSException if there can be none."""
        return DataWriter(self.entity, self._topic(entry), qos=qos_of(entry))

    def reader(self, entry: TopicEntry, listener: Listener) -> Any:
        """Return a new DataReader of a topic; DDSException if there can be none."""
        topic = self._topic(entry)
        return DataReader(self.entity, topic, qos=qos_of(entry), listener=listener)

    def close(self) -> None:
        """Leave the domain; peers learn of it at once."""
        self._topics.clear()
        self.entity = self._domain = None
        self._log.close()

    def _topic(self, entry: TopicEntry) -> Topic[Any]:
        name = dds_topic(entry.topic)
        if name not in self._topics:
            self._topics[name] = Topic(self.entity, name, message_type(entry.type))
        return self._topics[name]


def dds_topic(name: str) -> str:
    """Return how DDS calls a topic of ROS 2."""
    return f"rt/{name}"


def qos_of(entry: TopicEntry) -> Qos:
    """Return what is offered and asked for; a peer that takes nothing holds up nobody."""
    reliability = (
        Policy.Reliability.Reliable(0) if entry.reliable else Policy.Reliability.BestEffort
    )
    return Qos(
        reliability,
        Policy.Durability.Volatile,
        Policy.History.KeepLast(HISTORY),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )


def reason_of(error: DDSException) -> str:
    """Return what DDS says, without the names of its code."""
    return str(error).partition("]")[2].strip() or str(error)


def _place(interface: str) -> tuple[str, str]:
    """Return the interface and what is to be known of peers, as the configuration has them."""
    if not interface:
        return f'address="{LOOPBACK}" multicast="false"', _PEERS
    known = [name for _, name in socket.if_nameindex()]
    if interface not in known:
        raise ValueError(f"interface {interface!r} is none of this machine: {', '.join(known)}")
    return f'name="{interface}"', ""
