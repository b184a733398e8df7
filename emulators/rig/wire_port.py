"""Ports of shared wires; the rig asks at run time which ones are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from tickrig.device.core import Device, W
from tickrig.emulators.rig.port import Port, Wire


@runtime_checkable
class WirePort(Port[W], Protocol[W]):
    """A port that says when traffic has arrived, so that nobody need look."""

    @property
    def wire(self) -> Wire:
        """The wire it is an end of."""
        ...

    def attach(self, device: Device[W], wake: Callable[[int], None], /) -> None:
        """Serve a device: call `wake` with the time when traffic has arrived for it."""
