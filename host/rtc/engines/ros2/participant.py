"""The local participant in a domain of DDS, with its writers and readers, and its view of peers."""

from __future__ import annotations

import os
import re
import socket
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Protocol

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import DDSException, InstanceState, Listener
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import load_cyclonedds
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from tickrig.host.rtc.engines.ros2.message_types import dds_name, message_type, ros_name
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry
from tickrig.host.text.log import log_of

# Log messages of Cyclone DDS, which would write a line to standard error for each message.

_FATAL: Final = 1
"""Log category for messages on standard error (dds/ddsrt/log.h)."""

_MOST_MESSAGES: Final = 100
"""Number of kinds of messages that are logged. Further kinds are not logged."""

_DESCRIPTORS: Final = "/dev/fd"
_LOG: Final = log_of(__name__)
_NUMBER: Final = re.compile(r"(?<![0-9a-f])(?=[a-f]*+[0-9])[0-9a-f]++")
_HEAD: Final = re.compile(r"^[\d.]+ \[[^]]*\] +\S* *")


class _DdsLog:
    """A log that reads lines of DDS from a pipe until it is closed.

    Each kind of line is logged once.

    Lines of a kind differ only in numbers. Writers do not wait. Lines that do not fit into the pipe
    are lost.

    Attributes:
        configuration: configuration that makes DDS write into the pipe, or an empty text on systems
            where pipes have no names.
    """

    def __init__(self) -> None:
        reader, self._writer = os.pipe()
        self.configuration = ""
        if sys.platform != "win32" and Path(_DESCRIPTORS).is_dir():
            os.set_blocking(self._writer, False)
            place = f"{_DESCRIPTORS}/{self._writer}"
            self.configuration = (
                f"<Tracing><Category>warning</Category><OutputFile>{place}</OutputFile></Tracing>"
            )
        library: Any = load_cyclonedds()
        library.dds_set_log_mask(_FATAL)
        self._thread = threading.Thread(target=_read, args=(reader,), name="ros2 log", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the log after DDS has closed the pipe."""
        os.close(self._writer)


def _read(descriptor: int) -> None:
    known = set[str]()
    with open(descriptor, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            text = _HEAD.sub("", line.strip())
            kind = _NUMBER.sub("#", text)
            if kind not in known and len(known) < _MOST_MESSAGES:
                known.add(kind)
                _LOG.warning("ros2: DDS says: %s", text)


_LOOPBACK: Final = "127.0.0.1"
_MOST_PARTICIPANTS: Final = 32
"""Number of participants that are searched, as in ROS 2, because loopback has no multicast."""

HISTORY: Final = 10

_CONFIGURATION: Final = """\
<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface {interface}/></Interfaces></General>
<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>
<Discovery>{discovery}</Discovery>
{log}
</Domain></CycloneDDS>"""
"""Configuration of DDS. 1.15 is Fast DDS.

Type information of Fast DDS on types with arrays does not match that of Cyclone.
"""

_PEERS: Final = (
    "<ParticipantIndex>auto</ParticipantIndex>"
    f"<MaxAutoParticipantIndex>{_MOST_PARTICIPANTS}</MaxAutoParticipantIndex>"
    f'<Peers><Peer Address="{_LOOPBACK}"/></Peers>'
)


class DdsParticipant:
    """Participant in a DDS domain, by which the engine reads and writes ROS 2 topics.

    Args:
        domain: number of the DDS domain, 0..232.
        interface: network interface of the machine, such as eth0. If it is empty, loopback is used.

    Raises:
        ValueError: the network interface does not exist, or cannot be used.
    """

    def __init__(self, domain: int, interface: str = "") -> None:
        self._topics: dict[str, Topic[Any]] = {}
        place, discovery = _place(interface)
        self._log = _DdsLog()
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
        """Return a new DataWriter of a topic. Raise DDSException if that is impossible."""
        return DataWriter(self.entity, self._topic(entry), qos=_qos_of(entry))

    def reader(self, entry: TopicEntry, listener: Listener) -> Any:
        """Return a new DataReader of a topic. Raise DDSException if that is impossible."""
        topic = self._topic(entry)
        return DataReader(self.entity, topic, qos=_qos_of(entry), listener=listener)

    def close(self) -> None:
        """Leave the domain. Peers are notified at once."""
        self._topics.clear()
        self.entity = self._domain = None
        self._log.close()

    def _topic(self, entry: TopicEntry) -> Topic[Any]:
        name = dds_topic(entry.topic)
        if name not in self._topics:
            self._topics[name] = Topic(self.entity, name, message_type(entry.type))
        return self._topics[name]


def dds_topic(name: str) -> str:
    """Return the DDS name of a ROS 2 topic."""
    return f"rt/{name}"


def _qos_of(entry: TopicEntry) -> Qos:
    """Return the QoS of readers and writers.

    A peer that does not accept data delays no other peer.
    """
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
    """Return the reason of a DDS exception as text, without the error code before it."""
    return str(error).partition("]")[2].strip() or str(error)


def _place(interface: str) -> tuple[str, str]:
    """Return the settings of the interface and of peers in the configuration."""
    if not interface:
        return f'address="{_LOOPBACK}" multicast="false"', _PEERS
    known = [name for _, name in socket.if_nameindex()]
    if interface not in known:
        raise ValueError(f"interface {interface!r} does not exist here: {', '.join(known)}")
    return f'name="{interface}"', ""


# Other writers and readers of our topics, and incompatible ones among them.

_LOOK_S: Final = 0.5
MATCH_S: Final = 5.0
"""Longest time until a peer that seems to fit is matched."""

_MOST: Final = 1_000

_INFINITE_NS: Final = 0x7FFF_FFFF_FFFF_FFFF

_UNSIGNED: Final = 0xFFFF_FFFF_FFFF_FFFF
"""Mask for handles of 64 bits, which Cyclone DDS's Python returns with or without a sign."""


class OwnEndpoint(Protocol):
    """Writer or reader of a topic in this process, as the participant sees it.

    The participant compares each such endpoint with the matching endpoints in other processes.

    Attributes:
        entry: port and topic that the endpoint connects.
    """

    @property
    def entry(self) -> TopicEntry:
        """Port and topic of the endpoint."""
        ...

    def matched(self) -> list[int]:
        """Return the instance handles of the matched peers."""
        ...


_Endpoints = Mapping[str, OwnEndpoint]
"""Endpoints by the DDS name of their topic."""


class ForeignEndpoints:
    """Logs which writers or readers of other processes do not fit a local topic, and why.

    Args:
        participant: participant in the DDS domain.
        writing: writers of this process by DDS name of the topic. The mapping may change later.
        reading: readers of this process by DDS name of the topic. The mapping may change later.
    """

    def __init__(
        self, participant: DdsParticipant, writing: _Endpoints, reading: _Endpoints
    ) -> None:
        self._sides: tuple[tuple[Any, _Endpoints, bool], ...] = (
            (BuiltinDataReader(participant.entity, BuiltinTopicDcpsSubscription), writing, True),
            (BuiltinDataReader(participant.entity, BuiltinTopicDcpsPublication), reading, False),
        )
        self._warned = set[str]()
        self._awaited: dict[int, tuple[float, OwnEndpoint, str]] = {}

    def look(self) -> float | None:
        """Log new peers. Return the time until the next call, in s."""
        for reader, ours, reads in self._sides:
            try:
                endpoints = reader.take(_MOST)
            except DDSException:  # the participant has gone
                return None
            for endpoint in endpoints:
                handle = endpoint.sample_info.instance_handle
                self._awaited.pop(handle, None)
                alive = endpoint.sample_info.instance_state == InstanceState.Alive
                if alive and (own := ours.get(endpoint.topic_name or "")):
                    self._compare(handle, endpoint, own, reads=reads)
        self._look_for_unmatched()
        return _LOOK_S

    def close(self) -> None:
        """Stop watching."""
        self._sides = ()
        self._awaited.clear()

    def _compare(self, handle: int, endpoint: Any, own: OwnEndpoint, *, reads: bool) -> None:
        entry, reliable = own.entry, _is_reliable(endpoint.qos)
        does = f"a peer {'reads' if reads else 'writes'}"
        if endpoint.type_name != dds_name(entry.type):
            self._warn(f"{does} {ros_name(endpoint.type_name)} on {entry.topic}, not {entry.type}")
        elif reads and Policy.Durability.TransientLocal in endpoint.qos:
            self._warn(f"a reader of {entry.topic} wants what was sent before (transient local)")
        elif reads and reliable and not entry.reliable:
            self._warn(f"a reader of {entry.topic} wants it reliably: set reliable = true")
        elif not reads and entry.reliable and not reliable:
            self._warn(f"a writer of {entry.topic} does not send reliably: set reliable = false")
        elif policy := _refused_policy(endpoint.qos, reads=reads):
            does = f"a {'reader' if reads else 'writer'} of {entry.topic}"
            self._warn(f"{does} has a QoS policy that does not fit ours: {policy}")
        else:
            text = f"{does} {entry.type} with other fields on {entry.topic}"
            self._awaited[handle] = time.monotonic() + MATCH_S, own, text

    def _look_for_unmatched(self) -> None:
        """Log peers with a matching name that were not joined within the time limit."""
        for handle, (until_s, own, text) in tuple(self._awaited.items()):
            if time.monotonic() > until_s:
                del self._awaited[handle]
                if handle not in {matched & _UNSIGNED for matched in own.matched()}:
                    self._warn(text)

    def _warn(self, text: str) -> None:
        if text not in self._warned:
            self._warned.add(text)
            _LOG.warning("ros2: %s; it is not joined", text)


def _refused_policy(qos: Any, *, reads: bool) -> str:  # noqa: PLR0911 - a table
    """Return a peer's first incompatible policy with its value, empty if all are compatible.

    The local policies are the defaults of DDS: no deadline, automatic liveliness without a lease,
    shared ownership, order by reception (DDS 1.4, 2.2.3: requested and offered must be compatible).
    """
    for policy in qos:
        match policy:
            case Policy.Ownership.Exclusive:
                return "ownership exclusive"
            case Policy.Deadline(deadline=ns) if reads and ns < _INFINITE_NS:
                return f"deadline {ns / 1e6:g} ms"
            case Policy.DestinationOrder.BySourceTimestamp if reads:
                return "destination order by source timestamp"
            case Policy.Liveliness.Automatic(lease_duration=ns) if reads and ns < _INFINITE_NS:
                return f"liveliness automatic, lease {ns / 1e6:g} ms"
            case Policy.Liveliness.ManualByParticipant() if reads:
                return "liveliness manual by participant"
            case Policy.Liveliness.ManualByTopic() if reads:
                return "liveliness manual by topic"
    return ""


def _is_reliable(qos: Any) -> bool:
    return any(isinstance(policy, Policy.Reliability.Reliable) for policy in qos)
