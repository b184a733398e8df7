"""What can be set of an RRC."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.fields import DeviceField

FIELDS: Final = (
    DeviceField(
        name="power_on_event",
        choices=("PowerOnTrigger", "PowerOn"),
        default="PowerOnTrigger",
        help="Name of the power-on event, as in the field or as in the manual.",
    ),
)
