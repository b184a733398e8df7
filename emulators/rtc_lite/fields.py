"""Options of an RTC-Lite node."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.fields import DeviceField
from tickrig.wire.rtc_lite.frame import Checksum, Framing

FIELDS: Final = (
    DeviceField(
        name="node",
        unit="NAME",
        default="echo",
        proposals=("echo", "lite-a", "lite-b"),
        help="Component: echo, lite-a, lite-b, or FILE.py:Class.  [echo]",
    ),
    DeviceField(
        name="baud",
        kind=int,
        low=300,
        high=4_000_000,
        default=57_600,
        help="Bit rate of the line in bit/s, 8N1.  [57600]",
    ),
    DeviceField(
        name="timer_hz",
        option="timer",
        kind=int,
        low=1,
        high=1_000,
        unit="HZ",
        help="Execute by a timer of the device at HZ (type 22h), not by the proxy (21h).",
    ),
    DeviceField(
        name="framing",
        choices=tuple(framing.value for framing in Framing),
        default=Framing.LITE.value,
        help="Exchange frames of RTC-Lite, or packets of RTno.  [lite]",
    ),
    DeviceField(
        name="checksum",
        choices=tuple(checksum.value for checksum in Checksum),
        default=Checksum.SUM8.value,
        help="Checksum of frames. [sum8]",
    ),
)
