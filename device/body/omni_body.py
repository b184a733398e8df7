"""A body on three omni wheels: it goes any way, and turns meanwhile."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import reduce
from math import cos, pi, sin
from operator import add
from typing import Final, NamedTuple

from tickrig.device.body.pose import Pose
from tickrig.device.twin import Copyable, Immutable

STEP_S: Final = 1e-3

BEARINGS: Final = (pi / 3, pi, -pi / 3)
"""Where the wheels are, from the front to the left; each rolls at right angles to that."""


class Velocity(NamedTuple):
    """In the frame of the body: m/s forward, m/s to the left, rad/s to the left."""

    vx: float = 0.0
    vy: float = 0.0
    w: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OmniParameters(Immutable):
    """What a body is like.

    Attributes:
        wheel_radius_m: of each wheel.
        base_radius_m: from the middle to each wheel.
        response_s: time constant of the wheels' speed.
        most_rad_s: the highest speed of a wheel.

    Raises:
        ValueError: a number that is not above 0.
    """

    wheel_radius_m: float = 0.05
    base_radius_m: float = 0.2
    response_s: float = 0.05
    most_rad_s: float = 20.0

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        for name in ("wheel_radius_m", "base_radius_m", "response_s", "most_rad_s"):
            if not 0 < (value := getattr(self, name)) < 1_000:
                raise ValueError(f"{name} {value} is not above 0 and below 1000")

    def wheel_speeds(self, velocity: Velocity) -> tuple[float, ...]:
        """Return the speeds of the wheels in rad/s; all slower alike where one is too fast."""
        vx, vy, turn = velocity.vx, velocity.vy, velocity.w * self.base_radius_m
        rims = (vy * cos(at) - vx * sin(at) + turn for at in BEARINGS)
        speeds = tuple(rim / self.wheel_radius_m for rim in rims)
        share = min(1.0, self.most_rad_s / max(1e-9, *map(abs, speeds)))
        return tuple(speed * share for speed in speeds)

    def velocity(self, speeds: tuple[float, ...]) -> Velocity:
        """Return how the body goes when its wheels turn at these speeds.

        >>> omni = OmniParameters()
        >>> [round(n, 6) for n in omni.velocity(omni.wheel_speeds(Velocity(0.1, -0.2, 0.3)))]
        [0.1, -0.2, 0.3]
        """
        rims = [speed * self.wheel_radius_m for speed in speeds]
        pairs = list(zip(rims, BEARINGS, strict=True))
        vx = -reduce(add, [rim * sin(at) for rim, at in pairs], 0.0) * 2 / 3
        vy = reduce(add, [rim * cos(at) for rim, at in pairs], 0.0) * 2 / 3
        return Velocity(vx, vy, reduce(add, rims, 0.0) / 3 / self.base_radius_m)


@dataclass(slots=True)
class OmniBody(Copyable):
    """Three wheels that follow their commands with a time constant, without slip.

    Not emulated: rollers, slip, mass, encoders, the driver.

    Attributes:
        parameters: what it is like.
        pose: where it is; it may be put elsewhere.
        velocity: in the latest step.
    """

    parameters: OmniParameters = field(default_factory=OmniParameters)
    pose: Pose = field(default_factory=Pose)
    velocity: Velocity = field(default=Velocity(), init=False)
    _speeds: tuple[float, ...] = field(default=(0.0, 0.0, 0.0), init=False)

    def step(self, wanted: Velocity) -> None:
        """Go on for a millisecond."""
        share = STEP_S / (STEP_S + self.parameters.response_s)
        wheels = zip(self._speeds, self.parameters.wheel_speeds(wanted), strict=True)
        self._speeds = tuple(speed + (target - speed) * share for speed, target in wheels)
        self.velocity = velocity = self.parameters.velocity(self._speeds)
        pose, turn_rad = self.pose, velocity.w * STEP_S
        middle_rad = pose.heading_rad + turn_rad / 2
        ahead_m, left_m = velocity.vx * STEP_S, velocity.vy * STEP_S
        self.pose = Pose(
            pose.x_m + ahead_m * cos(middle_rad) - left_m * sin(middle_rad),
            pose.y_m + ahead_m * sin(middle_rad) + left_m * cos(middle_rad),
            pose.heading_rad + turn_rad,
        )
