"""Ports of shared wires; the rig asks at run time which ones are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from tickrig.device.core import Device, W
from tickrig.emulators.rig.port import Wire


@runtime_checkable
class WirePort(Protocol[W]):
    """A `Port` that says when traffic has arrived, so that nobody need look.

    It is not derived from it: a compiled base has more names than what is looked for.
    """

    @property
    def wire(self) -> Wire:
        """The wire it is an end of."""
        ...

    def attach(self, device: Device[W], wake: Callable[[int], None], /) -> None:
        """Serve a device: call `wake` with the time when traffic has arrived for it."""
