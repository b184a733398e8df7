"""Limit switches and home switch of an axis (CiA 402-2, 60FDh)."""

from __future__ import annotations

from math import inf
from typing import Final

from tickrig.device.physical import InputSignal, QuantityBank
from tickrig.device.twin import Part

FAR_DEG: Final = 1e9
"""An angle that no shaft ever reaches."""

NEGATIVE_LIMIT: Final = 0x01
POSITIVE_LIMIT: Final = 0x02
HOME: Final = 0x04
"""Bits of 60FDh."""

INPUTS: Final[tuple[InputSignal, ...]] = (
    InputSignal("negative_limit_switch", "limit switch in negative direction is pressed by hand"),
    InputSignal("positive_limit_switch", "limit switch in positive direction is pressed by hand"),
    InputSignal("home_switch", "home switch is pressed by hand"),
    *(
        InputSignal(name, text, low=-FAR_DEG, high=FAR_DEG, unit="deg", initial=initial, real=True)
        for name, text, initial in (
            ("negative_limit_at", "angle at and below which the shaft presses it", -FAR_DEG),
            ("positive_limit_at", "angle at and above which the shaft presses it", FAR_DEG),
            ("home_from", "angle from which the shaft presses the home switch", FAR_DEG),
            ("home_to", "angle up to which the shaft presses the home switch", -FAR_DEG),
        )
    ),
)


class Switches(Part):
    """The switches as the drive sees them: pressed by hand, or by the shaft at an angle.

    Negative and positive are directions of the user, as 607Eh makes them.

    Attributes:
        word: bits 0 to 2 of 60FDh.
        by_angle: the shaft presses some of them.
    """

    def __init__(self) -> None:
        self.word = 0
        self._hand = 0
        self._angles = (-inf, inf, inf, -inf)
        self.by_angle = False

    def set(self, inputs: QuantityBank) -> None:
        """Follow the physical inputs."""
        hand, angles = INPUTS[:3], INPUTS[3:]
        self._hand = sum(1 << bit for bit, item in enumerate(hand) if inputs[item.name])
        low, high, first, last = (inputs[item.name] for item in angles)
        self._angles = low, high, first, last
        self.by_angle = any(inputs[item.name] != item.initial for item in angles)
        self.word = self._hand

    def look(self, shaft_deg: float) -> None:
        """Follow the shaft."""
        low, high, first, last = self._angles
        self.word = (
            self._hand
            | (NEGATIVE_LIMIT if shaft_deg <= low else 0)
            | (POSITIVE_LIMIT if shaft_deg >= high else 0)
            | (HOME if first <= shaft_deg <= last else 0)
        )

    @property
    def free(self) -> bool:
        """Whether no limit switch is pressed, nor could be by the shaft."""
        return not (self.by_angle or self.word & (NEGATIVE_LIMIT | POSITIVE_LIMIT))

    @property
    def negative_limit(self) -> bool:
        """Whether the negative limit switch is pressed."""
        return bool(self.word & NEGATIVE_LIMIT)

    @property
    def positive_limit(self) -> bool:
        """Whether the positive limit switch is pressed."""
        return bool(self.word & POSITIVE_LIMIT)

    @property
    def home(self) -> bool:
        """Whether the home switch is pressed."""
        return bool(self.word & HOME)
