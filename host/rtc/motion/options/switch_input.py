"""SwitchInput, which selects the joystick or the planner."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.ports import plausible, read_newest, write_velocity
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Velocity2D

_LOG: Final = log_of(__name__)


class SwitchInput(RtComponent):
    """Component that selects between the velocities of a joystick and of a planner.

    The joystick has priority. When the joystick is released, the cart stands for the time `hold`,
    and then follows the planner again. If a deflected joystick sends no message for the time
    `stale`, the joystick counts as released. A velocity with an invalid number counts as 0. The RH3
    specification gives only the name of this component (SwitchInputRTC), so its ports and
    parameters are additions of Tickrig.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("SwitchInputRTC", "Joystick or planner")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.hold = self.configuration.bind("hold", 0.5, "x>=0", unit="s")
        self.stale = self.configuration.bind("stale", 0.1, "x>0", unit="s")
        self.joystick = self.add_port(InPort("joystick", iis.TimedVelocity2D))
        self.automatic = self.add_port(InPort("automatic", iis.TimedVelocity2D))
        self.velocity = self.add_port(OutPort("velocity", iis.TimedVelocity2D))
        self._forget()

    def _forget(self) -> None:
        self.is_manual = False
        self._pushed = Velocity2D()
        self._received_us = self._let_go_us = 0

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin with the planner."""
        self._forget()
        self.joystick.clear()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the velocity of the active input."""
        planned = read_newest(self.automatic)
        self._listen(ec)
        self._switch(ec)
        if self.is_manual:
            self._write(ec, self._pushed)
        elif planned is not None:
            self._write(ec, _made_plausible(planned.data))
        return ReturnCode.RTC_OK

    def _listen(self, ec: ExecutionContext) -> None:
        if (latest := read_newest(self.joystick)) is not None:
            self._pushed, self._received_us = _made_plausible(latest.data), ec.now_us
        elif ec.now_us - self._received_us > self.stale.value * 1e6:
            self._pushed = Velocity2D()

    def _switch(self, ec: ExecutionContext) -> None:
        pushed, before = self._pushed != Velocity2D(), self.is_manual
        if pushed:
            self.is_manual, self._let_go_us = True, ec.now_us
        elif ec.now_us - self._let_go_us > self.hold.value * 1e6:
            self.is_manual = False
        if self.is_manual != before:
            driver = "the joystick" if self.is_manual else "the planner"
            _LOG.info("%s: %s drives", self.instance_name, driver)

    def _write(self, ec: ExecutionContext, data: Velocity2D) -> None:
        write_velocity(self.velocity, ec, data.vx, data.vy, data.va)


def _made_plausible(data: Velocity2D) -> Velocity2D:
    return data if plausible(data.vx, data.vy, data.va) else Velocity2D()
