"""Options of a range finder."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.fields import DeviceField

USB_BAUD: Final = 12_000_000
"""Bit rate of USB at full speed."""

FIELDS: Final = (
    DeviceField(name="serial", unit="TEXT", default="H0614967", help="Serial number.  [H0614967]"),
    DeviceField(
        name="noise",
        kind=float,
        low=0,
        high=1,
        default=0.0,
        help="Noise, as a share of the sensor's accuracy of 10 mm or 1 %.  [0]",
        needs=("size", "walls", "posts"),
    ),
    DeviceField(
        name="scip",
        choices=("1.1", "2.0"),
        default="1.1",
        help="SCIP version after power-up: 1.1 (URG-04LX) or 2.0 (URG-04LX-UG01).  [1.1]",
    ),
    DeviceField(
        name="baud",
        kind=int,
        low=1_200,
        high=USB_BAUD,
        default=USB_BAUD,
        help="Bit rate of RS-232C after power-up in bit/s; the command SS changes the rate."
        "  [12000000, as USB]",
    ),
    DeviceField(
        name="size",
        option="room",
        unit="WIDTH,DEPTH",
        help="Put four walls around the origin, in m.",
    ),
    DeviceField(
        name="walls",
        option="wall",
        many=True,
        unit="X1,Y1,X2,Y2",
        help="Add a wall, in m; may be repeated.",
    ),
    DeviceField(
        name="posts",
        option="post",
        many=True,
        unit="X,Y,RADIUS",
        help="Add a round post, in m; may be repeated.",
    ),
)
