"""A connector between data ports: it moves values, and holds those not yet read."""

from __future__ import annotations

from typing import Final, Generic, TypeVar

from tickrig.host.rtc.ports.connector_options import (
    ConnectorOptions,
    DataflowType,
    InterfaceType,
    PushPolicy,
    SubscriptionType,
)
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.ports.ring_buffer import RingBuffer
from tickrig.host.rtc.states import PortStatus
from tickrig.wire.errors import FieldError
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.cdr import decode, encode
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)


_SECOND_US: Final = 1_000_000


class Publisher(Generic[T]):
    """Holds values until a tick takes them: at once with `new`, at multiples of a period else.

    With `new` the push policy `fifo` means `all`: OpenRTM pushes once a write.
    """

    __slots__ = ("_period_us", "_planned_us", "_policy", "_skipped", "_stride", "_values")

    def __init__(self, options: ConnectorOptions) -> None:
        self._values = RingBuffer[T](options.outport)
        self._policy, self._stride = options.push_policy, options.skip_count + 1
        self._period_us, self._skipped, self._planned_us = 1, 0, NEVER
        if options.subscription is SubscriptionType.PERIODIC:
            self._period_us = round(_SECOND_US / options.push_rate_hz)
        elif self._policy is PushPolicy.FIFO:
            self._policy = PushPolicy.ALL

    @property
    def due_us(self) -> int:
        """When `take` has something to do: in the past for a new value, `NEVER` without one."""
        if not len(self._values):
            return NEVER
        return 0 if self._planned_us == NEVER else self._planned_us

    def write(self, value: T) -> PortStatus:
        """Hold a value, as the policies of the OutPort's buffer say."""
        return self._values.write(value)

    def take(self, now_us: int) -> tuple[T, ...]:
        """Take what is pushed at `now_us`."""
        late_us = now_us % self._period_us
        taken = () if late_us and now_us < self._planned_us else self._pick()
        waits = len(self._values) > 0
        self._planned_us = now_us - late_us + self._period_us if waits else NEVER
        return taken

    def _pick(self) -> tuple[T, ...]:
        if self._policy is PushPolicy.FIFO:
            return self._values.pop()
        values = self._values.clear()
        match self._policy:
            case PushPolicy.NEW:
                return values[-1:]
            case PushPolicy.SKIP:
                return self._every(values)
            case _:
                return values

    def _every(self, values: tuple[T, ...]) -> tuple[T, ...]:
        """Return one of `stride` values, counted over calls."""
        first = self._skipped + 1
        self._skipped = (self._skipped + len(values)) % self._stride
        return tuple(value for n, value in enumerate(values, first) if n % self._stride == 0)


class Connector(ConnectorBase, Generic[T]):
    """Moves values from an OutPort to an InPort.

    With `pull`, and with `push` and `flush`, a value can be read as soon as it
    is written. With `new` and `periodic` it waits until a tick pushes it.

    Args:
        profile: how it is described.
        ports: OutPort and InPort.
        options: what the properties of the profile say.

    Attributes:
        buffer: the values that the InPort can read.
    """

    def __init__(
        self,
        profile: ConnectorProfile,
        ports: tuple[AnyPort, ...],
        options: ConnectorOptions,
    ) -> None:
        super().__init__(profile, ports)
        pulled = options.dataflow is DataflowType.PULL
        at_once = pulled or options.subscription is SubscriptionType.FLUSH
        self.buffer = RingBuffer[T](options.outport if pulled else options.inport)
        self._publisher = None if at_once else Publisher[T](options)
        self._encodes, self._endian = options.interface is InterfaceType.CORBA_CDR, options.endian

    @property
    def publishes(self) -> bool:
        """Whether it pushes in `tick`, later than it is written to."""
        return self._publisher is not None

    @property
    def due_us(self) -> int:
        """When `tick` has something to push: in the past for a new value, or `NEVER`."""
        return self._publisher.due_us if self._publisher else NEVER

    def write(self, value: T) -> PortStatus:
        """Take a value from the OutPort.

        Returns:
            PORT_OK, what the buffer it goes to says, or INVALID_ARGS if a number does not fit
            its IDL type (with `corba_cdr`).
        """
        if self._encodes:
            try:
                value = decode(type(value), encode(value, self._endian), self._endian)
            except FieldError:
                return PortStatus.INVALID_ARGS
        return (self._publisher or self.buffer).write(value)

    def tick(self, now_us: int) -> None:
        """Push what is due."""
        if self._publisher:
            for value in self._publisher.take(now_us):
                self.buffer.write(value)
