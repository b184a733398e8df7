"""What a node does with its objects: the device profiles that are here, and which one it has."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.slave import ServiceMaker
from tickrig.device.canopen.ds401 import Ds401, families
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.ds402.modes.modes import MODES, supported
from tickrig.device.canopen.ds402.objects import indices
from tickrig.emulators.canopen.choices import AUTO

DEVICE_TYPE: Final = 0x1000

PROFILES: Final[dict[str, ServiceMaker]] = {"none": Application, "401": Ds401, "402": Ds402}
"""Device profiles by the number that the low word of 1000h holds."""

PROFILE_AREA: Final = range(0x6000, 0xA000)
AXIS: Final = 0x800
"""How far the objects of two axes, or logical devices, are apart (CiA 301)."""
PDO_PARAMETERS: Final = (*range(0x1400, 0x1600), *range(0x1800, 0x1A00))
TRANSMISSION_TYPE: Final = 2
EVENT_DRIVEN: Final = 255
"""The transmission type that CiA 401 and CiA 402 give their PDOs."""

DRIVE_DEFAULTS: Final = {**indices.DEFAULTS, (indices.SUPPORTED_MODES, 0): supported(MODES)}
DRIVE_OBJECTS: Final = (*(indices.CONTROLWORD, indices.STATUSWORD, indices.MODES_OF_OPERATION),)
MODULE_OBJECTS: Final = (
    *(families.READ_INPUT.by_8, families.WRITE_OUTPUT.by_8),
    *(families.ANALOGUE_INPUT.integers[1], families.ANALOGUE_OUTPUT.integers[1]),
)
"""Arrays of the usual inputs and outputs."""


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


def looks_like(dictionary: Dictionary) -> str:
    """Return the name of the profile that the objects of a dictionary are of, empty if none is.

    >>> looks_like(Dictionary([]))
    ''
    """
    if all(index in dictionary.objects for index in DRIVE_OBJECTS):
        return "402"
    return "401" if any((index, 1) in dictionary for index in MODULE_OBJECTS) else ""


def default_of(application: ServiceMaker, index: int, sub: int) -> int | None:
    """Return the default that a profile gives an entry, -1 for all bits; None if it gives none.

    >>> default_of(Ds402, 0x6081, 0), default_of(Ds401, 0x6206, 1), default_of(Ds402, 0x2000, 0)
    (10000, -1, None)
    """
    name = profile_name(application)
    if name == "none":
        return None
    if index not in PROFILE_AREA:
        is_transmission = index in PDO_PARAMETERS and sub == TRANSMISSION_TYPE
        of_communication = EVENT_DRIVEN if is_transmission else None
        return int(name) if (index, sub) == (DEVICE_TYPE, 0) else of_communication
    first = PROFILE_AREA.start + (index - PROFILE_AREA.start) % AXIS
    if application is Ds401:
        of_all = first == families.DIGITAL_INTERRUPT_ENABLE
        return families.DEFAULTS.get(first) if sub or of_all else None
    return DRIVE_DEFAULTS.get((first, sub))
