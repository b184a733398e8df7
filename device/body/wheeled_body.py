"""A body on driven wheels at its left and right side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Final

from tickrig.device.body.contact import Contact
from tickrig.device.body.pose import Pose
from tickrig.device.twin import Copyable, Immutable

STEP_S: Final = 1e-3
"""Length of a step; drives tick as often."""

SIDES: Final = {
    "differential": (("left",), ("right",)),
    "skid-steer": (("front_left", "rear_left"), ("front_right", "rear_right")),
}
"""Wheels at the left and at the right, by the kind of body."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyParameters(Immutable):
    """What a body is like.

    Attributes:
        kind: of `SIDES`.
        wheel_radius_m: of each wheel.
        tread_m: distance between left and right wheels.
        mass_kg: carried by the driven wheels, each the same share.
        friction: coefficient between wheels and ground, None if they never slip.

    Raises:
        ValueError: no such kind, or a length or mass that cannot be.
    """

    kind: str
    wheel_radius_m: float
    tread_m: float
    mass_kg: float = 0.0
    friction: float | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        if self.kind not in SIDES:
            raise ValueError(f"kind {self.kind!r} is not one of {', '.join(SIDES)}")
        for name, value in (("wheel_radius_m", self.wheel_radius_m), ("tread_m", self.tread_m)):
            if not value > 0:
                raise ValueError(f"{name} {value} is not above 0")
        for name, value in (("mass_kg", self.mass_kg), ("friction", self.friction or 0.0)):
            if not value >= 0:
                raise ValueError(f"{name} {value} is not 0 or more")

    @property
    def wheels(self) -> tuple[str, ...]:
        """Names of the wheels."""
        left, right = SIDES[self.kind]
        return (*left, *right)


class WheeledBody(Copyable):
    """A differential drive, or a skid steer whose sides move as the mean of their wheels.

    It goes as far as its wheels have turned since the step before, on an exact
    arc. Its mass lies above the wheels, at half the tread to each side: so each
    wheel feels mass / number of wheels x radius squared, straight on as in a turn.

    Not emulated: castors, the force that turns the wheels of a skid steer
    sideways, rolling resistance, slopes, collisions.

    Args:
        parameters: what it is like.

    Attributes:
        pose: where it is; it may be put elsewhere.
        speed_m_s: forward, in the latest step.
        turn_rad_s: to the left, in the latest step.
        contacts: its wheels on the ground, by name.
    """

    def __init__(self, parameters: BodyParameters) -> None:
        self.parameters, self.pose = parameters, Pose()
        self.speed_m_s = self.turn_rad_s = 0.0
        share_kg = parameters.mass_kg / len(parameters.wheels)
        self.contacts: Mapping[str, Contact] = {
            name: Contact(parameters.wheel_radius_m, share_kg, parameters.friction)
            for name in parameters.wheels
        }
        self._angles = dict.fromkeys(parameters.wheels, 0.0)

    def step(self, angles_rad: Mapping[str, float]) -> None:
        """Let a step pass in which the wheels have turned to these angles."""
        ways = {}
        for name, contact in self.contacts.items():
            ways[name] = contact.roll(angles_rad[name] - self._angles[name], STEP_S)
            self._angles[name] = angles_rad[name]
        left_m, right_m = (_mean([ways[name] for name in side]) for side in self._sides)
        tread_m = self.parameters.tread_m
        if left_m or right_m:
            self.pose = self.pose.moved(left_m, right_m, tread_m)
        self.speed_m_s = (left_m + right_m) / 2 / STEP_S
        self.turn_rad_s = (right_m - left_m) / tread_m / STEP_S

    @property
    def resting(self) -> bool:
        """Whether a step with the same angles would change nothing."""
        return not any(c.speed_m_s or c.slip_m_s for c in self.contacts.values())

    @property
    def slipping(self) -> bool:
        """Whether a wheel slips."""
        return any(contact.slip_m_s for contact in self.contacts.values())

    @property
    def _sides(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        return SIDES[self.parameters.kind]


def _mean(values: Sequence[float]) -> float:
    return reduce(add, values, 0.0) / len(values)
