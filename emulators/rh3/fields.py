"""Options of a base of RH3."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.fields import DeviceField


def _number(name: str, text: str) -> DeviceField:
    return DeviceField(name=name, kind=float, unit="NUMBER", help=text)


PARAMETERS: Final = (
    _number("radius_left_m", "Effective radius of the left wheel in m.  [0.0995]"),
    _number("radius_right_m", "Effective radius of the right wheel in m.  [0.0995]"),
    _number("tread_m", "Effective distance between the wheels in m.  [0.464]"),
    _number("friction", "Coefficient of friction between wheels and ground.  [no slip]"),
    _number("response_s", "Time constant of the speed loop in s.  [0.05]"),
    DeviceField(
        name="delay_ms", kind=int, unit="MS", help="Delay until a command takes effect. [0]"
    ),
    _number(
        "noise",
        "Random spread of a wheel's distance over the ground, such as 0.02 for 2 %. [0]",
    ),
)
"""Options for `BaseParameters`, which the verbs of `rh3` use, too."""

FIELDS: Final = (
    DeviceField(
        name="baud",
        kind=int,
        low=1_200,
        high=4_000_000,
        default=115_200,
        help="Bit rate of the line in bit/s, 8N1.  [115200]",
    ),
    DeviceField(name="address", kind=int, unit="1..247", help="Modbus address.  [1]"),
    *PARAMETERS,
)
