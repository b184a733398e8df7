"""Optional interface between a CAN bus and a device, detected at run time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeGuard

from tickrig.wire.can import ErrorState

Accepted = frozenset[int] | None
"""CAN-IDs that an end accepts, or None for all. A 29-bit CAN-ID has bit 29 set."""


class Filtering(Protocol):
    """Interface of a device that declares which CAN-IDs it receives, as for an acceptance filter.

    The emulated bus delivers only these frames, which saves time. A filter may let more frames pass
    than the device needs, but never fewer, because the device itself checks each frame. After a
    frame that may change the CAN-IDs, the filter lets all frames pass until the device has handled
    that frame.
    """

    @property
    def accepts(self) -> Accepted:
        """The CAN-IDs that the device receives now, or None for all CAN-IDs.

        The value is None from power-on or a reset to the first tick.
        """
        ...

    @property
    def reconfigured_by(self) -> frozenset[int]:
        """CAN-IDs of the frames that may change `accepts` when they are handled."""
        ...

    @property
    def on_accepts(self) -> list[Callable[[], None]]:
        """Callback for a change of `accepts` or `reconfigured_by`, in a tick or between ticks."""
        ...


class ErrorAware(Protocol):
    """A device that receives the error state of its CAN controller."""

    def bus_state(self, state: ErrorState, /) -> None:
        """Accept a new error state, which takes effect in the next tick."""


def is_filtering(device: object) -> TypeGuard[Filtering]:
    """Return whether a device has the members of `Filtering`; `__getattr__` may provide them."""
    return all(hasattr(device, name) for name in ("accepts", "reconfigured_by", "on_accepts"))


def is_error_aware(device: object) -> TypeGuard[ErrorAware]:
    """Return whether a device has `bus_state`; `__getattr__` may provide it."""
    return hasattr(device, "bus_state")
