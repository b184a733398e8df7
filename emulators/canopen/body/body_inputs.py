"""What can be done to a body: put it elsewhere, change the ground below it."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, radians
from typing import Final

from tickrig.device.body.wheeled_body import WheeledBody
from tickrig.device.physical import Input, QuantityBank, SignalType
from tickrig.host.text.values import Setting

FAR_M: Final = 1e6
"""As far as a body can be put."""

MOST_FRICTION: Final = 10


class PoseSignal:
    """One coordinate of a body; setting it puts the body elsewhere, wheels and speed as they are.

    Args:
        body: the body.
        name: `x_m`, `y_m` or `heading_deg`.
        text: what it is, for people.
        unit: its unit.
    """

    def __init__(self, body: WheeledBody, name: str, text: str, unit: str) -> None:
        most = 180 if name == "heading_deg" else FAR_M
        self.item = Input(name, text, SignalType.LEVEL, -most, most, unit, real=True)
        self._body, self._bank = body, QuantityBank([self.item])

    def read(self) -> float:
        """Return where it is now."""
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
        """Put it there."""
        number, pose = float(self.check(value)), self._body.pose
        match self.item.name:
            case "x_m":
                pose = replace(pose, x_m=number)
            case "y_m":
                pose = replace(pose, y_m=number)
            case _:
                pose = replace(pose, heading_rad=radians(number))
        self._body.pose = pose


class FrictionSignal:
    """The ground's friction, of a body that can slip."""

    def __init__(self, body: WheeledBody) -> None:
        text = "coefficient of friction between wheels and ground"
        self.item = Input("friction", text, high=MOST_FRICTION, real=True)
        self._body, self._bank = body, QuantityBank([self.item])

    def read(self) -> float:
        """Return the coefficient."""
        return next(iter(self._body.contacts.values())).friction or 0.0

    def check(self, value: Setting) -> float:
        """Return the value, or raise ValueError."""
        return self._bank.check(self.item.name, value)

    def write(self, value: Setting) -> None:
        """Change the ground below all wheels."""
        friction = float(self.check(value))
        for contact in self._body.contacts.values():
            contact.friction = friction
