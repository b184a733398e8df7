"""What a developer writes: the ports of a component, and what it does in each state."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from copy import copy
from typing import Any, ClassVar, Final

from tickrig.device.declared import declared
from tickrig.device.physical import InputBank, InputSignal
from tickrig.device.rtc_lite.ports import LiteInPort, LiteOutPort, LitePort
from tickrig.device.twin import Copyable
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.codes import LiteStatus
from tickrig.wire.rtc_lite.values import LONG, encode_name

ERROR: Final = LiteStatus.ERROR
"""What a callback returns that failed."""

Result = LiteStatus | None
"""What a callback returns; nothing means that all went well."""

MAX_PORTS: Final = 8
"""In-ports, and out-ports, that a small device has room for (RTno has as many)."""


class LiteComponent(Copyable):
    """A component on a small device; a subclass says what it is and does.

    Ports are declared as attributes of the class; each component has its own.
    Callbacks are those of the paper's Table 1, and may be left out. One that
    cannot fail is declared `-> None`; one that can returns `ERROR`. A power cut
    makes a new component: what a callback keeps in `self` is the device's RAM.

    Attributes:
        type_name: type of the component, 1 to 15 characters.
        physical: physical inputs that the device has beside its serial line.
        inputs: their values.
        in_ports: the in-ports by name, in order of declaration.
        out_ports: the out-ports.

    Raises:
        ValueError: no type name, or what a PIC has no room for.

    >>> from tickrig.wire.rtc_lite.values import LONG
    >>> class Doubler(LiteComponent):
    ...     type_name = "Doubler"
    ...     number = LiteInPort("number", LONG)
    ...     double = LiteOutPort("double", LONG)
    ...
    ...     def on_execute(self) -> None:
    ...         self.double.write(2 * self.number.read())
    """

    type_name: ClassVar[str] = ""
    physical: ClassVar[tuple[InputSignal, ...]] = ()

    def __init__(self) -> None:
        self.inputs = InputBank(self.physical)
        self.in_ports: dict[bytes, LiteInPort[Any]] = {}
        self.out_ports: dict[bytes, LiteOutPort[Any]] = {}
        kind = type(self).__name__
        try:
            encode_name(self.type_name)
        except FieldError as error:
            raise ValueError(f"{kind}: type_name: {error}") from None
        own = {name: copy(port) for name, port in declared(type(self), LitePort)}
        _check_ports(kind, own.values())
        for name, port in own.items():
            setattr(self, name, port)
            ports: dict[bytes, Any] = self.in_ports if _is_in(port) else self.out_ports
            ports[port.name] = port

    def on_initialize(self) -> Result:
        """Begin: Created becomes Inactive; after an error it stays Created."""

    def on_finalize(self) -> Result:
        """End, once; after an error it stays Inactive."""

    def on_startup(self) -> Result:
        """Hear that the execution context of the proxy runs; asked for only if defined."""

    def on_shutdown(self) -> Result:
        """Hear that it has stopped; asked for only if defined."""

    def on_activated(self) -> Result:
        """Become Active; an error leads to Error."""

    def on_deactivated(self) -> Result:
        """Leave Active; an error leads to Error."""

    def on_execute(self) -> Result:
        """Work, once a period while Active; an error leads to Error."""

    def on_aborting(self) -> Result:
        """Enter Error; the result does not matter."""

    def on_error(self) -> Result:
        """Work, once a period while in Error."""

    def on_reset(self) -> Result:
        """Leave Error; after an error it stays there."""


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
