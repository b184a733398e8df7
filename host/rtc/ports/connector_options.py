"""The `dataport.*` properties of a connector between data ports (OpenRTM-aist 1.x)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from tickrig.host.rtc.execution.execution_context import MAX_RATE_HZ, MIN_RATE_HZ
from tickrig.host.rtc.ports.ring_buffer import (
    DEFAULT_LENGTH,
    BufferOptions,
    EmptyPolicy,
    FullPolicy,
    ReadPolicy,
)
from tickrig.host.rtc.states import RtcRefused
from tickrig.wire.rtc_types.cdr import Endian

E = TypeVar("E", bound=StrEnum)
V = TypeVar("V")


class InterfaceType(StrEnum):
    """How a value passes the connector (`interface_type`)."""

    DIRECT = "direct"  # the value itself
    CORBA_CDR = "corba_cdr"  # its bytes, encoded and decoded again


class DataflowType(StrEnum):
    """Who moves the values (`dataflow_type`)."""

    PUSH = "push"
    PULL = "pull"


class SubscriptionType(StrEnum):
    """When values are pushed (`subscription_type`)."""

    FLUSH = "flush"  # while they are written
    NEW = "new"  # at the end of the tick in which they were written
    PERIODIC = "periodic"  # at a rate of the connector's own


class PushPolicy(StrEnum):
    """Which of the waiting values are pushed (`publisher.push_policy`)."""

    ALL = "all"
    FIFO = "fifo"  # the oldest; the others wait
    SKIP = "skip"  # one of `publisher.skip_count` + 1
    NEW = "new"  # the newest; the others are dropped


@dataclass(frozen=True, slots=True)
class ConnectorOptions:
    """What the properties say."""

    interface: InterfaceType
    dataflow: DataflowType
    subscription: SubscriptionType
    push_policy: PushPolicy
    skip_count: int
    push_rate_hz: float
    endian: Endian
    inport: BufferOptions
    outport: BufferOptions

    @property
    def stated(self) -> Mapping[str, str]:
        """The properties that every connector profile has."""
        return {
            "dataport.interface_type": self.interface.value,
            "dataport.dataflow_type": self.dataflow.value,
            "dataport.subscription_type": self.subscription.value,
        }

    @classmethod
    def parse(cls, properties: Mapping[str, str]) -> ConnectorOptions:
        """Read properties; those left out have OpenRTM's defaults, and `direct`.

        Other keys than those of this table are kept, and mean nothing here.

        | key, behind `dataport.` | values |
        |---|---|
        | `interface_type` | direct, corba_cdr |
        | `dataflow_type` | push, pull |
        | `subscription_type` | flush, new, periodic |
        | `publisher.push_policy` | all, fifo, skip, new |
        | `publisher.skip_count` | 0 and more |
        | `publisher.push_rate` | Hz |
        | `serializer.cdr.endian` | little, big, or both with the preferred one first |
        | `buffer.length` | 1 and more |
        | `buffer.write.full_policy` | overwrite, do_nothing, block |
        | `buffer.read.empty_policy` | readback, do_nothing, block |
        | `buffer.read.policy` | fifo, last, skip (not in OpenRTM) |
        | `buffer.read.skip_count` | 0 and more (not in OpenRTM) |

        `inport.buffer.*` and `outport.buffer.*` hold for one end alone.

        Raises:
            RtcRefused: a value that is not in the table.
        """
        read = _Reader(properties)
        return cls(
            read.word("interface_type", InterfaceType.DIRECT),
            read.word("dataflow_type", DataflowType.PUSH),
            read.word("subscription_type", SubscriptionType.FLUSH),
            read.word("publisher.push_policy", PushPolicy.NEW),
            read.count("publisher.skip_count", 0),
            read.value("publisher.push_rate", 1_000.0, _rate, f"{MIN_RATE_HZ}..{MAX_RATE_HZ} Hz"),
            read.value("serializer.cdr.endian", Endian.LITTLE, _endian, ", ".join(Endian)),
            _Reader(properties, "inport.").buffer(),
            _Reader(properties, "outport.").buffer(),
        )


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads one property at a time; what holds for one end alone goes first."""

    properties: Mapping[str, str]
    end: str = ""

    def value(self, key: str, default: V, convert: Callable[[str], V], allowed: str) -> V:
        own = self.properties.get(f"dataport.{self.end}{key}")
        text = self.properties.get(f"dataport.{key}") if own is None else own
        try:
            return default if text is None else convert(text)
        except ValueError:
            raise RtcRefused(f"dataport.{key}: {text!r} is none of: {allowed}") from None

    def word(self, key: str, default: E) -> E:
        return self.value(key, default, type(default), ", ".join(type(default)))

    def count(self, key: str, default: int) -> int:
        return self.value(key, default, _count, "0 and more")

    def buffer(self) -> BufferOptions:
        length = self.count("buffer.length", DEFAULT_LENGTH)
        full = self.word("buffer.write.full_policy", FullPolicy.OVERWRITE)
        empty = self.word("buffer.read.empty_policy", EmptyPolicy.READBACK)
        read = self.word("buffer.read.policy", ReadPolicy.FIFO)
        skip_count = self.count("buffer.read.skip_count", 0)
        try:
            return BufferOptions(length, full, empty, read, skip_count)
        except ValueError as error:
            raise RtcRefused(f"dataport.{self.end}buffer: {error}") from error


def _count(text: str) -> int:
    if not text.isdecimal():
        raise ValueError(text)
    return int(text)


def _rate(text: str) -> float:
    rate_hz = float(text)
    if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
        raise ValueError(text)
    return rate_hz


def _endian(text: str) -> Endian:
    """Return the byte order that is preferred: the first of those named, little if none is."""
    first, *_ = [Endian(word.strip()) for word in (text or Endian.LITTLE).split(",")]
    return first
