"""What a node does with its objects: the device profiles that are here, and which one it has."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.slave import ServiceMaker
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.emulators.canopen.choices import AUTO

DEVICE_TYPE: Final = 0x1000

PROFILES: Final[dict[str, ServiceMaker]] = {"none": Application, "401": Ds401, "402": Ds402}
"""Device profiles by the number that the low word of 1000h holds."""


def application_of(dictionary: Dictionary, profile: str = AUTO) -> ServiceMaker:
    """Return a profile of `choices.PROFILES`; `auto` takes that of the device type, if it is there.

    >>> application_of(Dictionary([])).__name__
    'Application'
    """
    if profile == AUTO:
        entry = dictionary.find(DEVICE_TYPE)
        number = entry.number & 0xFFFF if entry else 0
        return PROFILES.get(str(number), Application)
    return PROFILES[profile]


def profile_name(application: ServiceMaker) -> str:
    """Return the name of a profile, `none` for what is none of `PROFILES`.

    >>> profile_name(Ds401)
    '401'
    """
    return next((name for name, make in PROFILES.items() if make is application), "none")
