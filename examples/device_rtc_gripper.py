"""A gripper as DeviceRTC: an RT component on the microcontroller of a CANopen slave.

Run it with `canopen-slave-emu --rtc examples/device_rtc_gripper.py:Gripper --node-id 16`.
"""

from __future__ import annotations

from tickrig import InputSignal
from tickrig.device.canopen import device_rtc  # internal
from tickrig.device.component import ERROR, Result  # internal
from tickrig.wire.rtc_canopen import BOOLEAN, SHORT  # internal

STEP_UM, HOT_DC = 500, 900


class Gripper(device_rtc.CanopenComponent):
    """Opens to what the in-port says once NMT Start activated it; ends in Error while hot."""

    type_name = "Gripper"
    category = "actuator"
    physical = (InputSignal("motor_dc", "at the motor", low=-400, high=1_250, unit="0.1 degC"),)
    target_um = device_rtc.CanopenInPort("target_um", SHORT)
    width_um = device_rtc.CanopenOutPort("width_um", SHORT)
    moving = device_rtc.CanopenOutPort("moving", BOOLEAN)

    def on_execute(self) -> Result:
        """Move towards the target."""
        width_um, target_um = self.width_um.value, self.target_um.read()
        step_um = max(-STEP_UM, min(STEP_UM, target_um - width_um))
        if step_um or self.moving.value:
            self.width_um.write(width_um + step_um)
            self.moving.write(step_um != 0)
        return self.error_check()

    def error_check(self) -> Result:
        """Look at the temperature; Error is left when it is lower."""
        return ERROR if self.inputs["motor_dc"] > HOT_DC else None

    on_reset = error_check
