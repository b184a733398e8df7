"""The objects of a drive: those of its EDS with values, and those that its modes need."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary, DictionaryDescription
from tickrig.device.canopen.ds402.modes.modes import MODES
from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.models import epos
from tickrig.emulators.canopen.bus_file.joint_drive import Defaults
from tickrig.emulators.canopen.eds import fitting
from tickrig.emulators.canopen.profiles import PROFILE_AREA
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.eds.object_table import EntryDescription

NAMES: Final = {
    1: "pp",
    3: "pv",
    4: "tq",
    6: "hm",
    7: "ip",
    8: "csp",
    9: "csv",
    10: "cst",
}
"""Modes of operation as CiA 402 abbreviates them, by the number in 6060h."""

NUMBERS: Final = {name: number for number, name in NAMES.items()}

_PROFILE: Final = (indices.PROFILE_ACCELERATION, indices.PROFILE_DECELERATION)
_ALWAYS: Final = (
    *(indices.CONTROLWORD, indices.STATUSWORD, indices.MODES_OF_OPERATION),
    *(indices.MODES_OF_OPERATION_DISPLAY, indices.POSITION_ACTUAL, indices.VELOCITY_ACTUAL),
    indices.SUPPORTED_MODES,
)
_FACTORS: Final = (indices.ENCODER_RESOLUTION, indices.GEAR_RATIO, indices.FEED_CONSTANT)
_TORQUE: Final = (indices.TARGET_TORQUE, indices.TORQUE_ACTUAL)
NEEDED: Final = {
    1: (indices.TARGET_POSITION, indices.PROFILE_VELOCITY, *_PROFILE),
    3: (indices.TARGET_VELOCITY, *_PROFILE),
    4: (*_TORQUE, indices.TORQUE_SLOPE),
    6: (
        *(indices.HOME_OFFSET, indices.HOMING_METHOD, indices.HOMING_SPEEDS),
        indices.HOMING_ACCELERATION,
    ),
    7: (
        *(indices.INTERPOLATION_SUBMODE, indices.INTERPOLATION_DATA),
        indices.INTERPOLATION_PERIOD,
    ),
    8: (indices.TARGET_POSITION, indices.INTERPOLATION_PERIOD),
    9: (indices.TARGET_VELOCITY, indices.INTERPOLATION_PERIOD),
    10: _TORQUE,
}
"""Objects without which a master cannot use a mode, by its number."""


NEVER_ZERO: Final = frozenset(
    {
        *(indices.FOLLOWING_ERROR_WINDOW, indices.MAX_TORQUE, indices.MAX_CURRENT),
        *(indices.RATED_CURRENT, indices.RATED_TORQUE, indices.MAX_PROFILE_VELOCITY),
        *(indices.MAX_MOTOR_SPEED, indices.PROFILE_VELOCITY, indices.PROFILE_ACCELERATION),
        *(indices.PROFILE_DECELERATION, indices.QUICK_STOP_DECELERATION, indices.TORQUE_SLOPE),
        *(indices.HOMING_SPEEDS, indices.HOMING_ACCELERATION, indices.MAX_ACCELERATION),
        *(indices.MAX_DECELERATION, indices.POSITIVE_TORQUE_LIMIT, indices.NEGATIVE_TORQUE_LIMIT),
    }
)
"""Objects in which 0 lets nothing move: a file that has it there leaves the value open."""


def modes_listed(dictionary: Dictionary) -> frozenset[int]:
    """Return the modes that 6502h of a dictionary lists; all that there are if it lists none."""
    entry = dictionary.find(indices.SUPPORTED_MODES)
    listed = entry.number if entry else 0
    known = (number for number in MODES if number > 0)
    return frozenset(n for n in known if not listed or listed >> n - 1 & 1)


def complete(
    dictionary: Dictionary, modes: Collection[int], added: Collection[int], defaults: Defaults
) -> Dictionary:
    """Return the dictionary of a drive: objects without a value have one, and some are added.

    Args:
        dictionary: of its EDS.
        modes: the modes of operation that it shall have.
        added: objects that its EDS lacks.
        defaults: values for objects of the profile to which the EDS gives none.
    """
    given, own = dictionary.description, epos.dictionary().description
    entries = [
        *(_with_default(each, defaults) for each in given),
        *(_with_default(each, defaults, anew=True) for each in _of(own, added)),
    ]
    objects = {**given.objects, **{index: own.objects[index] for index in added}}
    return Dictionary((_listing(each, modes) for each in entries), objects)


def with_values(dictionary: Dictionary, values: Mapping[tuple[int, int], Value]) -> Dictionary:
    """Return a dictionary with other power-on values, or their bytes, of entries that it has."""
    if not any(at in dictionary for at in values):
        return dictionary
    given = dictionary.description
    entries = (
        each if (value := values.get((each.index, each.sub))) is None else each.with_default(value)
        for each in given
    )
    return Dictionary(entries, given.objects)


def with_factors(dictionary: Dictionary, defaults: Defaults) -> Dictionary:
    """Return a dictionary whose position units are those of some defaults, not of its EDS."""
    values = {at: value for at, value in defaults.items() if at[0] in _FACTORS}
    found = {
        at: fitting(entry.description, value)
        for at, value in {**values, (indices.SI_UNIT_POSITION, 0): 0}.items()
        if (entry := dictionary.find(*at)) is not None and entry.description.data_type.is_integer
    }
    return with_values(dictionary, found)


def missing(dictionary: Dictionary, modes: Iterable[int]) -> list[int]:
    """Return the objects that some modes need and a dictionary has not, sorted."""
    wanted = {*_ALWAYS, *(index for mode in modes for index in NEEDED[mode])}
    return sorted(index for index in wanted if index not in dictionary.objects)


def _of(own: DictionaryDescription, wanted: Collection[int]) -> Iterator[EntryDescription]:
    return (each for each in own if each.index in wanted)


def _with_default(
    entry: EntryDescription, defaults: Defaults, *, anew: bool = False
) -> EntryDescription:
    """Return an entry with the default of a drive, if it has none of its own; see `NEVER_ZERO`.

    It is cut to the type and the limits that the EDS gives the object.
    """
    value = defaults.get((entry.index, entry.sub))
    open_zero = entry.index in NEVER_ZERO and not any(entry.default)
    own = entry.has_default and not (anew or open_zero)  # `in_profile` has filled the others
    if own or value is None or entry.index not in PROFILE_AREA or not entry.data_type.is_integer:
        return entry
    return entry.with_default(fitting(entry, value))


def _listing(entry: EntryDescription, modes: Collection[int]) -> EntryDescription:
    """Return an entry; 6502h lists the modes beside what else its bits say."""
    if entry.index != indices.SUPPORTED_MODES:
        return entry
    known = sum(1 << number - 1 for number in NAMES)
    more = int.from_bytes(entry.default, "little") & ~known
    return entry.with_default(more | sum(1 << number - 1 for number in modes))
