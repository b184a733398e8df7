"""Data ports. Components write to OutPorts and read from InPorts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Generic, TypeVar

from tickrig.host.rtc.ports.connector import (
    Connector,
    DataflowType,
    InterfaceType,
    SubscriptionType,
)
from tickrig.host.rtc.ports.port import Port
from tickrig.host.rtc.states import PortStatus
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)

_OK: Final = PortStatus.PORT_OK

_OFFERED: Final[Mapping[str, str]] = {
    "dataport.interface_type": ", ".join(InterfaceType),
    "dataport.dataflow_type": ", ".join(DataflowType),
    "dataport.subscription_type": ", ".join(SubscriptionType),
}


class DataPort(Port[Connector[T]], Generic[T]):
    """Base class of OutPort and InPort: a port that transfers values of one type.

    Args:
        name: name of the port, without the name of its component.
        data_type: struct type of the values, such as `TimedLong`.
    """

    def __init__(self, name: str, data_type: type[T]) -> None:
        super().__init__(name)
        self.data_type = data_type

    def _properties(self) -> Mapping[str, str]:
        return {"dataport.data_type": self.data_type.idl_id(), **_OFFERED}


class OutPort(DataPort[T]):
    """A data port to which a component writes values (OpenRTM-aist 1.x, OutPort).

    Each connector of the port gets each value, and transfers the value according to its
    `dataport.*` properties (`ConnectorOptions.parse`).

    Not emulated: the listeners of OpenRTM for events inside a connector, such as ON_BUFFER_WRITE.

    Args:
        name: name of the port without the name of its component, such as `out`.
        data_type: struct type of the values, such as `TimedLong`. The port can be connected with
            InPorts of the same type.

    Attributes:
        data_type: struct type of the values.
    """

    port_type = "DataOutPort"

    def write(self, value: T) -> PortStatus:
        """Write a value to each connector of the port, without waiting.

        Args:
            value: struct of the port's `data_type`. Only connectors with `corba_cdr` check that the
                numbers in the struct fit their IDL types.

        Returns:
            PORT_OK if all connectors accepted the value, or if there are no connectors. Otherwise,
            the status of the first connector that did not accept it: BUFFER_FULL, BUFFER_TIMEOUT or
            INVALID_ARGS. If the `guard` of the port does not allow the value, the result is
            PORT_ERROR.

        Raises:
            TypeError: the value has another type than the port.
        """
        if not isinstance(value, self.data_type):
            wanted = self.data_type.__name__
            raise TypeError(f"{self.full_name} takes {wanted}, not {type(value).__name__}")
        if self.guard is not None and not self.guard.passes(self, value):
            return PortStatus.PORT_ERROR
        status = _OK
        for connector in self.connectors:
            written = connector.write(value)
            status = status or written
        return status


class InPort(DataPort[T]):
    """A data port from which a component reads values (OpenRTM-aist 1.x, InPort).

    Each connector of the port has its own buffer. If several buffers have values, the port reads
    from the connector that was made first.

    Args:
        name: name of the port without the name of its component, such as `in`.
        data_type: struct type of the values, such as `TimedLong`. The port can be connected with
            OutPorts of the same type.

    Attributes:
        data_type: struct type of the values.
    """

    port_type = "DataInPort"

    def __init__(self, name: str, data_type: type[T]) -> None:
        super().__init__(name, data_type)
        self._latest: Connector[T] | None = None

    @property
    def is_new(self) -> bool:
        """Whether `read` returns a value that was not read before."""
        for connector in self.connectors:  # noqa: SIM110 - any() takes twice as long
            if connector.buffer.readable:
                return True
        return False

    def read(self) -> T | None:
        """Return the next unread value and remove it from its buffer, without waiting.

        Returns:
            The next value. If there is no new value, the result depends on the `empty_policy` of
            the connector. With `readback`, the result is the value of the last read, or None if
            nothing was read yet. With any other policy, the result is None.
        """
        for connector in self.connectors:
            if connector.buffer.readable:
                self._latest = connector
                break
        return self._latest.buffer.read() if self._latest else None

    def clear(self) -> None:
        """Drop all values that were not read."""
        for connector in self.connectors:
            connector.buffer.clear()
