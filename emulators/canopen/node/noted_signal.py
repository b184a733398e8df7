"""Signals of a node of which it is noted what they are set to."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.device.physical import InputSignal
from tickrig.emulators.canopen.node.signals import Signal
from tickrig.host.text.values import Setting

OnSet = Callable[[str, Setting], None]
"""Hears what was set, by name."""


class NotedSignal:
    """A signal of which is noted what it is set to; see `Signal`.

    Args:
        signal: the signal.
        note: called after each time.
    """

    def __init__(self, signal: Signal, note: OnSet) -> None:
        self._signal, self._note = signal, note

    @property
    def item(self) -> InputSignal:
        """What it is."""
        return self._signal.item

    def read(self) -> Setting:
        """Return the present value."""
        return self._signal.read()

    def check(self, value: Setting) -> Setting:
        """Return the value, or raise ValueError."""
        return self._signal.check(value)

    def write(self, value: Setting) -> None:
        """Set it."""
        self._signal.write(value)
        self._note(self._signal.item.name, value)
