"""Our participant in a domain of DDS: what it writes and reads, and what it hears of others."""

from __future__ import annotations

import os
import re
import socket
import sys
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any, Final, Protocol

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import DDSException, InstanceState, Listener
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import InvalidSample, load_cyclonedds
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from tickrig.host.rtc.engines.ros2.conversions import TopicEntry
from tickrig.host.rtc.engines.ros2.message_types import dds_name, message_type, ros_name
from tickrig.host.rtc.states import PortStatus
from tickrig.host.rtc.system.call_queue import PeerThread
from tickrig.host.text.log import log_of

# What Cyclone DDS has to say: it would write a line to standard error for each message.

_FATAL: Final = 1
"""Of the categories of its log (dds/ddsrt/log.h): what it writes to standard error."""

_MOST_MESSAGES: Final = 100
"""Kinds of lines that are known; of more nothing is said."""

_DESCRIPTORS: Final = "/dev/fd"
_DDS_LOG: Final = log_of(__name__)
_NUMBER: Final = re.compile(r"(?<![0-9a-f])(?=[a-f]*+[0-9])[0-9a-f]++")
_HEAD: Final = re.compile(r"^[\d.]+ \[[^]]*\] +\S* *")


class _DdsLog:
    """Reads its lines from a pipe until it is closed, and logs each kind once.

    Lines of a kind differ in numbers. What the pipe does not hold is lost: nothing waits.

    Attributes:
        configuration: has DDS write into the pipe; where pipes have no names, it says nothing.
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
        """End, once DDS has left the pipe."""
        os.close(self._writer)


def _read(descriptor: int) -> None:
    known = set[str]()
    with open(descriptor, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            text = _HEAD.sub("", line.strip())
            kind = _NUMBER.sub("#", text)
            if kind not in known and len(known) < _MOST_MESSAGES:
                known.add(kind)
                _DDS_LOG.warning("ros2: DDS says: %s", text)


_LOOPBACK: Final = "127.0.0.1"
_MOST_PARTICIPANTS: Final = 32
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
    f"<MaxAutoParticipantIndex>{_MOST_PARTICIPANTS}</MaxAutoParticipantIndex>"
    f'<Peers><Peer Address="{_LOOPBACK}"/></Peers>'
)


class DdsParticipant:
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
        """Return a new DataWriter of a topic; DDSException if there can be none."""
        return DataWriter(self.entity, self._topic(entry), qos=_qos_of(entry))

    def reader(self, entry: TopicEntry, listener: Listener) -> Any:
        """Return a new DataReader of a topic; DDSException if there can be none."""
        topic = self._topic(entry)
        return DataReader(self.entity, topic, qos=_qos_of(entry), listener=listener)

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


def _qos_of(entry: TopicEntry) -> Qos:
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
        return f'address="{_LOOPBACK}" multicast="false"', _PEERS
    known = [name for _, name in socket.if_nameindex()]
    if interface not in known:
        raise ValueError(f"interface {interface!r} is none of this machine: {', '.join(known)}")
    return f'name="{interface}"', ""


# Who else writes and reads our topics, and in a way that is not ours.

_LOOK_S: Final = 0.5
MATCH_S: Final = 5.0
"""So long a peer that seems to fit may take until it is matched."""

_MOST: Final = 1_000

_INFINITE_NS: Final = 0x7FFF_FFFF_FFFF_FFFF

_UNSIGNED: Final = 0xFFFF_FFFF_FFFF_FFFF
"""Handles are 64 bits, which Cyclone DDS's Python has with a sign or without."""

_LOG: Final = log_of(__name__)


class OwnEndpoint(Protocol):
    """What writes or reads one of our topics.

    Attributes:
        entry: port and topic.
    """

    @property
    def entry(self) -> TopicEntry:
        """Port and topic."""
        ...

    def matched(self) -> list[int]:
        """Return the instance handles of the peers that it is joined with."""
        ...


_Endpoints = Mapping[str, OwnEndpoint]
"""By topic, as DDS calls it."""


class ForeignEndpoints:
    """Says of each peer that cannot be joined with a topic of ours why, in a line.

    Args:
        participant: takes part in the domain.
        writing: what we write; it may change.
        reading: what we read.
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
        """Say what is new; return when to look again, in s."""
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
        """Look no more."""
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
        """Say who has the right names, and was not joined in all that time."""
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
    """Return which policy of a peer cannot be met, with its value; empty if all can.

    Ours are the defaults of DDS: no deadline, automatic liveliness without a lease, shared
    ownership, order by reception (DDS 1.4, 2.2.3: requested and offered must be compatible).
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


# What reads the messages of one topic for its port, in the thread of the engine.

# What writes the messages of one port to its topic, in the thread of the engine.

_WRITER_LOG: Final = log_of(__name__)


class TopicWriter:
    """Writes to a topic; it is opened with the first message, or by `open`.

    All of it is called in one thread.

    Args:
        participant: takes part in the domain.
        entry: port and topic.

    Attributes:
        entry: as given.
    """

    def __init__(self, participant: DdsParticipant, entry: TopicEntry) -> None:
        self._participant, self.entry = participant, entry
        self._writer: Any = None
        self._failed = self._closed = False

    def open(self) -> None:
        """Be there for peers; what cannot be is logged in a line."""
        try:
            if not (self._failed or self._closed):
                self._writer = self._participant.writer(self.entry)
        except DDSException as error:
            self._failed = True
            _WRITER_LOG.warning(
                "%s: no topic %s: %s", self.entry, self.entry.topic, reason_of(error)
            )

    def put(self, message: Any) -> PortStatus:
        """Write a message; nothing waits for those who read it.

        Returns:
            INVALID_ARGS if a number of it does not fit, BUFFER_TIMEOUT if too much waits for
            readers already, PORT_ERROR if the topic cannot be.
        """
        if self._writer is None:
            self.open()
        if self._writer is None:
            return PortStatus.PORT_ERROR
        try:
            self._writer.write(message)
        except DDSException as error:
            late = error.code == DDSException.DDS_RETCODE_TIMEOUT
            return PortStatus.BUFFER_TIMEOUT if late else PortStatus.PORT_ERROR
        except Exception as error:  # whatever its encoder says of a value
            if not self._failed:
                _WRITER_LOG.warning("%s: no %s: %s", self.entry, self.entry.type, error)
            self._failed = True
            return PortStatus.INVALID_ARGS
        return PortStatus.PORT_OK

    def matched(self) -> list[int]:
        """Return the instance handles of the peers that it is joined with, in any thread."""
        writer = self._writer
        return [] if writer is None else list(writer.get_matched_subscriptions())

    def close(self) -> None:
        """Be gone."""
        self._writer, self._closed = None, True


_SMALLEST: Final = 1.2e-38
"""Below it a float32 is denormal; nothing on a robot is so small."""


class _Arrivals(Listener):
    """Tells that something came; DDS calls it in a thread of its own, where nothing is done."""

    def __init__(self, notify: Callable[[], None]) -> None:
        self._notify = notify
        super().__init__()  # type: ignore[no-untyped-call] # untyped there

    def on_data_available(self, reader: Any) -> None:
        self._notify()


class TopicReader:
    """Reads a topic, and hands on what comes.

    All but the constructor is called in the thread.

    Args:
        participant: takes part in the domain.
        entry: port and topic.
        thread: reads.
        put: takes each message, and None where they have stopped for too long.

    Attributes:
        entry: as given.
    """

    def __init__(
        self,
        participant: DdsParticipant,
        entry: TopicEntry,
        thread: PeerThread,
        put: Callable[[Any], object],
    ) -> None:
        self._participant, self.entry, self._thread = participant, entry, thread
        self._put = put
        self._reader: Any = None
        self._closed = self._spoilt = self._odd = self._watched = False
        self._heard_s, self._stop_s = 0.0, entry.stop_after_us / 1e6

    def open(self) -> None:
        """Be there for peers; what cannot be is logged in a line."""
        try:
            if not self._closed:
                self._reader = self._participant.reader(
                    self.entry, _Arrivals(partial(self._thread.submit, self._take))
                )
        except DDSException as error:
            _LOG.warning("%s: no topic %s: %s", self.entry, self.entry.topic, reason_of(error))

    def matched(self) -> list[int]:
        """Return the instance handles of the peers that it is joined with, in any thread."""
        reader = self._reader
        return [] if reader is None else list(reader.get_matched_publications())

    def close(self) -> None:
        """Be gone."""
        self._reader, self._closed = None, True

    def _take(self) -> float | None:
        """Take what has come, one by one: a message that is none costs no other."""
        for _ in range(HISTORY):
            if self._reader is None or (found := self._take_one(self._reader)) is None:
                return None
            for message in found:
                if not isinstance(message, InvalidSample):  # nothing but that somebody is gone
                    self._hand_on(message)
        return 0

    def _take_one(self, reader: Any) -> list[Any] | None:
        """Return what came next, nothing for what is no message; None at the end."""
        try:
            return reader.take(1) or None
        except DDSException as error:
            self._warn_once(reason_of(error))
            return None
        except Exception as error:  # whatever its decoder says of bytes
            self._warn_once(str(error) or type(error).__name__)
            return []

    def _warn_once(self, reason: str) -> None:
        if not self._spoilt:
            text = "%s: what came on %s is no %s: %s"
            _LOG.warning(text, self.entry, self.entry.topic, self.entry.type, reason)
        self._spoilt = True

    def _hand_on(self, message: Any) -> None:
        if not self._odd and (odd := _odd_number(message)):
            self._odd = True
            text = "%s: %s on %s: an rclpy that puts an int into a float field sends this, and"
            text += " ROS_PYTHON_CHECK_FIELDS=1 in its environment finds it"
            _LOG.warning(text, self.entry, odd, self.entry.topic)
        self._put(message)
        self._heard_s = time.monotonic()
        if self._stop_s and not self._watched:
            self._watched = True
            self._thread.submit(self._watch)

    def _watch(self) -> float | None:
        """Take the latest value back when nothing more has come for too long."""
        left_s = self._heard_s + self._stop_s - time.monotonic()
        if left_s > 0 and not self._closed:
            return left_s
        self._watched = False
        if not self._closed:
            self._put(None)
        return None


def _odd_number(message: object, path: str = "") -> str:
    """Return which number of a message no sender can mean, with its value; empty if none.

    That is one that is not finite, or so small that it is a whole number in the bits of a float.
    Sequences are passed over: a range without an echo is infinite (REP 117).
    """
    for name, value in vars(message).items():
        if isinstance(value, float):
            if not isfinite(value) or 0 < abs(value) < _SMALLEST:
                return f"{path}{name} is {value:g}"
        elif hasattr(value, "__dict__") and (odd := _odd_number(value, f"{path}{name}.")):
            return odd
    return ""
