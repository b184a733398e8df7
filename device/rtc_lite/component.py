r"""Base classes for components on small devices: ports, and callbacks for each state.

Each data port of a component on a small device is a buffer of one value. A new value overwrites the
previous one. Reading the value marks it as old (RTno's NullBuffer).

>>> from tickrig.wire.rtc_lite.values import LONG
>>> inlet = LiteInPort("in", LONG)
>>> inlet.accept(b"\x2a\x00\x00\x00"), inlet.is_new, inlet.read(), inlet.is_new
(True, True, 42, False)
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any, Final, Generic, TypeVar

from tickrig.device.component import DeviceComponent, Result
from tickrig.device.physical import InputBank
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.frame import MAX_DATA_BYTES
from tickrig.wire.rtc_lite.messages import PORT_COUNTS_BYTES
from tickrig.wire.rtc_lite.values import LONG, LitePortType, encode_name

T = TypeVar("T")


class LitePort(Generic[T]):
    """Base class of the in-ports and out-ports of a component on a small controller (RTC-Lite).

    Args:
        name: name of 1 to 15 printable ASCII characters.
        port_type: type of the values.
        most: largest number of elements of a sequence. The default is the number that fits into a
            frame.

    Attributes:
        is_new: whether the value has not been read yet. An out-port is read when its value is sent.
        value: the latest value.

    Raises:
        ValueError: the name or the largest value does not fit into a frame.
    """

    def __init__(self, name: str, port_type: LitePortType[T], most: int | None = None) -> None:
        self.name, self.port_type = encode_name(name), port_type
        room = MAX_DATA_BYTES - PORT_COUNTS_BYTES - len(self.name)
        if not port_type.sequence:
            most = 1
        elif most is None:
            most = room // port_type.size
        if not 1 <= most <= room // port_type.size:
            raise ValueError(
                f"port {name}: {most} elements of {port_type.name}, 1..{room // port_type.size} fit"
            )
        self._most_bytes = most * port_type.size
        self.is_new, self.value = False, port_type.initial

    def fits(self, data: bytes) -> bool:
        """Return whether a number of bytes is a value that fits into the port."""
        try:
            self.port_type.check_size(data)
        except FieldError:
            return False
        return len(data) <= self._most_bytes


class LiteInPort(LitePort[T]):
    """A port that the proxy writes and the component reads."""

    def read(self) -> T:
        """Return the latest value, and mark it as no longer new."""
        self.is_new = False
        return self.value

    def accept(self, data: bytes) -> bool:
        """Store a value that the proxy, which is the component's counterpart on the PC, has sent.

        Args:
            data: bytes of the value, as in the frame.

        Returns:
            False if the bytes are no valid value of the port. The old value is then kept.
        """
        if not self.fits(data):
            return False
        self.value, self.is_new = self.port_type.decode(data), True
        return True


class LiteOutPort(LitePort[T]):
    """A port that the component writes; new values go to the proxy."""

    def write(self, value: T) -> bool:
        """Set the value of the port, which is then sent to the proxy.

        Returns:
            False if the value is too long for the port. The previous value is then kept.

        Raises:
            ValueError: the value does not have the type of the port.
        """
        data = self.port_type.encode(value)
        if not self.fits(data):
            return False
        self.value, self.is_new = self.port_type.decode(data), True
        return True

    def take(self) -> bytes:
        """Return the bytes of the value for a frame, and mark the value as no longer new."""
        self.is_new = False
        return self.port_type.encode(self.value)


_MAX_PORTS: Final = 8
"""Largest number of in-ports and of out-ports on a small device (as in RTno)."""


class LiteComponent(DeviceComponent):
    """Base class of components that run on a small controller (RTComponent-Lite).

    A subclass defines the properties and callbacks. The callbacks are those of
    RTComponent-Lite-0.4.0 (Suzuki et al., RSJ 2007, Table 1).

    Attributes:
        type_name: type of the component, with 1 to 15 characters.
        in_ports: in-ports by name, in order of declaration.
        out_ports: out-ports by name, in order of declaration.

    Raises:
        ValueError: the type name is invalid, there are more than 8 in-ports or more than 8
            out-ports, or two in-ports or two out-ports have the same name. The error is also raised
            if a physical input accepts fractions, because these components support only integers as
            inputs.

    >>> from tickrig.wire.rtc_lite.values import LONG
    >>> class Doubler(LiteComponent):
    ...     type_name = "Doubler"
    ...     number = LiteInPort("number", LONG)
    ...     double = LiteOutPort("double", LONG)
    ...
    ...     def on_execute(self) -> None:
    ...         self.double.write(2 * self.number.read())
    """

    inputs: InputBank

    def __init__(self) -> None:
        kind = type(self).__name__
        for item in self.physical:
            if item.real:
                told = f"{kind}: input {item.name!r} takes fractions; give it a finer unit"
                raise ValueError(told)
        self.inputs = InputBank(self.physical)
        try:
            encode_name(self.type_name)
        except FieldError as error:
            raise ValueError(f"{kind}: type_name: {error}") from None
        ports = self._own_ports(LitePort)
        _check_ports(kind, ports)
        self.in_ports = {port.name: port for port in ports if isinstance(port, LiteInPort)}
        self.out_ports = {port.name: port for port in ports if isinstance(port, LiteOutPort)}

    def on_startup(self) -> Result:
        """Handle the start of the proxy's execution context; called only if defined."""

    def on_shutdown(self) -> Result:
        """Handle the stop of the proxy's execution context; called only if defined."""


def _check_ports(kind: str, ports: Iterable[LitePort[Any]]) -> None:
    """Raise ValueError if two ports have the same name, or if the ports are too many."""
    for word, wanted in (("in-port", True), ("out-port", False)):
        names = [port.name.decode() for port in ports if _is_in(port) is wanted]
        if len(names) > _MAX_PORTS:
            raise ValueError(f"{kind}: {len(names)} {word}s, at most {_MAX_PORTS} fit")
        for name, count in Counter(names).items():
            if count > 1:
                raise ValueError(f"{kind}: {count} {word}s are called {name!r}")


def _is_in(port: LitePort[Any]) -> bool:
    return isinstance(port, LiteInPort)


class LiteEcho(LiteComponent):
    """A component with one in-port and one out-port, both of type TimedLong."""

    type_name = "Echo0"
    inlet = LiteInPort("in", LONG)
    outlet = LiteOutPort("out", LONG)

    def on_execute(self) -> None:
        """Copy new values from the in-port to the out-port."""
        if self.inlet.is_new:
            self.outlet.write(self.inlet.read())


class LiteA(LiteEcho):
    """The first RTC-Lite component of the paper's experiments (DECISION L16)."""

    type_name = "LiteA"


class LiteB(LiteEcho):
    """The second RTC-Lite component of the paper's experiments (DECISION L16)."""

    type_name = "LiteB"
