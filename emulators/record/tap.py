"""Listen to what passes a port."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic

from tickrig.device.core import W
from tickrig.device.twin import itself
from tickrig.emulators.record.trace import Mark
from tickrig.emulators.rig.port import Port


class Tap(Generic[W]):
    """A port with a listener, seen from the host's side.

    Args:
        port: the port behind it, where the host is.
        hear: told the time, the direction and the traffic.
    """

    def __init__(self, port: Port[W], hear: Callable[[int, Mark, W], None]) -> None:
        self._port, self._hear = port, hear

    def __reduce__(self) -> tuple[Callable[[Port[W]], Port[W]], tuple[Port[W]]]:
        """Copy the port alone: nobody listens to a twin."""
        return itself, (self._port,)

    @property
    def due_us(self) -> int:
        """When the next traffic reaches the port behind."""
        return self._port.due_us

    def poll(self, now_us: int, /) -> W:
        """Take what the host sent."""
        if traffic := self._port.poll(now_us):
            self._hear(now_us, Mark.TO_DEVICE, traffic)
        return traffic

    def send(self, now_us: int, traffic: W, /) -> None:
        """Hand on what the device sent."""
        self._hear(now_us, Mark.FROM_DEVICE, traffic)
        self._port.send(now_us, traffic)
