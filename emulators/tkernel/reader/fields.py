"""Options of a reader of ucodes."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.fields import DeviceField

FIELDS: Final = (
    DeviceField(
        name="markers",
        option="marker",
        many=True,
        unit="UCODE,X,Y",
        help="Add a marker at X,Y in m; may be repeated.",
    ),
    DeviceField(
        name="range_m",
        option="range",
        kind=float,
        low=0.1,
        high=99,
        default=3.0,
        unit="M",
        help="Distance up to which the reader receives a marker. [3]",
    ),
    DeviceField(
        name="cone_deg",
        option="cone",
        kind=int,
        low=1,
        high=360,
        default=90,
        unit="DEG",
        help="Full angle of reception around the reader's heading. [90]",
    ),
)
