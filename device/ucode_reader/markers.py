"""Infra-red markers in the environment, and which of them a reader hears."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, isfinite, radians, remainder, tau

from tickrig.device.body.pose import Pose
from tickrig.device.twin import Immutable
from tickrig.device.ucode_reader.parameters import ReaderParameters
from tickrig.wire.errors import FieldError
from tickrig.wire.sensors.ucode import MAX_LEVEL, parse_ucode


@dataclass(frozen=True, slots=True)
class Marker(Immutable):
    """A marker that sends its ucode to all sides, on a flat floor.

    Attributes:
        ucode: 128 bits, 32 hex digits in capitals.
        x_m: its place.
        y_m: its place, to the left of x.

    Raises:
        ValueError: no ucode, or no place.
    """

    ucode: str
    x_m: float
    y_m: float

    def __post_init__(self) -> None:
        """Refuse what is no marker."""
        if not (isfinite(self.x_m) and isfinite(self.y_m)):
            raise ValueError(f"a marker has a place, got {self.x_m}, {self.y_m}")
        if parse_ucode(self.ucode) != self.ucode:
            raise FieldError(f"ucode {self.ucode!r} is not written in capitals")


@dataclass(frozen=True, slots=True)
class Reception(Immutable):
    """A marker that was heard.

    Attributes:
        ucode: what it sent.
        level: of its signal: 100 % at the reader, falling to 1 % at the end of the range.
    """

    ucode: str
    level: int


def receive(
    markers: Sequence[Marker], pose: Pose, parameters: ReaderParameters, share: float = 1.0
) -> tuple[Reception, ...]:
    """Return the markers that a reader hears, the nearest first.

    Not there: walls, which infra-red light does not pass; markers that disturb one another;
    reflections.

    Args:
        markers: those that send.
        pose: of the reader.
        parameters: its range and cone.
        share: of its range that is left, as of a dirty window, 0..1.
    """
    range_m, half_rad = parameters.range_m * share, radians(parameters.cone_deg) / 2
    found = []
    for marker in markers:
        dx, dy = marker.x_m - pose.x_m, marker.y_m - pose.y_m
        away_m = hypot(dx, dy)
        off_rad = abs(remainder(atan2(dy, dx) - pose.heading_rad, tau)) if away_m else 0.0
        if away_m <= range_m and off_rad <= half_rad:
            level = max(1, round(MAX_LEVEL * (1 - away_m / parameters.range_m)))
            found.append((away_m, marker.ucode, Reception(marker.ucode, level)))
    return tuple(reception for _, _, reception in sorted(found, key=lambda item: item[:2]))
