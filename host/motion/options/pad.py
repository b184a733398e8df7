"""What a hand does on sticks or keys, and who reads it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol


class StickPosition(NamedTuple):
    """Where a hand pushes, each -1..1: forward, to the left, turning to the left."""

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0


class GamePadDevice(Protocol):
    """A device with sticks or keys; reading it does not wait."""

    def poll(self, now_us: int, /) -> StickPosition:
        """Return where the hand pushes now; LinkClosed if the device is gone."""
        ...

    def close(self) -> None:
        """Give the device back."""


GamePadOpener = Callable[[str], GamePadDevice]
"""Opens the pad that DeviceFileName names; LinkClosed if it cannot."""
