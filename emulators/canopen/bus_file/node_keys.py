"""`tickrig:` in a node of a bus.yml: its motor, gear and switches, its modes and inputs.

>>> from tickrig.host.text.document import FileMistake, FilePlace, Item
>>> value = Item(100, FilePlace("bus.yml", 7), "100")
>>> KEYS["gear_ratio"].take(value)
100.0
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Final, NamedTuple

from tickrig.device.servo.parameters import PRESETS
from tickrig.emulators.canopen.bus_file.joint_drive import NUMBERS
from tickrig.emulators.canopen.choices import PROFILES
from tickrig.host.text.document import FileMistake, FilePlace, Item
from tickrig.host.text.names import closest, near
from tickrig.host.text.values import Setting

# What is wrong with a bus.yml and the files that it goes with, a line each.


class BusMistakesError(ValueError):
    """Files of which no slaves can be made.

    Attributes:
        mistakes: all that is wrong, by file and line.
    """

    def __init__(self, mistakes: Iterable[FileMistake]) -> None:
        self.mistakes = tuple(dict.fromkeys(sorted(mistakes)))
        super().__init__("\n".join(map(str, self.mistakes)))


_ALL: Final = "all"
URDF: Final = "urdf"
"""A key of `options`: the robot that has the joints."""

_MOST: Final = 1e6


class NodeKey(NamedTuple):
    """A key of the mapping.

    Attributes:
        take: makes something of a value; ValueError with what was allowed.
        values: what it takes, for people.
        default: what holds without it, for people.
        text: what it says, for people.
    """

    take: Callable[[Item], Any]
    values: str
    default: str
    text: str


@dataclass(frozen=True, slots=True)
class NodeKeys:
    """What `tickrig:` says of a node.

    Attributes:
        joint: of `JointDrive`, by name.
        modes: numbers of its modes of operation; None for those that its files ask for.
        profile: of `choices.PROFILES`, None for `auto`.
        configured: it begins with what its master would write to it.
        start: inputs at the start, by name.
        places: where each key and each input stands.
    """

    joint: Mapping[str, Any] = field(default_factory=dict)
    modes: frozenset[int] | None = None
    profile: str | None = None
    configured: bool = False
    start: Mapping[str, Setting] = field(default_factory=dict)
    places: Mapping[str, FilePlace] = field(default_factory=dict)


def _number(low: float, high: float, *, above: bool = False) -> Callable[[Item], float]:
    """Return what takes a number of a range; `above` leaves its lower end out."""

    def take(item: Item) -> float:
        value = item.value
        fits = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
        if fits and low <= value <= high and not (above and value == low):  # type: ignore[operator]
            return float(value)  # type: ignore[arg-type]
        kind = f"above {low:g} and up to {high:g}" if above else f"{low:g}..{high:g}"
        raise ValueError(f"{item} is no number {kind}")

    return take


def _whole(low: int, high: int) -> Callable[[Item], int]:
    def take(item: Item) -> int:
        value = item.value
        if isinstance(value, int) and not isinstance(value, bool) and low <= value <= high:
            return value
        raise ValueError(f"{item} is no whole number {low}..{high}")

    return take


def _one_of(*names: str) -> Callable[[Item], str]:
    def take(item: Item) -> str:
        text = item.text if not (item.is_list or item.is_mapping) else ""
        if text in names:
            return text
        raise ValueError(f"{item} is none of {', '.join(names)}{_hint(text, names)}")

    return take


def _flag(item: Item) -> bool:
    if isinstance(item.value, bool):
        return item.value
    raise ValueError(f"{item} is neither true nor false")


def _hint(text: str, names: tuple[str, ...]) -> str:
    close = closest(text, names) if text else []
    return f"; did you mean {close[0]!r}?" if close else ""


def _pair(item: Item) -> tuple[float, float]:
    take = _number(-_MOST, _MOST)
    values = [take(each) for each in item.items]
    if len(values) != 2 or values[0] > values[1]:
        raise ValueError(f"{item} is no pair [FROM, TO] with FROM up to TO")
    return values[0], values[1]


def _modes(item: Item) -> frozenset[int]:
    if item.text == _ALL:
        return frozenset(NUMBERS.values())
    take = _one_of(*NUMBERS)
    if not item.items:
        raise ValueError(f"{item} is neither {_ALL} nor a list of {', '.join(NUMBERS)}")
    return frozenset(NUMBERS[take(each)] for each in item.items)


def _settings(item: Item) -> dict[str, Setting]:
    if not item.is_mapping:
        raise ValueError(f"{item} is no mapping of inputs")
    found: dict[str, Setting] = {}
    for key, each in item.fields.items():
        value = each.value
        if not isinstance(key, str):
            raise ValueError(f"{key!r} is no name of an input")
        if not isinstance(value, int | float | str):
            raise ValueError(f"{key}: {each} is no number and no text")
        found[key] = value
    return found


_POSITION: Final = "rad, or m with `travel_m`"

JOINT_KEYS: Final[Mapping[str, NodeKey]] = {
    "motor": NodeKey(
        _one_of(*PRESETS),
        ", ".join(f"`{name}`" for name in PRESETS),
        "`epos-wheel`",
        "motor, power stage, encoder and gear to begin with: "
        "[presets](../reference/devices/servo.md#parameters)",
    ),
    "supply_v": NodeKey(_number(1, 100), "1..100", "of the motor", "supply of the power stage"),
    "encoder_counts": NodeKey(
        _whole(4, 1 << 24), f"4..{1 << 24}", "of the motor", "counts in a turn of the motor"
    ),
    "gear_ratio": NodeKey(
        _number(0.01, _MOST),
        "0.01..1e6",
        "what `velocity` needs, else of the motor",
        "turns of the motor in a turn of the shaft",
    ),
    "gear_efficiency": NodeKey(
        _number(0, 1, above=True),
        "above 0, up to 1",
        "of the motor",
        "part of the power of a load that gets through",
    ),
    "friction_nm": NodeKey(
        _number(0, _MOST), "0..1e6", "of the motor", "dry friction at the shaft"
    ),
    "inertia_kg_m2": NodeKey(
        _number(0, _MOST), "0..1e6", "of the motor", "what always hangs on the shaft"
    ),
    "effort": NodeKey(
        _number(0, _MOST, above=True),
        "above 0",
        "that of the motor",
        "largest torque of the shaft in Nm, or force in N; the motor is made as large",
    ),
    "velocity": NodeKey(
        _number(0, _MOST, above=True),
        "above 0",
        "that of the motor",
        "largest speed in rad/s, or m/s; limits the drive as 6080h does",
    ),
    "lower": NodeKey(
        _number(-_MOST, _MOST), _POSITION, "no switch", "where it presses the negative limit switch"
    ),
    "upper": NodeKey(
        _number(-_MOST, _MOST), _POSITION, "no switch", "where it presses the positive limit switch"
    ),
    "home_switch": NodeKey(
        _pair, "`[FROM, TO]`, as above", "no switch", "between which it presses the home switch"
    ),
    "travel_m": NodeKey(
        _number(0, _MOST, above=True),
        "above 0",
        "the joint turns",
        "it is a carriage, and a turn of the shaft moves it so far",
    ),
    "units": NodeKey(
        _number(0, 1e9, above=True),
        "above 0",
        "`scale_pos_to_dev`, or 1000",
        "position units in a radian, or in a metre",
    ),
}
"""What makes a `JointDrive`."""

KEYS: Final[Mapping[str, NodeKey]] = {
    **JOINT_KEYS,
    "modes": NodeKey(
        _modes,
        f"`{_ALL}`, a list of {', '.join(f'`{name}`' for name in NUMBERS)}",
        "those of 6502h, and one that `sdo` writes to 6060h",
        "modes of operation; objects that they need and the EDS lacks are added",
    ),
    "profile": NodeKey(
        _one_of(*PROFILES),
        ", ".join(f"`{name}`" for name in PROFILES),
        "`auto`",
        "what the node does with its objects: "
        "[profiles](../reference/devices/canopen-slave-emu.md#profiles)",
    ),
    "configured": NodeKey(
        _flag,
        "`true`, `false`",
        "`false`",
        "it begins with all that the master would write to it at boot-up",
    ),
    "start": NodeKey(
        _settings, "a mapping", "as usual", "physical inputs and objects at the start"
    ),
}
"""All of a node."""

_ARGUMENTS: Final = {
    "effort": "max_torque",
    "velocity": "max_velocity",
    "home_switch": "home",
}
"""Keys whose argument of `JointDrive` is called otherwise."""


def read_keys(
    layers: tuple[Mapping[str, Item], ...], where: str, mistakes: list[FileMistake]
) -> NodeKeys:
    """Read the mappings `tickrig:` that hold for a node; the first that has a key counts.

    Args:
        layers: that of the node, then those of all nodes.
        where: name of the node, for mistakes.
        mistakes: takes what is wrong.
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
                found[name] = KEYS[name].take(item)
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


def rows() -> Iterator[str]:
    """Yield the lines of the table of the page."""
    yield "| key | value | unless given | meaning |"
    yield "|---|---|---|---|"
    for name, key in KEYS.items():
        yield f"| `{name}` | {key.values} | {key.default} | {key.text} |"
