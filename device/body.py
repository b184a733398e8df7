"""Bodies that drives move: poses, wheels, contact with the ground."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from math import cos, pi, remainder, sin, tau
from operator import add
from typing import Final, NamedTuple

from tickrig.device.twin import Copyable, Immutable

# Poses, and how an arc changes them.


@dataclass(frozen=True, slots=True)
class Pose(Immutable):
    """A position and heading on a plane.

    Attributes:
        x_m: position in x, in metres.
        y_m: position in y, which is to the left of x, in metres.
        heading_rad: angle from x towards y, in radians. The angle is not wrapped.
    """

    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0

    @property
    def wrapped_rad(self) -> float:
        """The heading within half a turn to each side."""
        return remainder(self.heading_rad, tau)

    def moved(self, left_m: float, right_m: float, tread_m: float) -> Pose:
        """Return the pose of a body after its left and right wheels have rolled at steady speeds.

        The path is an arc, and it is computed exactly.

        Args:
            left_m: distance that the left wheels rolled, in metres.
            right_m: distance that the right wheels rolled, in metres.
            tread_m: distance between the left and the right wheels, in metres.

        >>> Pose().moved(1.0, 1.0, 0.4)
        Pose(x_m=1.0, y_m=0.0, heading_rad=0.0)
        """
        return Pose(*arc((self.x_m, self.y_m, self.heading_rad), left_m, right_m, tread_m))


def arc(
    place: tuple[float, float, float], left_m: float, right_m: float, tread_m: float
) -> tuple[float, float, float]:
    """Return x, y and heading after a body on two wheels has driven an arc.

    The function computes the same as `Pose.moved`, but with plain numbers. It is faster because no
    `Pose` is made.
    """
    x_m, y_m, heading_rad = place
    turn_rad = (right_m - left_m) / tread_m  # the chord has the heading in the middle of the arc
    half_rad = turn_rad / 2
    chord_m = (left_m + right_m) / 2
    if half_rad:
        chord_m *= sin(half_rad) / half_rad
    middle_rad = heading_rad + half_rad
    return (
        x_m + chord_m * cos(middle_rad),
        y_m + chord_m * sin(middle_rad),
        heading_rad + turn_rad,
    )


# Contact of a wheel with the ground.

GRAVITY_M_S2: Final = 9.80665
"""Standard gravity."""


@dataclass(slots=True)
class Contact:
    """A wheel that carries its share of a body over the ground.

    Without `friction` the wheel never slips: it moves the ground at the speed of its rim and feels
    the mass as inertia. With `friction` the ground's acceleration is at most friction x gravity.
    The rest of the wheel's turning is slip. While the wheel slips, it feels the force of friction
    instead of the mass.

    Not emulated: a friction that depends on speed or direction, and a share of the weight that
    changes with acceleration.

    Attributes:
        radius_m: radius of the wheel.
        mass_kg: share of the body's mass that the wheel carries.
        friction: coefficient of friction, or None if the wheel never slips.
        speed_m_s: speed of the ground below the wheel.
        slip_m_s: speed of the rim relative to the ground, which is 0 with grip.
    """

    radius_m: float
    mass_kg: float
    friction: float | None = None
    speed_m_s: float = field(default=0.0, init=False)
    slip_m_s: float = field(default=0.0, init=False)

    def roll(self, turn_rad: float, step_s: float) -> float:
        """Turn the wheel by an angle; return the distance that it rolls over the ground, in metres.

        The wheel turns at a steady speed during the step. Friction limits how fast the speed of the
        wheel over the ground can change. While this speed differs from the speed of the wheel's
        rim, the wheel slips.
        """
        rim_m_s = turn_rad * self.radius_m / step_s
        speed_m_s = rim_m_s
        if self.friction is not None:
            most = self.friction * GRAVITY_M_S2 * step_s
            speed_m_s = min(max(rim_m_s, self.speed_m_s - most), self.speed_m_s + most)
        self.speed_m_s, self.slip_m_s = speed_m_s, rim_m_s - speed_m_s
        return speed_m_s * step_s

    @property
    def load_kg_m2(self) -> float:
        """The inertia that the wheel feels."""
        return 0.0 if self.slip_m_s else self.mass_kg * self.radius_m**2

    @property
    def load_nm(self) -> float:
        """The torque that the ground exerts on the wheel, positive forward."""
        if not self.slip_m_s or self.friction is None:
            return 0.0
        torque_nm = self.friction * self.mass_kg * GRAVITY_M_S2 * self.radius_m
        return -torque_nm if self.slip_m_s > 0 else torque_nm


# A body on driven wheels at its left and right side.

STEP_S: Final = 1e-3
"""Length of a step; drives tick at the same period."""

SIDES: Final = {
    "differential": (("left",), ("right",)),
    "skid-steer": (("front_left", "rear_left"), ("front_right", "rear_right")),
}
"""Names of the wheels on the left and on the right side, by kind of body."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyParameters(Immutable):
    """Parameters of a body on driven wheels: its kind, dimensions, mass and friction.

    Attributes:
        kind: kind of body: `differential` with two wheels, or `skid-steer` with four wheels.
        wheel_radius_m: radius of each wheel, in metres.
        tread_m: distance between the left and the right wheels, in metres.
        mass_kg: mass on the driven wheels. Each wheel carries the same share.
        friction: coefficient of friction between wheels and ground, or None if the wheels never
            slip.

    Raises:
        ValueError: the kind is unknown, or a length or mass is out of range.
    """

    kind: str
    wheel_radius_m: float
    tread_m: float
    mass_kg: float = 0.0
    friction: float | None = None

    def __post_init__(self) -> None:
        """Raise ValueError if a parameter is out of range."""
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

    In each step the body moves as far as its wheels have turned since the previous step, on an
    exact arc. The mass of the body lies above the wheels, at half the tread to each side. So each
    wheel feels mass / number of wheels x radius squared, both straight on and in a turn.

    Not emulated: castors, the force that turns the wheels of a skid steer sideways, rolling
    resistance, slopes, collisions.

    Args:
        parameters: dimensions, mass and friction.

    Attributes:
        pose: position and heading of the body, which may be set.
        speed_m_s: forward speed in the latest step.
        turn_rad_s: turning speed to the left in the latest step.
        contacts: wheels on the ground, by name.
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
        """Advance by one step in which the wheels have turned to the given angles."""
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


# A body on three omni wheels, which can translate and turn at the same time.

_OMNI_STEP_S: Final = 1e-3

_BEARINGS: Final = (pi / 3, pi, -pi / 3)
"""Bearings of the wheels, from the front to the left. Each wheel rolls at right angles to its
bearing."""


class Velocity(NamedTuple):
    """Velocity in the frame of the body: forward (m/s), to the left (m/s), turning left (rad/s)."""

    vx: float = 0.0
    vy: float = 0.0
    w: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OmniParameters(Immutable):
    """Parameters of a body on three omni wheels, which can move in every direction.

    Attributes:
        wheel_radius_m: radius of each wheel, in metres.
        base_radius_m: distance from the middle of the body to each wheel, in metres.
        response_s: time constant with which a wheel follows its commanded speed, in seconds.
        most_rad_s: highest speed of a wheel, in rad/s.

    Raises:
        ValueError: a number is not above 0.
    """

    wheel_radius_m: float = 0.05
    base_radius_m: float = 0.2
    response_s: float = 0.05
    most_rad_s: float = 20.0

    def __post_init__(self) -> None:
        """Raise ValueError if a parameter is not above 0."""
        for name in ("wheel_radius_m", "base_radius_m", "response_s", "most_rad_s"):
            if not 0 < (value := getattr(self, name)) < 1_000:
                raise ValueError(f"{name} {value} is not above 0 and below 1000")

    def wheel_speeds(self, velocity: Velocity) -> tuple[float, ...]:
        """Return the speeds of the three wheels, in rad/s, that give the body a velocity.

        If a wheel would be faster than `most_rad_s`, all speeds are scaled down by the same factor.
        """
        vx, vy, turn = velocity.vx, velocity.vy, velocity.w * self.base_radius_m
        rims = (vy * cos(at) - vx * sin(at) + turn for at in _BEARINGS)
        speeds = tuple(rim / self.wheel_radius_m for rim in rims)
        share = min(1.0, self.most_rad_s / max(1e-9, *map(abs, speeds)))
        return tuple(speed * share for speed in speeds)

    def velocity(self, speeds: tuple[float, ...]) -> Velocity:
        """Return the velocity of the body for given wheel speeds.

        >>> omni = OmniParameters()
        >>> [round(n, 6) for n in omni.velocity(omni.wheel_speeds(Velocity(0.1, -0.2, 0.3)))]
        [0.1, -0.2, 0.3]
        """
        rims = [speed * self.wheel_radius_m for speed in speeds]
        pairs = list(zip(rims, _BEARINGS, strict=True))
        vx = -reduce(add, [rim * sin(at) for rim, at in pairs], 0.0) * 2 / 3
        vy = reduce(add, [rim * cos(at) for rim, at in pairs], 0.0) * 2 / 3
        return Velocity(vx, vy, reduce(add, rims, 0.0) / 3 / self.base_radius_m)


@dataclass(slots=True)
class OmniBody(Copyable):
    """A body on three wheels that follow their commanded speeds with a time constant, without slip.

    Rollers, slip, mass, encoders and the motor driver are not emulated.

    Attributes:
        parameters: dimensions and response.
        pose: position and heading of the body, which may be set.
        velocity: velocity of the body in the latest step.
    """

    parameters: OmniParameters = field(default_factory=OmniParameters)
    pose: Pose = field(default_factory=Pose)
    velocity: Velocity = field(default=Velocity(), init=False)
    _speeds: tuple[float, ...] = field(default=(0.0, 0.0, 0.0), init=False)

    def step(self, wanted: Velocity) -> None:
        """Advance by one millisecond."""
        share = _OMNI_STEP_S / (_OMNI_STEP_S + self.parameters.response_s)
        wheels = zip(self._speeds, self.parameters.wheel_speeds(wanted), strict=True)
        self._speeds = tuple(speed + (target - speed) * share for speed, target in wheels)
        self.velocity = velocity = self.parameters.velocity(self._speeds)
        pose, turn_rad = self.pose, velocity.w * _OMNI_STEP_S
        middle_rad = pose.heading_rad + turn_rad / 2
        ahead_m, left_m = velocity.vx * _OMNI_STEP_S, velocity.vy * _OMNI_STEP_S
        self.pose = Pose(
            pose.x_m + ahead_m * cos(middle_rad) - left_m * sin(middle_rad),
            pose.y_m + ahead_m * sin(middle_rad) + left_m * cos(middle_rad),
            pose.heading_rad + turn_rad,
        )
