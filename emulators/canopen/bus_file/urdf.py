"""The joints of a URDF that `<ros2_control>` puts on a CANopen bus: limits and reduction.

Only elements and attributes are read. A document type is refused, and with it all entities.

>>> robot = '''<robot name="arm">
... <joint name="elbow" type="revolute"><limit lower="-1" upper="1" velocity="2"/></joint>
... <ros2_control><joint name="elbow"><param name="node_id">3</param></joint></ros2_control>
... </robot>'''
>>> found = parse_urdf(robot.encode(), "arm.urdf").joints[0]
>>> found.name, found.node_id, found.upper
('elbow', 3, 1.0)
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Final

from tickrig.emulators.canopen.bus_file.node_keys import BusMistakesError
from tickrig.host.text.document import FileMistake, FilePlace
from tickrig.wire.canopen.eds.eds_device import HIGHEST_NODE_ID
from tickrig.wire.canopen.eds.eds_file import decode_text
from tickrig.wire.canopen.eds.xdd import Element, XddError, read_xml

_MOST_BYTES: Final = 32_000_000
_XACRO_TAGS: Final = ("macro", "include", "property", "arg")
_XACRO: Final = "xacro a.urdf.xacro > a.urdf expands it"
LEAST, MOST = 1e-9, 1e9
"""Bounds of limits and reductions, in rad, m, Nm, N and their rates. They are far from any real
joint."""

_NODE_ID: Final = re.compile("[0-9]{1,9}")
_LIMITS: Final = ("lower", "upper", "velocity", "effort")
REVOLUTE, CONTINUOUS, PRISMATIC = "revolute", "continuous", "prismatic"
_MOVES: Final = (REVOLUTE, CONTINUOUS, PRISMATIC)
_REDUCTIONS: Final = ("mechanicalReduction", "mechanical_reduction")


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfJoint:
    """A joint that a device of the bus moves.

    Attributes:
        name: name of the joint.
        place: place of the joint in `<ros2_control>`.
        device_name: name of the node in bus.yml, or empty if missing.
        node_id: node-ID of the node, or None if missing.
        kind: `revolute`, `continuous` or `prismatic`.
        lower: lower limit of the position in rad or m, or None if unlimited.
        upper: upper limit of the position in rad or m, or None if unlimited.
        velocity: largest velocity in rad/s or m/s, or None if missing.
        effort: largest effort in Nm or N, or None if missing.
        reduction: number of turns of the actuator for each turn of the joint, or rad of the
            actuator for each m of a prismatic joint, or None if missing.
    """

    name: str
    place: FilePlace
    device_name: str = ""
    node_id: int | None = None
    kind: str = REVOLUTE
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    reduction: float | None = None


@dataclass(frozen=True, slots=True)
class Urdf:
    """The content of a URDF file, the description of a robot in ROS.

    Attributes:
        name: name of the file.
        joints: the joints that devices of a bus move, in the order of the file.
    """

    name: str
    joints: tuple[UrdfJoint, ...] = ()


def read_urdf(path: Path) -> Urdf:
    """Read the joints of a robot from a URDF file.

    Raises:
        OSError: the file cannot be read.
        BusMistakesError: the file has errors; the exception has all of them.
    """
    with path.open("rb") as file:
        return parse_urdf(file.read(_MOST_BYTES + 1), str(path))


def parse_urdf(data: bytes, name: str) -> Urdf:
    """Read the bytes of a URDF file; see `read_urdf`."""
    if len(data) > _MOST_BYTES:
        raise BusMistakesError(
            [FileMistake(FilePlace(name, 1), f"more than {_MOST_BYTES:,} bytes: no URDF")]
        )
    try:
        robot = read_xml(decode_text(data))[0]
    except XddError as error:
        raise BusMistakesError([FileMistake(FilePlace(name, error.line), str(error))]) from None
    return _Reader(name).read(robot)


def _named(element: Element, *names: str) -> Iterator[Element]:
    """Return the children with these names."""
    return (child for child in element.children if child.name in names)


def _name(element: Element) -> str:
    """Return the attribute `name` of an element."""
    return element.attributes.get("name", "")


class _Reader:
    """Reader of the joints of one robot."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._mistakes: list[FileMistake] = []

    def read(self, robot: Element) -> Urdf:
        """Read all joints; raise BusMistakesError with all errors."""
        if robot.name != "robot":
            self._wrong(robot, f"<{robot.name}> is no <robot>")
        for each in itertools.islice(_named(robot, *_XACRO_TAGS), 1):
            self._wrong(each, f"<xacro:{each.name}> is not expanded: {_XACRO}")
        shapes = {_name(each): each for each in _named(robot, "joint")}
        reductions = dict(self._reductions(robot))
        joints = [
            joint
            for control in _named(robot, "ros2_control")
            for each in _named(control, "joint")
            if (joint := self._joint(each, shapes.get(_name(each)), reductions))
        ]
        if self._mistakes:
            raise BusMistakesError(self._mistakes)
        return Urdf(self._name, tuple(joints))

    def _joint(
        self, element: Element, shape: Element | None, reductions: Mapping[str, float]
    ) -> UrdfJoint | None:
        """Return a joint of `<ros2_control>`, or None if it has no device on a CANopen bus."""
        values = {_name(each): each for each in _named(element, "param")}
        device, node = values.get("device_name"), values.get("node_id")
        if device is None and node is None:
            return None
        node_id = self._node_id(node) if node else None
        if shape is None:
            self._wrong(element, f"joint {_name(element)!r}: the robot has no joint of this name")
            return None
        kind = shape.attributes.get("type", "")
        if kind not in _MOVES:
            text = f"joint {_name(element)!r}: type {kind!r} is not one of {', '.join(_MOVES)}"
            self._wrong(shape, text)
        return UrdfJoint(
            name=_name(element),
            place=FilePlace(self._name, element.line),
            device_name=device.text.strip() if device else "",
            node_id=node_id,
            kind=kind,
            reduction=reductions.get(_name(element)),
            **self._limits(shape, kind),
        )

    def _limits(self, shape: Element, kind: str) -> dict[str, float]:
        """Return the values of `<limit>`; an empty range, or velocity or effort 0, is no limit."""
        found: dict[str, float] = {}
        for limit in _named(shape, "limit"):
            for key in _LIMITS:
                if (text := limit.attributes.get(key)) is not None:
                    value = self._number(limit, f"joint {_name(shape)!r}: limit {key}", text)
                    if value is not None:
                        found[key] = value
        lower, upper = found.get("lower", 0.0), found.get("upper", 0.0)
        if lower > upper:
            text = f"limit lower {lower:g} is above upper {upper:g}"
            self._wrong(shape, f"joint {_name(shape)!r}: {text}")
        if kind == CONTINUOUS or lower == upper:
            found.pop("lower", None)
            found.pop("upper", None)
        for key in ("velocity", "effort"):
            if (value := found.get(key, 1.0)) <= 0:
                del found[key]
                if value < 0:
                    self._wrong(shape, f"joint {_name(shape)!r}: limit {key} {value:g} is below 0")
        return found

    def _reductions(self, robot: Element) -> Iterator[tuple[str, float]]:
        """Yield the reduction of each joint with a transmission in the robot or in its control."""
        for owner in (robot, *_named(robot, "ros2_control")):
            for transmission in _named(owner, "transmission"):
                parts = (transmission, *_named(transmission, "joint", "actuator"))
                written = [value for part in parts for value in _named(part, *_REDUCTIONS)]
                for joint in _named(transmission, "joint") if written else ():
                    value = self._number(written[0], _name(joint), written[0].text.strip())
                    if value:
                        yield _name(joint), abs(value)
                    elif value is not None:
                        self._wrong(written[0], f"{_name(joint)}: 0 is no reduction")

    def _node_id(self, element: Element) -> int | None:
        text = element.text.strip()
        number = int(text) if _NODE_ID.fullmatch(text) else 0
        if 1 <= number <= HIGHEST_NODE_ID:
            return number
        self._wrong(element, f"node_id {text!r:.40} is not 1..{HIGHEST_NODE_ID}{_hint(text)}")
        return None

    def _number(self, element: Element, what: str, text: str) -> float | None:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not isfinite(value):
            self._wrong(element, f"{what}: {text!r:.40} is no number{_hint(text)}")
        elif value and not LEAST <= abs(value) <= MOST:
            bounds = f"nothing here is below {LEAST:g} or above {MOST:g}"
            self._wrong(element, f"{what}: {text!r:.40}: {bounds}")
        else:
            return value
        return None

    def _wrong(self, element: Element, text: str) -> None:
        self._mistakes.append(FileMistake(FilePlace(self._name, element.line), text))


def _hint(text: str) -> str:
    """Return a hint that xacro values must be expanded."""
    return f": {_XACRO}" if "$" in text else ""
