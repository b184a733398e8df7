"""Options of an RRC."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.fields import DeviceField

FIELDS: Final = (
    DeviceField(
        name="power_on_event",
        choices=("PowerOnTrigger", "PowerOn"),
        default="PowerOnTrigger",
        help="Name of the power-on event: PowerOnTrigger as in the field, or PowerOn as in the"
        " manual's table.",
    ),
    DeviceField(
        name="vehicle",
        kind=bool,
        help="Add a vehicle behind VR2: speed, distance and battery (not in the manual).",
    ),
    DeviceField(
        name="battery_wh",
        kind=int,
        low=1,
        high=100_000,
        default=1_200,
        unit="WH",
        help="Capacity of the vehicle's battery.  [1200]",
        needs=("vehicle",),
    ),
)
