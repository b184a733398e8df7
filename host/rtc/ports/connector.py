"""A connector between data ports: it moves values, and holds those not yet read."""

from __future__ import annotations

from typing import Generic, TypeVar

from tickrig.host.rtc.ports.connector_options import (
    ConnectorOptions,
    DataflowType,
    InterfaceType,
    SubscriptionType,
)
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.ports.port_status import PortStatus
from tickrig.host.rtc.ports.publisher import Publisher
from tickrig.host.rtc.ports.ring_buffer import RingBuffer
from tickrig.wire.errors import FieldError
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.cdr import decode, encode
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)


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
        ports: tuple[AnyPort, AnyPort],
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
