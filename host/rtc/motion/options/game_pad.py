"""GamePad, which converts sticks or keys into velocities."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from typing import ClassVar, Final, Protocol

from tickrig.host.links.game_pad import EvdevPad, StickPosition
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.terminal import take_keys
from tickrig.host.rtc import ExecutionContext, ModuleSpec, OutPort
from tickrig.host.rtc.device_component import DeviceComponent
from tickrig.host.rtc.motion.ports import write_velocity
from tickrig.wire.rtc_types import iis

# Inputs of `GamePad`: sticks of a game pad on Linux (extra `gamepad`), or keys of a terminal.


class _GamePadDevice(Protocol):
    """A device with sticks or keys. Reading it does not wait."""

    def poll(self, now_us: int, /) -> StickPosition:
        """Return the present deflection. Raise LinkClosed if the device is gone."""
        ...

    def close(self) -> None:
        """Release the device."""


_GamePadOpener = Callable[[str], _GamePadDevice]
"""Function that opens the pad that DeviceFileName names, or raises LinkClosed."""


_KEYS: Final[Mapping[str, StickPosition]] = {
    "w": StickPosition(forward=1.0),
    "s": StickPosition(forward=-1.0),
    "a": StickPosition(turn=1.0),
    "d": StickPosition(turn=-1.0),
    "q": StickPosition(left=1.0),
    "e": StickPosition(left=-1.0),
    " ": StickPosition(),
}

_HOLD_US: Final = 300_000
"""Time for which a key stays pressed after its arrival. Terminals repeat keys faster."""


class KeyboardPad:
    """Game pad that the keys of a terminal simulate.

    The keys w and s drive forward and back. The keys a and d turn left and right. The keys q and e
    drive sideways to the left and right. The space bar stops.

    Args:
        fd: file descriptor of the terminal. By default, it is standard input.

    Attributes:
        close: function that restores the settings of the terminal.

    Raises:
        LinkClosed: the file is not a terminal.
    """

    def __init__(self, fd: int | None = None) -> None:
        self._fd = sys.stdin.fileno() if fd is None else fd
        try:
            self.close = take_keys(self._fd)
        except OSError as error:
            raise LinkClosed(f"the keyboard is no terminal: {error.strerror}") from error
        self._hand, self._until_us = StickPosition(), 0

    def poll(self, now_us: int, /) -> StickPosition:
        """Return the deflection of the latest key."""
        for key in os.read(self._fd, 256).decode("latin-1"):
            if key in _KEYS:
                self._hand, self._until_us = _KEYS[key], now_us + _HOLD_US
        return self._hand if now_us < self._until_us else StickPosition()


_KEYBOARD: Final = "keyboard"


def open_pad(name: str) -> _GamePadDevice:
    """Open `keyboard` or a device such as `/dev/input/event5`. Raise LinkClosed if that fails."""
    return KeyboardPad() if name == _KEYBOARD else EvdevPad(name)


class GamePad(DeviceComponent[_GamePadDevice]):
    """Component that writes the velocity that the user requests by a game pad.

    It writes the velocity in each period while a stick is deflected, and 0 once after the release
    of the stick. The RH3 specification gives only the name of this component, so its ports and
    parameters are additions of Tickrig.

    Args:
        instance_name: name of the component.
        opener: function that opens the pad.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("GamePad", "Velocities from a game pad or keyboard")

    def __init__(self, instance_name: str, opener: _GamePadOpener = open_pad) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.device = bind("DeviceFileName", _KEYBOARD)
        self.max_v = bind("max_v", 0.3, "x>=0", unit="m/s")
        self.max_vy = bind("max_vy", 0.3, "x>=0", unit="m/s")
        self.max_w = bind("max_w", 0.3, "x>=0", unit="rad/s")
        self.dead_zone = bind("dead_zone", 0.1, "0<=x<=1")
        self.velocity = self.add_port(OutPort("velocity", iis.TimedVelocity2D))
        self._opener = opener
        self._pushed = False

    def open_client(self) -> _GamePadDevice:
        """Open the pad."""
        return self._opener(self.device.value)

    def exchange(self, ec: ExecutionContext, client: _GamePadDevice) -> None:
        """Read the deflection."""
        forward, left, turn = (self._outside_dead_zone(part) for part in client.poll(ec.now_us))
        pushed = any((forward, left, turn))
        if pushed or self._pushed:
            self._write(ec, StickPosition(forward, left, turn))
        self._pushed = pushed

    def release(self, ec: ExecutionContext) -> None:
        """Release the sticks."""
        if self._pushed:
            self._write(ec, StickPosition())
        self._pushed = False

    def _outside_dead_zone(self, part: float) -> float:
        return part if abs(part) > self.dead_zone.value else 0.0

    def _write(self, ec: ExecutionContext, hand: StickPosition) -> None:
        vx, vy = hand.forward * self.max_v.value, hand.left * self.max_vy.value
        write_velocity(self.velocity, ec, vx, vy, hand.turn * self.max_w.value)
