"""Robot bodies on emulated drives: from rig files, and as a coupling of the rig."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import degrees, radians
from typing import Final, NamedTuple

from tickrig.device.body import BodyParameters, WheeledBody
from tickrig.device.canopen.slave import TICK_US
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.canopen.signals import NodeSignal
from tickrig.host.text.values import Setting
from tickrig.wire.instant import NEVER

# A body on the shafts of drives, as a coupling of their rig.

_FAR_M: Final = 1e6
"""Largest coordinate of a body."""

_MOST_FRICTION: Final = 10


class _PoseSignal:
    """One coordinate of a body; setting it moves the body without changing wheels and speed.

    Args:
        body: the body.
        name: `x_m`, `y_m` or `heading_deg`.
        text: description as readable text.
        unit: unit of the coordinate.
    """

    def __init__(self, body: WheeledBody, name: str, text: str, unit: str) -> None:
        most = 180 if name == "heading_deg" else _FAR_M
        self.item = InputSignal(name, text, SignalType.LEVEL, -most, most, unit, real=True)
        self._body, self._bank = body, QuantityBank([self.item])

    def read(self) -> float:
        """Return the present coordinate."""
        pose = self._body.pose
        match self.item.name:
            case "x_m":
                return pose.x_m
            case "y_m":
                return pose.y_m
        return degrees(pose.wrapped_rad)

    def check(self, value: Setting) -> float:
        """Return the value, or raise ValueError."""
        return self._bank.check(self.item.name, value)

    def write(self, value: Setting) -> None:
        """Set the coordinate."""
        number, pose = float(self.check(value)), self._body.pose
        match self.item.name:
            case "x_m":
                pose = replace(pose, x_m=number)
            case "y_m":
                pose = replace(pose, y_m=number)
            case _:
                pose = replace(pose, heading_rad=radians(number))
        self._body.pose = pose


class _FrictionSignal:
    """The friction of the ground, for a body that can slip."""

    def __init__(self, body: WheeledBody) -> None:
        text = "coefficient of friction between wheels and ground"
        self.item = InputSignal("friction", text, high=_MOST_FRICTION, real=True)
        self._body, self._bank = body, QuantityBank([self.item])

    def read(self) -> float:
        """Return the coefficient."""
        return next(iter(self._body.contacts.values())).friction or 0.0

    def check(self, value: Setting) -> float:
        """Return the value, or raise ValueError."""
        return self._bank.check(self.item.name, value)

    def write(self, value: Setting) -> None:
        """Set the friction of all wheels."""
        friction = float(self.check(value))
        for contact in self._body.contacts.values():
            contact.friction = friction


_NAME: Final = "body"

_BODY_OUTPUTS: Final = (
    OutputSignal("x_m", "place", "m"),
    OutputSignal("y_m", "place, to the left of x", "m"),
    OutputSignal("heading_deg", "from x towards y, -180..180", "deg"),
    OutputSignal("speed_m_s", "speed forward", "m/s"),
    OutputSignal("turn_deg_s", "turning speed, positive to the left", "deg/s"),
    OutputSignal("slipping", "1 while a wheel slips"),
)

SHAFTS: Final = (
    ("shaft_deg", "load_nm", "load_kg_m2"),
    ("angle_deg", "shaft_load_nm", "load_kg_m2"),
)
"""Names of drives for the angle of the shaft, its torque and its inertia."""


class DrivenWheel(NamedTuple):
    """A wheel of a body, on the shaft of a CANopen drive.

    Attributes:
        name: name of the wheel.
        node: node of the drive.
        forward: sign of the shaft: -1 if the drive is mounted the other way round, or else 1.
    """

    name: str
    node: Node
    forward: int = 1


class BodyOnDrives:
    """A robot body on wheels that CANopen drives turn, as part of a rig.

    The shafts of the drives move the body, and the mass and friction of the body load the shafts.

    Args:
        body: the body.
        wheels: the wheels of the body with their drives.

    Raises:
        ValueError: a node has no shaft.
    """

    name = _NAME
    tick_us = TICK_US

    def __init__(self, body: WheeledBody, wheels: Collection[DrivenWheel]) -> None:
        self.body = body
        self._shafts = {wheel.name: _Shaft(wheel) for wheel in wheels}
        self.physical: Mapping[str, NodeSignal] = {
            signal.item.name: signal
            for signal in (
                _PoseSignal(body, "x_m", "place", "m"),
                _PoseSignal(body, "y_m", "place, to the left of x", "m"),
                _PoseSignal(body, "heading_deg", "from x towards y", "deg"),
            )
        }
        if body.parameters.friction is not None:
            self.physical = {**self.physical, "friction": _FrictionSignal(body)}
        self.outputs: Mapping[str, OutputSignal] = {item.name: item for item in _BODY_OUTPUTS}
        self.groups: Mapping[str, tuple[str, ...]] = {"pose": ("x_m", "y_m", "heading_deg")}
        self._load()

    @property
    def due_us(self) -> int:
        """Time of the next call of `act`.

        It is the next tick while the body moves, or `NEVER` while the body rests.
        """
        return NEVER if self.body.resting else 0

    def act(self, now_us: int, /) -> None:
        """Advance the body, and load the shafts."""
        self.body.step({name: shaft.angle_rad for name, shaft in self._shafts.items()})
        self._load()

    def signal(self, name: str) -> NodeSignal | None:
        """Return the signal with the name, or None if there is none."""
        return self.physical.get(name)

    def signal_names(self) -> list[str]:
        """Return all names."""
        return list(self.physical)

    def read(self, name: str) -> Setting:
        """Return the value of an output; raise KeyError if the name is unknown."""
        match name:
            case "speed_m_s":
                return self.body.speed_m_s
            case "turn_deg_s":
                return degrees(self.body.turn_rad_s)
            case "slipping":
                return int(self.body.slipping)
        return self.physical[name].read()

    def _load(self) -> None:
        for name, contact in self.body.contacts.items():
            self._shafts[name].load(contact.load_nm, contact.load_kg_m2)


class _Shaft:
    """The shaft of a drive, with values at its wheel."""

    def __init__(self, wheel: DrivenWheel) -> None:
        node, self._forward = wheel.node, wheel.forward
        self._application, self._bank = node.application, node.application.inputs
        names = [row for row in SHAFTS if row[0] in node.outputs]
        if not names:
            raise ValueError(f"{wheel.name}: node {node.name} has no shaft")
        self._angle, self._torque, self._inertia = names[0]

    @property
    def angle_rad(self) -> float:
        """The angle, positive forward."""
        return self._forward * radians(float(self._application.read(self._angle)))

    def load(self, torque_nm: float, inertia_kg_m2: float) -> None:
        """Apply a torque (positive if forward) and an inertia to the shaft."""
        _set(self._bank, self._torque, self._forward * torque_nm)
        _set(self._bank, self._inertia, inertia_kg_m2)


def _set(bank: QuantityBank, name: str, value: float) -> None:
    """Set an input, limited to its range; an ideal motor has no such input and no load."""
    item = bank.table.get(name)
    if item is not None and bank[name] != (value := min(max(value, item.low), item.high)):
        bank.set(name, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyPlan:
    """The description of a robot body on CANopen drives in a rig file.

    Attributes:
        kind: kind of the body, which is a name of `wheeled_body.SIDES`.
        drives: names of the devices that turn the wheels, by wheel.
        mirrored: wheels whose drive is mounted the other way round.
        parameters: arguments of `BodyParameters` that the file gives.
    """

    kind: str
    drives: Mapping[str, str]
    mirrored: tuple[str, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)

    def put_on(self, nodes: Iterable[Node]) -> BodyOnDrives:
        """Connect the body with the shafts of its drives, which are among the nodes."""
        by_name = {node.name: node for node in nodes}
        wheels = [
            DrivenWheel(wheel, by_name[drive], -1 if wheel in self.mirrored else 1)
            for wheel, drive in self.drives.items()
        ]
        parameters = BodyParameters(kind=self.kind, **self.parameters)
        return BodyOnDrives(WheeledBody(parameters), wheels)
