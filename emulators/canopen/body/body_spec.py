"""A body as a rig file describes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from tickrig.device.body.wheeled_body import SIDES, BodyParameters, WheeledBody
from tickrig.emulators.canopen.body.body_on_drives import BodyOnDrives, Wheel
from tickrig.emulators.canopen.node.node import Node
from tickrig.host.cli.refused import Refused

NUMBERS: Final = ("wheel_radius_m", "tread_m", "mass_kg", "friction")
NEEDED: Final = ("wheel_radius_m", "tread_m")
MIRRORED: Final = "mirrored"


@dataclass(frozen=True, slots=True)
class BodySpec:
    """A body and its drives.

    Attributes:
        place: where it is written, for errors.
        parameters: what it is like.
        drives: node-ID of the drive of each wheel.
        mirrored: wheels whose drive is mounted the other way round.
    """

    place: str
    parameters: BodyParameters
    drives: Mapping[str, int]
    mirrored: tuple[str, ...] = ()

    def put_on(self, nodes: Sequence[Node]) -> BodyOnDrives:
        """Put it on the shafts of its drives; Refused if one of them is missing or none."""
        by_name = {node.name: node for node in nodes}
        wheels = []
        for name, node_id in self.drives.items():
            node = by_name.get(str(node_id))
            if node is None:
                raise Refused(f"{self.place}: {name} = {node_id}, but there is no such node")
            wheels.append(Wheel(name, node, -1 if name in self.mirrored else 1))
        try:
            return BodyOnDrives(WheeledBody(self.parameters), wheels)
        except ValueError as error:
            raise Refused(f"{self.place}: {error}") from None


def read_body(place: str, table: object) -> BodySpec:
    """Read the table [body]; Refused with the key if it cannot be used."""
    if not isinstance(table, dict):
        raise Refused(f"{place}: it is a table [body]")
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in SIDES:
        raise Refused(f"{place}: kind {kind!r} is not one of {', '.join(SIDES)}")
    wheels = [name for side in SIDES[kind] for name in side]
    known = ["kind", *wheels, *NUMBERS, MIRRORED]
    if unknown := [key for key in table if key not in known]:
        raise Refused(f"{place}: no key {unknown[0]}; known: {', '.join(known)}")
    if missing := [key for key in (*wheels, *NEEDED) if key not in table]:
        raise Refused(f"{place}: {missing[0]} is missing")
    return BodySpec(
        place,
        _parameters(place, kind, table),
        {name: _node_id(place, name, table[name]) for name in wheels},
        _mirrored(place, wheels, table.get(MIRRORED, [])),
    )


def _parameters(place: str, kind: str, table: Mapping[str, object]) -> BodyParameters:
    numbers = {}
    for key in NUMBERS:
        if key in table:
            value = table[key]
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise Refused(f"{place}: {key} {value!r} is not a number")
            numbers[key] = float(value)
    try:
        return BodyParameters(kind=kind, **numbers)
    except ValueError as error:
        raise Refused(f"{place}: {error}") from None


def _node_id(place: str, name: str, value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= 127:
        raise Refused(f"{place}: {name} {value!r} is not a node-ID in 1..127")
    return value


def _mirrored(place: str, wheels: Sequence[str], value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(name in wheels for name in value):
        raise Refused(f"{place}: {MIRRORED} {value!r} is not a list of {', '.join(wheels)}")
    return tuple(value)
