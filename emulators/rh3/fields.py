"""Options of a base of RH3."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.fields import DeviceField


def _number(name: str, text: str) -> DeviceField:
    return DeviceField(name=name, kind=float, unit="NUMBER", help=text)


PARAMETERS: Final = (
    _number("radius_left_m", "Effective radius of the left wheel.  [0.0995]"),
    _number("radius_right_m", "Effective radius of the right wheel.  [0.0995]"),
    _number("tread_m", "Effective distance between the wheels.  [0.464]"),
    _number("friction", "Coefficient between wheels and ground; without it they never slip."),
    _number("response_s", "Time constant of the speed loop.  [0.05]"),
    DeviceField(name="delay_ms", kind=int, unit="MS", help="Delay of a command's effect. [0]"),
    _number("noise", "Spread of a wheel's distance over the ground, as a share of it. [0]"),
)
"""Options for `BaseParameters`, which the verbs of `rh3` use, too."""

FIELDS: Final = (
    DeviceField(
        name="baud",
        kind=int,
        low=1_200,
        high=4_000_000,
        default=115_200,
        help="Bit rate of the line, 8N1.  [115200]",
    ),
    DeviceField(name="address", kind=int, unit="1..247", help="Modbus address.  [1]"),
    *PARAMETERS,
)
