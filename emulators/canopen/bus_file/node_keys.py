"""`tickrig:` in a node of a bus.yml: the motor, gear, switches, modes and inputs of the node.

>>> from tickrig.host.text.document import FilePlace, Item
>>> value = Item(100, FilePlace("bus.yml", 7), "100")
>>> KEYS["gear_ratio"].field(value.plain)
100
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from tickrig.device.servo.parameters import PRESETS
from tickrig.emulators.canopen.bus_file.joint_drive import NAMES
from tickrig.emulators.canopen.choices import PROFILES
from tickrig.host.text.document import FileMistake, FilePlace, Item
from tickrig.host.text.names import near
from tickrig.host.text.section import Field, flag, number, one_of, shown, whole
from tickrig.host.text.values import Setting

# Errors in a bus.yml and its files, one line each.


class BusMistakesError(ValueError):
    """Error in a bus.yml or in the files it names, because of which no slaves can be made.

    Attributes:
        mistakes: all errors, by file and line.
    """

    def __init__(self, mistakes: Iterable[FileMistake]) -> None:
        self.mistakes = tuple(dict.fromkeys(sorted(mistakes)))
        super().__init__("\n".join(map(str, self.mistakes)))


_ALL: Final = "all"
URDF: Final = "urdf"
"""Key of `options` for the robot with the joints."""

_MOST: Final = 1e6


@dataclass(frozen=True, slots=True)
class NodeKeys:
    """The settings under the key `tickrig:` of a node in a bus.yml, which describe its emulation.

    Attributes:
        joint: arguments of `JointDrive` by name.
        modes: numbers of the node's modes of operation, or None to use the modes in its files.
        profile: name of `choices.PROFILES`, or None for `auto`.
        configured: whether the emulated node starts with the object values that its master would
            otherwise write at boot-up.
        start: initial inputs by name.
        places: positions of the keys and inputs in the file.
    """

    joint: Mapping[str, Any] = field(default_factory=dict)
    modes: frozenset[int] | None = None
    profile: str | None = None
    configured: bool = False
    start: Mapping[str, Setting] = field(default_factory=dict)
    places: Mapping[str, FilePlace] = field(default_factory=dict)


def _pair(value: object) -> tuple[float, float]:
    if isinstance(value, list) and len(value) == 2:
        low, high = map(number(-_MOST, _MOST), value)
        if low <= high:
            return low, high
    raise ValueError(f"it takes a pair [FROM, TO] with FROM up to TO, not {shown(value)}")


_NUMBERS: Final = {name: number for number, name in NAMES.items()}


def _modes(value: object) -> frozenset[int]:
    if value == _ALL:
        return frozenset(_NUMBERS.values())
    if not isinstance(value, list) or not value:
        raise ValueError(f"it takes {_ALL} or a list of {', '.join(_NUMBERS)}, not {shown(value)}")
    return frozenset(_NUMBERS[one_of(*_NUMBERS)(each)] for each in value)


def _settings(value: object) -> dict[str, Setting]:
    if not isinstance(value, dict):
        raise ValueError(f"it takes a mapping of inputs, not {shown(value)}")
    for key, each in value.items():
        if not isinstance(key, str):
            raise ValueError(f"{key!r} is no name of an input")
        if not isinstance(each, int | float | str):
            raise ValueError(f"{key}: it takes a number or a text, not {shown(each)}")
    return value


_POSITION: Final = "rad, or m with `travel_m`"

JOINT_KEYS: Final[Mapping[str, Field]] = {
    "motor": Field(
        one_of(*PRESETS),
        ", ".join(f"`{name}`" for name in PRESETS),
        "motor, power stage, encoder and gear from which the other keys differ: "
        "[presets](../reference/devices/servo.md#parameters)",
        "`epos-wheel`",
    ),
    "supply_v": Field(
        number(1, 100),
        "1..100",
        "supply of the power stage",
        "of the motor",
    ),
    "encoder_counts": Field(
        whole(4, 1 << 24), f"4..{1 << 24}", "counts in a turn of the motor", "of the motor"
    ),
    "gear_ratio": Field(
        number(0.01, _MOST),
        "0.01..1e6",
        "turns of the motor in a turn of the shaft",
        "the ratio that `velocity` needs, else of the motor",
    ),
    "gear_efficiency": Field(
        number(0, 1, above=True),
        "above 0, up to 1",
        "fraction of the power of a load that passes the gear",
        "of the motor",
    ),
    "friction_nm": Field(
        number(0, _MOST),
        "0..1e6",
        "dry friction at the shaft",
        "of the motor",
    ),
    "inertia_kg_m2": Field(
        number(0, _MOST), "0..1e6", "inertia that is always attached to the shaft", "of the motor"
    ),
    "effort": Field(
        number(0, _MOST, above=True),
        "above 0",
        "largest torque of the shaft in Nm, or force in N; the motor is scaled to it",
        "that of the motor",
    ),
    "velocity": Field(
        number(0, _MOST, above=True),
        "above 0",
        "largest speed in rad/s, or m/s; limits the drive as 6080h does",
        "that of the motor",
    ),
    "lower": Field(
        number(-_MOST, _MOST),
        _POSITION,
        "position at which the joint presses the negative limit switch",
        "no switch",
    ),
    "upper": Field(
        number(-_MOST, _MOST),
        _POSITION,
        "position at which the joint presses the positive limit switch",
        "no switch",
    ),
    "home_switch": Field(
        _pair,
        "`[FROM, TO]` in rad, or m with `travel_m`",
        "range in which the joint presses the home switch",
        "no switch",
    ),
    "travel_m": Field(
        number(0, _MOST, above=True),
        "above 0",
        "the joint is a carriage, and a turn of the shaft moves it by this distance",
        "the joint turns",
    ),
    "units": Field(
        number(0, 1e9, above=True),
        "above 0",
        "position units in a radian, or in a metre",
        "`scale_pos_to_dev`, or 1000",
    ),
}
"""Keys of a `JointDrive`."""

KEYS: Final[Mapping[str, Field]] = {
    **JOINT_KEYS,
    "modes": Field(
        _modes,
        f"`{_ALL}`, a list of {', '.join(f'`{name}`' for name in _NUMBERS)}",
        "modes of operation; objects that they need and the EDS lacks are added",
        "the modes of 6502h, and the mode that `sdo` writes to 6060h",
    ),
    "profile": Field(
        one_of(*PROFILES),
        ", ".join(f"`{name}`" for name in PROFILES),
        "what the node does with its objects: "
        "[profiles](../reference/devices/canopen-slave-emu.md#profiles)",
        "`auto`",
    ),
    "configured": Field(
        flag,
        "`true`, `false`",
        "if true, the node starts with all values that the master would write to it at boot-up",
        "`false`",
    ),
    "start": Field(
        _settings,
        "a mapping",
        "values of physical inputs and objects at the start",
        "as usual",
    ),
}
"""All keys of a node."""

_ARGUMENTS: Final = {
    "effort": "max_torque",
    "velocity": "max_velocity",
    "home_switch": "home",
}
"""Keys with another name as argument of `JointDrive`."""


def read_keys(
    layers: tuple[Mapping[str, Item], ...], where: str, mistakes: list[FileMistake]
) -> NodeKeys:
    """Read the settings under `tickrig:` that apply to a node of a bus.yml.

    The settings of the node have priority over those of all nodes.

    Args:
        layers: two mappings: the mapping `tickrig:` of the node, and then the mapping `tickrig:` of
            the section `options:`, which applies to all nodes.
        where: name of the node, for error messages.
        mistakes: list to which errors are added.
    """
    found: dict[str, Any] = {}
    places: dict[str, FilePlace] = {}
    for layer in layers:
        for name, item in layer.items():
            if name in places or (name == URDF and layer is not layers[0]):
                continue
            places[name] = item.place
            if name not in KEYS:
                text = f"no key {str(name)!r}; {near(str(name), list(KEYS))}"
                mistakes.append(FileMistake(item.place, f"{where}.tickrig: {text}"))
                continue
            try:
                found[name] = KEYS[name].field(item.plain)
            except ValueError as error:
                mistakes.append(FileMistake(item.place, f"{where}.tickrig.{name}: {error}"))
            if name == "start":
                places.update({str(key): each.place for key, each in item.fields.items()})
    return NodeKeys(
        {_ARGUMENTS.get(name, name): found[name] for name in JOINT_KEYS if name in found},
        found.get("modes"),
        found.get("profile"),
        found.get("configured", False),
        found.get("start", {}),
        places,
    )
