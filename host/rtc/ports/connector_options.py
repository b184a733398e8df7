"""The `dataport.*` properties of a connector between data ports (OpenRTM-aist 1.x)."""

from __future__ import annotations

from collections.abc import Mapping
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
            read.rate("publisher.push_rate", 1_000.0),
            read.endian("serializer.cdr.endian"),
            read.buffer("inport."),
            read.buffer("outport."),
        )


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads one property at a time."""

    properties: Mapping[str, str]

    def word(self, key: str, default: E, end: str = "") -> E:
        text = self._text(key, end)
        kind = type(default)
        try:
            return default if text is None else kind(text)
        except ValueError:
            raise self._refusal(key, text, ", ".join(kind)) from None

    def count(self, key: str, default: int, end: str = "") -> int:
        text = self._text(key, end)
        if text is None:
            return default
        if not text.isdecimal():
            raise self._refusal(key, text, "0 and more")
        return int(text)

    def rate(self, key: str, default: float) -> float:
        text = self._text(key)
        try:
            rate_hz = default if text is None else float(text)
        except ValueError:
            rate_hz = 0.0
        if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
            raise self._refusal(key, text, f"{MIN_RATE_HZ}..{MAX_RATE_HZ} Hz")
        return rate_hz

    def endian(self, key: str) -> Endian:
        text = self._text(key)
        words = [word.strip() for word in (text or "little").split(",")]
        if not set(words) <= set(Endian):
            raise self._refusal(key, text, ", ".join(Endian))
        return Endian(words[0])

    def buffer(self, end: str) -> BufferOptions:
        try:
            return BufferOptions(
                self.count("buffer.length", DEFAULT_LENGTH, end),
                self.word("buffer.write.full_policy", FullPolicy.OVERWRITE, end),
                self.word("buffer.read.empty_policy", EmptyPolicy.READBACK, end),
                self.word("buffer.read.policy", ReadPolicy.FIFO, end),
                self.count("buffer.read.skip_count", 0, end),
            )
        except RtcRefused:
            raise
        except ValueError as error:
            raise RtcRefused(f"dataport.{end}buffer: {error}") from error

    def _text(self, key: str, end: str = "") -> str | None:
        own = self.properties.get(f"dataport.{end}{key}")
        return self.properties.get(f"dataport.{key}") if own is None else own

    def _refusal(self, key: str, text: str | None, allowed: str) -> RtcRefused:
        return RtcRefused(f"dataport.{key}: {text!r} is none of: {allowed}")
