"""The physical side of a sensor: where it is, who steps in its way, and what breaks."""

from __future__ import annotations

from typing import Final

from tickrig.device.physical import InputSignal, OutputSignal, SignalType

FAR_M: Final = 10_000


def _place(name: str, text: str) -> InputSignal:
    return InputSignal(name, text, low=-FAR_M, high=FAR_M, unit="m", real=True)


INPUTS: Final = (
    _place("x_m", "place of the sensor"),
    _place("y_m", "place of the sensor, to the left of x"),
    InputSignal("heading_rad", "where it looks", low=-1e6, high=1e6, unit="rad", real=True),
    _place("post_x_m", "place of somebody who stands there"),
    _place("post_y_m", "place of somebody, to the left of x"),
    InputSignal("post_radius_m", "how wide; 0 if nobody is there", high=FAR_M, unit="m", real=True),
    InputSignal("laser_broken", "the laser gives no light", SignalType.FAULT),
    InputSignal("motor_jammed", "something holds the mirror", SignalType.FAULT),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

GROUPS: Final = {
    "pose": ("x_m", "y_m", "heading_rad"),
    "post": ("post_x_m", "post_y_m", "post_radius_m"),
}

OUTPUTS: Final = (
    OutputSignal("laser", "1 while the laser is on"),
    OutputSignal("speed_rpm", "turns of the mirror, 0 while it stands", "1/min"),
    OutputSignal("ahead_m", "true distance straight ahead, -1 if nothing is there", "m"),
    OutputSignal("scans", "scans that were measured since power-up"),
    OutputSignal("served", "commands that were answered since power-up"),
)
