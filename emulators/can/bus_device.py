"""What a CAN bus tells a device and asks it, if it answers; looked for at run time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeGuard

from tickrig.wire.can import ErrorState

Accepted = frozenset[int] | None
"""CAN-IDs that an end listens to, 29-bit ones with bit 29 set; None for all."""


class Filtering(Protocol):
    """A device that says which CAN-IDs it listens to.

    A filter may pass more than the device wants, never less: the device itself
    decides, frame by frame. So a frame that could change what it listens to lets
    all that follow it pass, until the device has handled it.
    """

    @property
    def accepts(self) -> Accepted:
        """The CAN-IDs; None, for all, from power-on or a reset to the first tick."""
        ...

    @property
    def reconfigured_by(self) -> frozenset[int]:
        """CAN-IDs of the frames that may change `accepts` when they are handled."""
        ...

    @property
    def on_accepts(self) -> list[Callable[[], None]]:
        """Whom to call when `accepts` or `reconfigured_by` has changed, in a tick or between."""
        ...


class ErrorAware(Protocol):
    """A device that is told the error state of its CAN controller."""

    def bus_state(self, state: ErrorState, /) -> None:
        """Hear of a change; it is seen to in the next tick."""


def is_filtering(device: object) -> TypeGuard[Filtering]:
    """Say whether a device has the members of `Filtering`, by `__getattr__` too."""
    return all(hasattr(device, name) for name in ("accepts", "reconfigured_by", "on_accepts"))


def is_error_aware(device: object) -> TypeGuard[ErrorAware]:
    """Say whether a device has `bus_state`, by `__getattr__` too."""
    return hasattr(device, "bus_state")
