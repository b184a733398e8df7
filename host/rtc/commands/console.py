"""The terminal of a system: numbers typed go to ConsoleIn, those of ConsoleOut are shown."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Final

from tickrig.host.links.ready import ready
from tickrig.host.rtc.components import ConsoleIn, ConsoleOut
from tickrig.host.rtc.system.manager import Manager
from tickrig.wire.rtc_types.basic import TimedLong
from tickrig.wire.serial.lines import LineSplitter

READ_BYTES: Final = 4_096
LOW: Final = -(2**31)
HIGH: Final = 2**31 - 1


class Console:
    """Shows what arrives at each ConsoleOut, as `ConsoleOut0 5`.

    Args:
        manager: whose components.
        show: prints a line.
        warn: prints a line that is for people alone.
    """

    def __init__(
        self, manager: Manager, show: Callable[[str], None], warn: Callable[[str], None]
    ) -> None:
        self._manager, self._show, self._warn = manager, show, warn
        self._typed, self._open = LineSplitter(), True
        for component in manager.components:
            if isinstance(component, ConsoleOut):
                component.show = partial(self._shown, component.instance_name)

    def read(self, descriptor: int) -> None:
        """Take numbers that were typed, one a line, to each ConsoleIn; never wait."""
        if self._open and ready([descriptor], wait_s=0)[0]:
            data = os.read(descriptor, READ_BYTES)
            self._open = bool(data)
            for line in self._typed.push(data):
                self._enter(line.decode("utf-8", "replace").strip())

    def _enter(self, word: str) -> None:
        try:
            number = int(word)
        except ValueError:
            number = HIGH + 1
        if not LOW <= number <= HIGH:
            self._warn(f"{word!r} is not a number in {LOW}..{HIGH}")
            return
        for component in self._manager.components:
            if isinstance(component, ConsoleIn):
                component.enter(number)

    def _shown(self, name: str, value: TimedLong) -> None:
        self._show(f"{name} {value.data}")
