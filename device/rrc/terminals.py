"""The physical side of the RRC and of the VR2 around it."""

from __future__ import annotations

from typing import Final

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.wire.rrc.replies import RrcEvent

BUTTON: Final = SignalType.BUTTON
FAULT: Final = SignalType.FAULT

INPUTS: Final = (
    InputSignal("rrc_power", "supply of the RRC, from the VR2 battery or USB", initial=1),
    InputSignal("power_button", "power button of the controller", BUTTON),
    InputSignal("alarm_button", "alarm button of the controller", BUTTON),
    InputSignal("speed_up_button", "speed mode up, on the controller", BUTTON),
    InputSignal("speed_down_button", "speed mode down, on the controller", BUTTON),
    InputSignal("stick_v_pct", "stick, forward is positive", low=-100, high=100, unit="%"),
    InputSignal("stick_w_pct", "stick, right is positive", low=-100, high=100, unit="%"),
    InputSignal("gauge", "voltage gauge of the battery", low=1, high=10, initial=10),
    InputSignal(
        "extra_load_pct", "work of the RRC beside its own, per period", high=1_000, unit="%"
    ),
    InputSignal("bus_noise", "noise on the VR2 bus", FAULT),
    InputSignal("joystick_fault", "the joystick module says nonsense", FAULT),
    InputSignal("power_module_fault", "the power module says nonsense", FAULT),
    InputSignal("vr2_fault", "VR2 has an error of its own, as a motor without its cable", FAULT),
    InputSignal("bus_unplugged", "a connector of the VR2 bus is out", FAULT),
)

RUNNING_FAULTS: Final = {
    "bus_noise": RrcEvent.BY_COMMUNICATION_ERROR,
    "joystick_fault": RrcEvent.BY_JOYSTICK_MODULE_ERROR,
    "power_module_fault": RrcEvent.BY_POWER_MODULE_ERROR,
    "vr2_fault": RrcEvent.BY_SYSTEM_ERROR,
    "bus_unplugged": RrcEvent.BY_NO_COMMUNICATION,
}
"""What each fault is called once it has lasted (condition 8, DECISION R25)."""

POWER_ON_FAULTS: Final = {
    "bus_noise": RrcEvent.POWER_ON_ERROR1,
    "joystick_fault": RrcEvent.POWER_ON_ERROR1,
    "power_module_fault": RrcEvent.POWER_ON_ERROR2,
    "vr2_fault": RrcEvent.POWER_ON_ERROR2,
}
"""What each fault does to a power-on. The manual names two causes without saying which."""

OUTPUTS: Final = {
    output.name: output
    for output in (
        OutputSignal("state", "state of the RRC"),
        OutputSignal("vr2_power", "1 while VR2 runs"),
        OutputSignal("error_led", "1 while the controller's LED blinks an error"),
        OutputSignal(
            "stick_drives", "1 while the stick drives, 0 while it waits or the host drives"
        ),
        OutputSignal("out_v_pct", "translation to the power module", "%"),
        OutputSignal("out_w_pct", "rotation to the power module", "%"),
        OutputSignal("speed_mode", "speed mode of VR2, 1 to 5"),
        OutputSignal("gear", "imitated gear: N, F or R"),
        OutputSignal("buzzer", "1 while the RRC's buzzer sounds"),
        OutputSignal("load_pct", "work of the RRC, mean of 100 ms; 0 while VR2 is off", "%"),
        OutputSignal("margin_pct", "100 minus load_pct; below 0 the RRC falls behind", "%"),
        OutputSignal("backlog_pct", "work that the RRC is behind, of a period; 300 stops VR2", "%"),
        OutputSignal("pace_lines_s", "lines a second that a host may send, at 90 % load", "1/s"),
    )
}


def new_inputs() -> InputBank:
    """Return the inputs of a fresh RRC: supplied, everything at rest, battery full."""
    return InputBank(INPUTS, groups={"stick": ("stick_v_pct", "stick_w_pct")})
