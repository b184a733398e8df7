"""The OutPort's end of a connector that pushes later than it is written to."""

from __future__ import annotations

from typing import Final, Generic, TypeVar

from tickrig.host.rtc.ports.connector_options import ConnectorOptions, PushPolicy, SubscriptionType
from tickrig.host.rtc.ports.port_status import PortStatus
from tickrig.host.rtc.ports.ring_buffer import RingBuffer
from tickrig.wire.instant import NEVER

T = TypeVar("T")

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
