"""Ports of shared wires; the rig asks at run time which ones are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeGuard

from tickrig.device.core import Device, W
from tickrig.emulators.rig.port import Wire


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


def is_wire_port(port: object) -> TypeGuard[WirePort[Any]]:
    """Say whether a port has the members of `WirePort`, by `__getattr__` too."""
    return hasattr(port, "wire") and hasattr(port, "attach")
