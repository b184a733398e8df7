"""The terminal of a system, which sends typed lines to components and shows their output."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Final, Protocol, TypeGuard

from tickrig.host.links.ready import ready
from tickrig.host.rtc.components import ConsoleOut
from tickrig.host.rtc.system.manager import Manager
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rtc_types.rtc import TimedLong

_READ_BYTES: Final = 4_096


class _TypedTo(Protocol):
    """A component that accepts typed lines, such as ConsoleIn and PositionInput."""

    def typed(self, line: str) -> None:
        """Process a line. Raise ValueError without a change if the line is invalid."""


def _is_typed_to(component: object) -> TypeGuard[_TypedTo]:
    """Return whether a component accepts typed lines."""
    return hasattr(component, "typed")


class Console:
    """Console of a running system, which shows the output of components, such as `ConsoleOut0 5`.

    A line that the user types goes to each component that accepts it. If no component accepts the
    line, the console prints the reason. A component may have the attributes `report` and `prompt`.
    The console sets `report` to a function that shows a line, and `prompt` to a function that shows
    a line only on a terminal.

    Args:
        manager: manager with the components.
        show: function that prints a line.
        warn: function that prints a line that is only for the user.

    Attributes:
        is_open: whether more lines may be typed. It is False once the standard input has ended.
    """

    def __init__(
        self, manager: Manager, show: Callable[[str], None], warn: Callable[[str], None]
    ) -> None:
        self._manager, self._show, self._warn = manager, show, warn
        self._typed, self.is_open = LineSplitter(), True
        for component in manager.components:
            name = component.instance_name
            if isinstance(component, ConsoleOut):
                component.show = partial(self._shown, name)
            for attribute, printed in (("report", show), ("prompt", warn)):
                if hasattr(component, attribute):
                    setattr(component, attribute, partial(_prefixed, printed, name))

    def read(self, descriptor: int) -> None:
        """Process the lines that the user has typed, without waiting."""
        if self.is_open and ready([descriptor], wait_s=0)[0] and _in_foreground(descriptor):
            data = os.read(descriptor, _READ_BYTES)
            self.is_open = bool(data)
            for line in self._typed.push(data or b"\n"):
                if data or line:
                    self._enter(line.decode("utf-8", "replace").strip())

    def _enter(self, line: str) -> None:
        refusals, taken = dict[str, None](), False
        for component in self._manager.components:
            if _is_typed_to(component):
                try:
                    component.typed(line)
                    taken = True
                except ValueError as error:
                    refusals[str(error)] = None
        if not taken:
            self._warn("; ".join(refusals) or f"{line!r}: no component takes what is typed")

    def _shown(self, name: str, value: TimedLong) -> None:
        self._show(f"{name} {value.data}")


def _prefixed(printed: Callable[[str], None], name: str, text: str) -> None:
    printed(f"{name} {text}")


def _in_foreground(descriptor: int) -> bool:
    """Return whether this process may read there.

    A terminal stops a background process that reads.
    """
    if sys.platform != "win32":
        with suppress(OSError):  # a terminal that does not control this process
            return not os.isatty(descriptor) or os.tcgetpgrp(descriptor) == os.getpgrp()
    return True
