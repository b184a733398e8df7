"""What a developer writes: the ports of a component, and what it does in each state."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any, Final

from tickrig.device.component import DeviceComponent, Result
from tickrig.device.physical import InputBank
from tickrig.device.rtc_lite.ports import LiteInPort, LiteOutPort, LitePort
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.values import LONG, encode_name

MAX_PORTS: Final = 8
"""In-ports, and out-ports, that a small device has room for (RTno has as many)."""


class LiteComponent(DeviceComponent):
    """A component on a small device; a subclass says what it is and does.

    Callbacks are those of the paper's Table 1.

    Attributes:
        type_name: type of the component, 1 to 15 characters.
        in_ports: the in-ports by name, in order of declaration.
        out_ports: the out-ports.

    Raises:
        ValueError: no type name, an input that takes fractions, or what a PIC has no room for.

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
        """Hear that the execution context of the proxy runs; asked for only if defined."""

    def on_shutdown(self) -> Result:
        """Hear that it has stopped; asked for only if defined."""


def _check_ports(kind: str, ports: Iterable[LitePort[Any]]) -> None:
    """Raise ValueError if ports have the same name, or are too many."""
    for word, wanted in (("in-port", True), ("out-port", False)):
        names = [port.name.decode() for port in ports if _is_in(port) is wanted]
        if len(names) > MAX_PORTS:
            raise ValueError(f"{kind}: {len(names)} {word}s, at most {MAX_PORTS} fit")
        for name, count in Counter(names).items():
            if count > 1:
                raise ValueError(f"{kind}: {count} {word}s are called {name!r}")


def _is_in(port: LitePort[Any]) -> bool:
    return isinstance(port, LiteInPort)


class LiteEcho(LiteComponent):
    """One in-port, one out-port, both TimedLong."""

    type_name = "Echo0"
    inlet = LiteInPort("in", LONG)
    outlet = LiteOutPort("out", LONG)

    def on_execute(self) -> None:
        """Hand on what is new."""
        if self.inlet.is_new:
            self.outlet.write(self.inlet.read())


class LiteA(LiteEcho):
    """The first RTC-Lite component of the paper's experiments (DECISION L16)."""

    type_name = "LiteA"


class LiteB(LiteEcho):
    """The second one."""

    type_name = "LiteB"
