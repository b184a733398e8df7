"""RT components on devices: base class, and the runner of its callbacks (OMG RTC 1.1).

RTC-Lite nodes and DeviceRTCs on CANopen use these classes. Each of the two adds its ports, the
storage of the port values, and the life cycle.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, ClassVar, Final, Generic, TypeVar

from tickrig.device.physical import InputSignal, QuantityBank
from tickrig.device.twin import Copyable
from tickrig.wire.instant import NEVER

P = TypeVar("P")


class DeviceReturnCode(IntEnum):
    """Return code of a callback (OMG RTC 1.1, ReturnCode_t)."""

    RTC_OK = 0
    RTC_ERROR = 1
    BAD_PARAMETER = 2
    UNSUPPORTED = 3
    OUT_OF_RESOURCES = 4
    PRECONDITION_NOT_MET = 5


ERROR: Final = DeviceReturnCode.RTC_ERROR
"""Return codes that mean that a callback has failed."""

Result = DeviceReturnCode | None
"""Return value of a callback; None means success."""


class DeviceComponent(Copyable):
    """Base class of RT components that run on a device, such as a CANopen node.

    A subclass declares ports as attributes of the class, and each component gets its own copies of
    them. Callbacks are optional. Declare a callback that cannot fail as `-> None`. A callback that
    has failed returns `ERROR`. Power-on makes a new component, so attributes of `self` behave like
    the device's RAM.

    Attributes:
        type_name: type of the component.
        physical: physical inputs that the device has in addition to its wire.
        inputs: values of the physical inputs.
    """

    type_name: ClassVar[str] = ""
    physical: ClassVar[tuple[InputSignal, ...]] = ()
    inputs: QuantityBank

    def _own_ports(self, port_class: type[P]) -> list[P]:
        """Set the component's own copies of the declared ports, and return them."""
        own = {name: copy(port) for name, port in declared(type(self), port_class)}
        for name, port in own.items():
            setattr(self, name, port)
        return list(own.values())

    def on_initialize(self) -> Result:
        """Initialize: Created becomes Inactive; after an error the state stays Created."""

    def on_finalize(self) -> Result:
        """Finalize; called once."""

    def on_activated(self) -> Result:
        """Activate: Inactive becomes Active; an error leads to the state Error."""

    def on_deactivated(self) -> Result:
        """Deactivate: leave Active; an error leads to the state Error."""

    def on_execute(self) -> Result:
        """Execute, once a period while Active; an error leads to the state Error."""

    def on_aborting(self) -> Result:
        """Abort, on the way from Active to Error; the return value is ignored."""

    def on_error(self) -> Result:
        """Handle the error, once a period while in Error; CANopen ignores the return value."""

    def on_reset(self) -> Result:
        """Reset: Error becomes Inactive; after an error the state stays Error."""


C = TypeVar("C", bound=DeviceComponent)


class CallbackRunner(Generic[C]):
    """Calls the callbacks of a component by name, and counts the calls.

    Attributes:
        component: the component.
        latest: name of the callback that ran last, or empty before the first callback.
        calls: number of calls of all callbacks.
        executed: number of calls of `on_execute`.
    """

    def __init__(self, component: C) -> None:
        self.component = component
        self.latest, self.calls, self.executed = "", 0, 0

    def call(self, callback: str) -> bool:
        """Run a callback by its name; return False if it failed."""
        self.latest = callback
        self.calls += 1
        self.executed += callback == "on_execute"
        result: Result = getattr(self.component, callback)()
        return result in (None, DeviceReturnCode.RTC_OK)


@dataclass(slots=True)
class Timer:
    """Timer that determines when the periodic callback of a component runs.

    It is the execution context of a DeviceRTC, and of an RTC-Lite component whose execution context
    has the type 22h (a timer of the device). The periods are counted from the start of the timer,
    so the timer does not drift. Missed periods are skipped.

    Attributes:
        rate_hz: number of periods in a second. A new rate applies from the next start.
        due_us: time at which the present period ends, or `NEVER` while the timer is stopped.
    """

    rate_hz: int
    due_us: int = field(default=NEVER, init=False)
    _start_us: int = field(default=0, init=False)

    def start(self, now_us: int) -> None:
        """Start the first period."""
        self._start_us = now_us
        self._note_due(now_us)

    def stop(self) -> None:
        """Stop the timer."""
        self.due_us = NEVER

    def run(self, now_us: int) -> None:
        """Start the timer unless it runs."""
        if self.due_us == NEVER:
            self.start(now_us)

    def elapsed(self, now_us: int) -> bool:
        """Return whether a period has ended, and schedule the first end after `now_us`."""
        if now_us < self.due_us:
            return False
        self._note_due(now_us)
        return True

    def _note_due(self, now_us: int) -> None:
        """Schedule the first end of a period after `now_us`."""
        periods = (now_us - self._start_us) * self.rate_hz // 1_000_000 + 1
        self.due_us = self._start_us - -periods * 1_000_000 // self.rate_hz


def declared(owner: type, kind: type[P]) -> Iterator[tuple[str, P]]:
    """Yield the attributes of a class that have a given type, such as the ports of a component.

    Attributes of base classes come first.

    Args:
        owner: class whose attributes are searched.
        kind: type of the attributes.

    Yields:
        The name and the value of each attribute.

    >>> class Lamp:
    ...     bright, name = 5, "lamp"
    >>> list(declared(Lamp, int))
    [('bright', 5)]
    """
    for base in reversed(owner.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, kind):
                yield name, value


def shown(value: Any) -> float | str:
    """Return the value of a data port as a number or text for display.

    The emulated device lists its ports among its physical outputs, which a user can read.

    A boolean becomes a number. A sequence becomes a text of its elements, separated by blanks.
    """
    if isinstance(value, tuple):
        return " ".join(str(shown(element)) for element in value)
    return int(value) if isinstance(value, bool) else value
