"""The devices that can be built by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from tickrig.emulators.record.trace import Config, Header
from tickrig.emulators.rh3.build import NAME as RH3
from tickrig.emulators.rh3.build import build_rh3
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.rrc.build import NAME as RRC
from tickrig.emulators.rrc.build import build_rrc
from tickrig.emulators.rtc_lite.build import NAME as RTC_LITE
from tickrig.emulators.rtc_lite.build import build_rtc_lite
from tickrig.emulators.urg.build import NAME as URG
from tickrig.emulators.urg.build import build_urg

DEVICES: Final[Mapping[str, Callable[[Config], Emulated[bytes]]]] = {
    RRC: build_rrc,
    RTC_LITE: build_rtc_lite,
    RH3: build_rh3,
    URG: build_urg,
}


def build(header: Header) -> Emulated[bytes]:
    """Build the device that a trace was recorded on.

    Raises:
        ValueError: there is none of this name, or its configuration cannot be.
    """
    if header.device not in DEVICES:
        known = ", ".join(DEVICES)
        raise ValueError(f"recorded on {header.device!r}; this program knows {known}")
    return DEVICES[header.device](header.config)
