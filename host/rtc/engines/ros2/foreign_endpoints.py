"""Who else writes and reads our topics, and in a way that is not ours."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, Final, Protocol

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import DDSException, InstanceState
from cyclonedds.qos import Policy

from tickrig.host.rtc.engines.ros2.message_types import dds_name, ros_name
from tickrig.host.rtc.engines.ros2.participant import Participant
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry
from tickrig.host.text.log import log_of

LOOK_S: Final = 0.5
MATCH_S: Final = 5.0
"""So long a peer that seems to fit may take until it is matched."""

MOST: Final = 1_000

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


Endpoints = Mapping[str, OwnEndpoint]
"""By topic, as DDS calls it."""


class ForeignEndpoints:
    """Says of each peer that cannot be joined with a topic of ours why, in a line.

    Args:
        participant: takes part in the domain.
        writing: what we write; it may change.
        reading: what we read.
    """

    def __init__(self, participant: Participant, writing: Endpoints, reading: Endpoints) -> None:
        self._sides: tuple[tuple[Any, Endpoints, bool], ...] = (
            (BuiltinDataReader(participant.entity, BuiltinTopicDcpsSubscription), writing, True),
            (BuiltinDataReader(participant.entity, BuiltinTopicDcpsPublication), reading, False),
        )
        self._warned = set[str]()
        self._awaited: dict[int, tuple[float, OwnEndpoint, str]] = {}

    def look(self) -> float | None:
        """Say what is new; return when to look again, in s."""
        for reader, ours, reads in self._sides:
            try:
                endpoints = reader.take(MOST)
            except DDSException:  # the participant has gone
                return None
            for endpoint in endpoints:
                handle = endpoint.sample_info.instance_handle
                self._awaited.pop(handle, None)
                alive = endpoint.sample_info.instance_state == InstanceState.Alive
                if alive and (own := ours.get(endpoint.topic_name or "")):
                    self._compare(handle, endpoint, own, reads=reads)
        self._look_for_unmatched()
        return LOOK_S

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
