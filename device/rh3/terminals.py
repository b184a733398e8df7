"""The physical side of a base: what the world does to it, and what can be seen of it."""

from __future__ import annotations

from typing import Final

from tickrig.device.physical import InputSignal, OutputSignal, SignalType

SIDES: Final = ("left", "right")

INPUTS: Final = (
    InputSignal("emergency_stop", "the red button is down", SignalType.FAULT),
    InputSignal("bumper", "the bumper touches something", SignalType.BUTTON),
    *(
        InputSignal(
            f"load_{side}_nm",
            f"torque against the {side} wheel",
            low=-100,
            high=100,
            unit="Nm",
            real=True,
        )
        for side in SIDES
    ),
    *(
        InputSignal(f"jam_{side}", f"something holds the {side} wheel", SignalType.FAULT)
        for side in SIDES
    ),
    *(
        InputSignal(
            f"encoder_unplugged_{side}", f"no signal of the {side} encoder", SignalType.FAULT
        )
        for side in SIDES
    ),
    *(
        InputSignal(
            f"short_circuit_{side}", f"windings of the {side} motor touch", SignalType.FAULT
        )
        for side in SIDES
    ),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

OUTPUTS: Final = (
    OutputSignal("x_m", "true place", "m"),
    OutputSignal("y_m", "true place, to the left of x", "m"),
    OutputSignal("heading_rad", "true heading, not wrapped", "rad"),
    OutputSignal("speed_m_s", "true speed forward", "m/s"),
    OutputSignal("turn_rad_s", "true turning to the left", "rad/s"),
    OutputSignal("angle_left_rad", "true angle of the left wheel", "rad"),
    OutputSignal("angle_right_rad", "true angle of the right wheel", "rad"),
    OutputSignal("slip_left_m_s", "speed of the left rim over the ground", "m/s"),
    OutputSignal("slip_right_m_s", "speed of the right rim over the ground", "m/s"),
    OutputSignal("torque_left_pm", "torque of the left motor, of the rated one", "per mille"),
    OutputSignal("torque_right_pm", "torque of the right motor, of the rated one", "per mille"),
    OutputSignal("status", "status register 0200h"),
    OutputSignal("served", "requests that were answered or obeyed"),
    OutputSignal("garbled", "frames with a wrong length or CRC"),
)
