"""Sticks and buttons of a game pad on Linux (extra `gamepad`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from tickrig.host.links.link import LinkClosed

EV_KEY: Final = 0x01
EV_ABS: Final = 0x03
ABS_X: Final = 0x00
ABS_Y: Final = 0x01
ABS_RX: Final = 0x03
"""Codes of the kernel's input-event-codes.

The axes are: left stick sideways, left stick forward, right stick sideways.
"""

_Range = tuple[int, int]


class StickPosition(NamedTuple):
    """Motion that the sticks of a game pad request: forward, left and left turn, each in -1..1."""

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0


@dataclass(slots=True)
class Axes:
    """Current positions of the sticks of a game pad, and the buttons that are pressed.

    Attributes:
        ranges: lowest and highest raw value of each axis, by its code.
        held: codes of the buttons that are pressed.
    """

    ranges: Mapping[int, _Range]
    held: set[int] = field(default_factory=set, init=False)
    _values: dict[int, float] = field(default_factory=dict, init=False)

    def take(self, kind: int, code: int, value: int) -> None:
        """Process an input event of the pad."""
        if kind == EV_KEY:
            (self.held.add if value else self.held.discard)(code)
        if kind == EV_ABS and code in self.ranges:
            low, high = self.ranges[code]
            middle, half = (low + high) / 2, max(1, high - low) / 2
            self._values[code] = min(max((value - middle) / half, -1.0), 1.0)

    @property
    def hand(self) -> StickPosition:
        """Return the motion that the sticks request.

        The left stick requests driving forward and turning. The right stick requests driving
        sideways.
        """
        across, along = self._values.get(ABS_X, 0.0), self._values.get(ABS_Y, 0.0)
        return StickPosition(-along + 0.0, -self._values.get(ABS_RX, 0.0) + 0.0, -across + 0.0)


class EvdevPad:
    """Reader of a game pad at a Linux input device such as `/dev/input/event5`.

    Raises:
        LinkClosed: the package evdev is not installed, or the device cannot be opened.
    """

    def __init__(self, path: str) -> None:
        try:
            import evdev  # noqa: PLC0415 - the extra [gamepad]
        except ImportError as error:
            raise LinkClosed("a game pad needs evdev: pip install 'tickrig[gamepad]'") from error
        self._path = path
        try:
            self._device = evdev.InputDevice(path)
            codes = self._device.capabilities(absinfo=False).get(EV_ABS, ())
            limits = {code: self._device.absinfo(code) for code in codes}
        except OSError as error:
            raise LinkClosed(f"cannot open game pad {path}: {error.strerror}") from error
        self._axes = Axes({code: (info.min, info.max) for code, info in limits.items()})

    @property
    def held(self) -> bool:
        """Whether a button was held at the latest poll."""
        return bool(self._axes.held)

    def poll(self, now_us: int, /) -> StickPosition:
        """Return the positions of the sticks."""
        try:
            while (event := self._device.read_one()) is not None:
                self._axes.take(event.type, event.code, event.value)
        except OSError as error:
            raise LinkClosed(f"game pad {self._path} is gone: {error.strerror}") from error
        return self._axes.hand

    def close(self) -> None:
        """Close the device."""
        self._device.close()
