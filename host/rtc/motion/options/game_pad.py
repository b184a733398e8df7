"""GamePad: a hand on sticks or keys becomes velocities."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.host.links.errors import LinkError
from tickrig.host.rtc import ExecutionContext, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.options.game_pad_devices import (
    EvdevPad,
    GamePadDevice,
    GamePadOpener,
    KeyboardPad,
    StickPosition,
)
from tickrig.host.rtc.motion.ports import write_velocity
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types import iis

KEYBOARD: Final = "keyboard"

_LOG: Final = log_of(__name__)


def open_pad(name: str) -> GamePadDevice:
    """Open `keyboard`, or a device such as `/dev/input/event5`; LinkClosed if it cannot be."""
    return KeyboardPad() if name == KEYBOARD else EvdevPad(name)


class GamePad(RtComponent):
    """Writes a velocity each period while a hand pushes, and one of 0 when it lets go.

    The specification only names it; ports and parameters are ours.

    Args:
        instance_name: of the component.
        opener: opens the pad.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("GamePad", "Velocities from a game pad or keyboard")

    def __init__(self, instance_name: str, opener: GamePadOpener = open_pad) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.device = bind("DeviceFileName", KEYBOARD)
        self.max_v = bind("max_v", 0.3, "x>=0", unit="m/s")
        self.max_vy = bind("max_vy", 0.3, "x>=0", unit="m/s")
        self.max_w = bind("max_w", 0.3, "x>=0", unit="rad/s")
        self.dead_zone = bind("dead_zone", 0.1, "0<=x<=1")
        self.velocity = self.add_port(OutPort("velocity", iis.TimedVelocity2D))
        self._opener = opener
        self._pad: GamePadDevice | None = None
        self._pushed = False

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Open the pad, also after Error."""
        try:
            self._pad = self._opener(self.device.value)
        except LinkError as error:
            return self._failed(ec, error)
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Close the pad."""
        self._let_go(ec)
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Look where the hand pushes."""
        if self._pad is None:
            return ReturnCode.RTC_ERROR
        try:
            hand = self._pad.poll(ec.now_us)
        except LinkError as error:
            return self._failed(ec, error)
        forward, left, turn = (self._outside_dead_zone(part) for part in hand)
        pushed = any((forward, left, turn))
        if pushed or self._pushed:
            self._write(ec, StickPosition(forward, left, turn))
        self._pushed = pushed
        return ReturnCode.RTC_OK

    def _outside_dead_zone(self, part: float) -> float:
        return part if abs(part) > self.dead_zone.value else 0.0

    def _write(self, ec: ExecutionContext, hand: StickPosition) -> None:
        vx, vy = hand.forward * self.max_v.value, hand.left * self.max_vy.value
        write_velocity(self.velocity, ec, vx, vy, hand.turn * self.max_w.value)

    def _let_go(self, ec: ExecutionContext) -> None:
        if self._pushed:
            self._write(ec, StickPosition())
        if self._pad is not None:
            self._pad.close()
        self._pad, self._pushed = None, False

    def _failed(self, ec: ExecutionContext, error: LinkError) -> ReturnCode:
        _LOG.error("%s: %s", self.instance_name, error)
        self._let_go(ec)
        return ReturnCode.RTC_ERROR
