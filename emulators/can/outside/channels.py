"""Rigs by name, for programs that know a CAN bus only by the name of its channel."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig


class CanChannels:
    """The buses that can be opened by name at present.

    python-can opens a bus by two strings, so the names have to be kept where
    the whole process finds them: in `CHANNELS`, the one place of this package
    with state of its own. What is there was put there by `offer`, for the time
    of a `with` block, and nothing is ever made up or left behind.

    >>> with CHANNELS.offer("robot", Rig(), CanWire()):
    ...     CHANNELS.names
    ('robot',)
    >>> CHANNELS.names
    ()
    """

    def __init__(self) -> None:
        self._channels: dict[str, tuple[Rig, CanWire]] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The names that are offered."""
        return tuple(self._channels)

    @contextmanager
    def offer(self, name: str, rig: Rig, wire: CanWire) -> Iterator[None]:
        """Let a bus of a rig be opened under a name.

        Raises:
            ValueError: the name is offered already.
        """
        if name in self._channels:
            raise ValueError(f"channel {name!r} is offered already")
        self._channels[name] = (rig, wire)
        try:
            yield
        finally:
            del self._channels[name]

    def open(self, name: str) -> CanHost:
        """Connect one more host to a bus.

        Raises:
            KeyError: no bus is offered under this name.
        """
        rig, wire = self._channels[name]
        return CanHost(rig, wire.end())


CHANNELS: Final = CanChannels()
"""The channels of the interface `tickrig`."""
