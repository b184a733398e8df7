"""The physical side of a base: what the world does to it, and what can be seen of it."""

from __future__ import annotations

from typing import Final

from tickrig.device.physical import Input, Output, SignalType

SIDES: Final = ("left", "right")

INPUTS: Final = (
    Input("emergency_stop", "the red button is down", SignalType.FAULT),
    Input("bumper", "the bumper touches something", SignalType.BUTTON),
    *(
        Input(
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
        Input(f"jam_{side}", f"something holds the {side} wheel", SignalType.FAULT)
        for side in SIDES
    ),
    *(
        Input(f"encoder_unplugged_{side}", f"no signal of the {side} encoder", SignalType.FAULT)
        for side in SIDES
    ),
    *(
        Input(f"short_circuit_{side}", f"windings of the {side} motor touch", SignalType.FAULT)
        for side in SIDES
    ),
    Input("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

OUTPUTS: Final = (
    Output("x_m", "true place", "m"),
    Output("y_m", "true place, to the left of x", "m"),
    Output("heading_rad", "true heading, not wrapped", "rad"),
    Output("speed_m_s", "true speed forward", "m/s"),
    Output("turn_rad_s", "true turning to the left", "rad/s"),
    Output("angle_left_rad", "true angle of the left wheel", "rad"),
    Output("angle_right_rad", "true angle of the right wheel", "rad"),
    Output("slip_left_m_s", "speed of the left rim over the ground", "m/s"),
    Output("slip_right_m_s", "speed of the right rim over the ground", "m/s"),
    Output("torque_left_pm", "torque of the left motor, of the rated one", "per mille"),
    Output("torque_right_pm", "torque of the right motor, of the rated one", "per mille"),
    Output("status", "status register 0200h"),
    Output("served", "requests that were answered or obeyed"),
    Output("garbled", "frames with a wrong length or CRC"),
)
