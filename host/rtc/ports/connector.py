"""A connector between data ports, which moves values, and holds unread values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

from tickrig.host.rtc.ports import ring_buffer
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.states import MAX_RATE_HZ, MIN_RATE_HZ, PortStatus, RtcRefused
from tickrig.wire.errors import FieldError
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.cdr import Endian, decode, encode
from tickrig.wire.rtc_types.idl import Struct

# The `dataport.*` properties of a connector between data ports (OpenRTM-aist 1.x).

E = TypeVar("E", bound=StrEnum)
V = TypeVar("V")


class InterfaceType(StrEnum):
    """How a connector transfers values (`interface_type`)."""

    DIRECT = "direct"  # the value itself
    CORBA_CDR = "corba_cdr"  # its bytes, encoded and decoded again


class DataflowType(StrEnum):
    """Which end of a connector transfers the values (`dataflow_type`)."""

    PUSH = "push"
    PULL = "pull"


class SubscriptionType(StrEnum):
    """When a connector pushes values (`subscription_type`)."""

    FLUSH = "flush"  # while they are written
    NEW = "new"  # at the end of the tick in which they were written
    PERIODIC = "periodic"  # at a rate of the connector's own


class _PushPolicy(StrEnum):
    """The waiting values that are pushed (`publisher.push_policy`)."""

    ALL = "all"
    FIFO = "fifo"  # the oldest; the others wait
    SKIP = "skip"  # one of `publisher.skip_count` + 1
    NEW = "new"  # the newest; the others are dropped


@dataclass(frozen=True, slots=True)
class ConnectorOptions:
    """The options of a connector, read from its properties."""

    interface: InterfaceType
    dataflow: DataflowType
    subscription: SubscriptionType
    push_policy: _PushPolicy
    skip_count: int
    push_rate_hz: float
    endian: Endian
    inport: ring_buffer.BufferOptions
    outport: ring_buffer.BufferOptions

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
        """Read the options in the properties of a connector.

        Missing properties have OpenRTM's defaults, but `interface_type` is `direct`. Keys that are
        not in this table are kept and have no effect.

        | key, after `dataport.` | values |
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

        `inport.buffer.*` and `outport.buffer.*` apply to one end only.

        Raises:
            RtcRefused: a value is not in the table.
        """
        read = _Reader(properties)
        return cls(
            read.word("interface_type", InterfaceType.DIRECT),
            read.word("dataflow_type", DataflowType.PUSH),
            read.word("subscription_type", SubscriptionType.FLUSH),
            read.word("publisher.push_policy", _PushPolicy.NEW),
            read.count("publisher.skip_count", 0),
            read.value("publisher.push_rate", 1_000.0, _rate, f"{MIN_RATE_HZ}..{MAX_RATE_HZ} Hz"),
            read.value("serializer.cdr.endian", Endian.LITTLE, _endian, ", ".join(Endian)),
            _Reader(properties, "inport.").buffer(),
            _Reader(properties, "outport.").buffer(),
        )


@dataclass(frozen=True, slots=True)
class _Reader:
    """A reader of single properties. A property for one end takes precedence."""

    properties: Mapping[str, str]
    end: str = ""

    def value(self, key: str, default: V, convert: Callable[[str], V], allowed: str) -> V:
        own = self.properties.get(f"dataport.{self.end}{key}")
        text = self.properties.get(f"dataport.{key}") if own is None else own
        try:
            return default if text is None else convert(text)
        except ValueError:
            raise RtcRefused(f"dataport.{key}: {text!r} is not one of: {allowed}") from None

    def word(self, key: str, default: E) -> E:
        return self.value(key, default, type(default), ", ".join(type(default)))

    def count(self, key: str, default: int) -> int:
        return self.value(key, default, _count, "0 and more")

    def buffer(self) -> ring_buffer.BufferOptions:
        length = self.count("buffer.length", ring_buffer.DEFAULT_LENGTH)
        full = self.word("buffer.write.full_policy", ring_buffer.FullPolicy.OVERWRITE)
        empty = self.word("buffer.read.empty_policy", ring_buffer.EmptyPolicy.READBACK)
        read = self.word("buffer.read.policy", ring_buffer.ReadPolicy.FIFO)
        skip_count = self.count("buffer.read.skip_count", 0)
        try:
            return ring_buffer.BufferOptions(length, full, empty, read, skip_count)
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
    """Return the preferred byte order, which is the first of those named, or little endian."""
    first, *_ = [Endian(word.strip()) for word in (text or Endian.LITTLE).split(",")]
    return first


T = TypeVar("T", bound=Struct)


_SECOND_US: Final = 1_000_000


class _Publisher(Generic[T]):
    """A publisher that holds values until a tick takes them.

    With `new`, the next tick takes the values. Otherwise a tick at a multiple of a period takes
    them. With `new`, the push policy `fifo` means `all`, because OpenRTM pushes once per write.
    """

    __slots__ = ("_period_us", "_planned_us", "_policy", "_skipped", "_stride", "_values")

    def __init__(self, options: ConnectorOptions) -> None:
        self._values = ring_buffer.RingBuffer[T](options.outport)
        self._policy, self._stride = options.push_policy, options.skip_count + 1
        self._period_us, self._skipped, self._planned_us = 1, 0, NEVER
        if options.subscription is SubscriptionType.PERIODIC:
            self._period_us = round(_SECOND_US / options.push_rate_hz)
        elif self._policy is _PushPolicy.FIFO:
            self._policy = _PushPolicy.ALL

    @property
    def due_us(self) -> int:
        """Time in us at which `take` will return values.

        If no value waits, the time is `NEVER`. If a value waits, the time is 0, which means at
        once. With the subscription type `periodic`, the next call of `take` replaces the 0 by the
        time at which the next period begins.
        """
        if not len(self._values):
            return NEVER
        return 0 if self._planned_us == NEVER else self._planned_us

    def write(self, value: T) -> PortStatus:
        """Put a value into the OutPort's buffer, according to the policies of the buffer."""
        return self._values.write(value)

    def take(self, now_us: int) -> tuple[T, ...]:
        """Remove and return the values that are to be pushed at `now_us`."""
        late_us = now_us % self._period_us
        taken = () if late_us and now_us < self._planned_us else self._pick()
        waits = len(self._values) > 0
        self._planned_us = now_us - late_us + self._period_us if waits else NEVER
        return taken

    def _pick(self) -> tuple[T, ...]:
        if self._policy is _PushPolicy.FIFO:
            return self._values.pop()
        values = self._values.clear()
        match self._policy:
            case _PushPolicy.NEW:
                return values[-1:]
            case _PushPolicy.SKIP:
                return self._every(values)
            case _:
                return values

    def _every(self, values: tuple[T, ...]) -> tuple[T, ...]:
        """Return one of `stride` values, counted over calls."""
        first = self._skipped + 1
        self._skipped = (self._skipped + len(values)) % self._stride
        return tuple(value for n, value in enumerate(values, first) if n % self._stride == 0)


class Connector(ConnectorBase, Generic[T]):
    """Connection between two data ports, which moves values from an OutPort to an InPort.

    With the dataflow type `pull`, the InPort can read a value as soon as the value is written. With
    the dataflow type `push`, this depends on the subscription type. With `flush`, the InPort can
    read the value as soon as the value is written. With `new` and `periodic`, the value waits until
    a tick of the schedule pushes the value.

    Args:
        profile: name, ID, ports and properties of the connector.
        ports: OutPort and InPort of the connector, in this order.
        options: settings that were read from the properties of the profile.

    Attributes:
        buffer: buffer with the values that the InPort can read.
    """

    def __init__(
        self, profile: ConnectorProfile, ports: tuple[AnyPort, ...], options: ConnectorOptions
    ) -> None:
        super().__init__(profile, ports)
        pulled = options.dataflow is DataflowType.PULL
        at_once = pulled or options.subscription is SubscriptionType.FLUSH
        self.buffer = ring_buffer.RingBuffer[T](options.outport if pulled else options.inport)
        self._publisher = None if at_once else _Publisher[T](options)
        self._encodes, self._endian = options.interface is InterfaceType.CORBA_CDR, options.endian

    @property
    def publishes(self) -> bool:
        """Whether `tick` pushes the values, instead of `write`."""
        return self._publisher is not None

    @property
    def due_us(self) -> int:
        """Time in us at which `tick` will push values to the InPort.

        If no value waits, the time is `NEVER`. If a value waits, the time is 0, which means at
        once. With the subscription type `periodic`, the next tick replaces the 0 by the time at
        which the next period begins.
        """
        return self._publisher.due_us if self._publisher else NEVER

    def write(self, value: T) -> PortStatus:
        """Put a value of the OutPort into a buffer of the connector.

        Returns:
            The status of the buffer, such as PORT_OK. With the interface type `corba_cdr`, the
            status is INVALID_ARGS if a number does not fit its IDL type.
        """
        if self._encodes:
            try:
                value = decode(type(value), encode(value, self._endian), self._endian)
            except FieldError:
                return PortStatus.INVALID_ARGS
        return (self._publisher or self.buffer).write(value)

    def tick(self, now_us: int) -> None:
        """Push the due values."""
        if self._publisher:
            for value in self._publisher.take(now_us):
                self.buffer.write(value)
