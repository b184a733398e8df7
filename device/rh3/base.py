"""A base on its serial line: driver, wheels and ground in each millisecond."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from tickrig.device.body.contact import Contact
from tickrig.device.core import NEVER
from tickrig.device.modbus.slave import ModbusSlave
from tickrig.device.physical import Output, QuantityBank
from tickrig.device.rh3.driver import Driver
from tickrig.device.rh3.ground import Ground
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rh3.register_map import Status
from tickrig.device.rh3.side import Side
from tickrig.device.rh3.terminals import INPUTS, OUTPUTS, SIDES

TICK_US: Final = 1_000


class Rh3Base:
    """The base of Reference Hardware 3 as a Modbus RTU slave; a `Device[bytes]`.

    The real one speaks an unpublished protocol; rh3-control proposes Modbus RTU in its
    place, with the register map of `register_map`. In each tick: bytes from the line,
    targets, watchdog and faults, servo, ground.

    Not emulated: the library libsvm, battery, heat, the outline of the robot.

    Args:
        parameters: what it is like.

    Attributes:
        inputs: what the world does to it, see `terminals.INPUTS`.
        ground: where it is; its pose may be set.
        slave: its end of the line.
    """

    def __init__(self, parameters: BaseParameters | None = None) -> None:
        self.parameters = parameters or BaseParameters()
        self.inputs = QuantityBank(INPUTS)
        self.ground = Ground(self.parameters)
        self._driver = Driver(self.parameters, self.inputs)
        self.slave = ModbusSlave(
            self._driver.registers, self._driver.written, self.parameters.address
        )
        self._on, self._now_us = True, 0

    @property
    def tick_us(self) -> int:
        """The period of the servo."""
        return TICK_US

    @property
    def due_us(self) -> int:
        """When anything would happen without input."""
        if self.inputs.changed:
            return 0
        if not (self._driver.resting and self.ground.resting):
            return self._now_us + TICK_US
        return self.slave.due_us if self._on else NEVER

    @property
    def outputs(self) -> Mapping[str, Output]:
        """What `read` knows."""
        return _OUTPUTS

    @property
    def status(self) -> Status:
        """What the driver says of itself; none without supply."""
        return self._driver.status if self._on else Status(0)

    @property
    def sides(self) -> tuple[Side, ...]:
        """Left and right wheel with their loops."""
        return self._driver.sides

    def reset(self) -> None:
        """Begin as after power-up, where it stands."""
        self._driver.power_up()
        self.slave.reset()
        self._on, self.inputs.changed = True, True

    def read(self, name: str, /) -> float:
        """Return one of `outputs`; KeyError if unknown."""
        return _READ[name](self)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Let a millisecond pass."""
        self._now_us = self._driver.now_us = now_us
        if self.inputs.changed:
            self._touched()
        if self._on:
            sent = self.slave.tick(now_us, rx)
            self._driver.step(self.slave.heard_us)
        else:
            sent = b""
            self._driver.coast()
        self._move()
        return sent

    def _touched(self) -> None:
        self.inputs.changed = False
        for side in self._driver.sides:
            side.touched(self.inputs)
        on = not self.inputs["power_cut"]
        if on != self._on:
            self._on = on
            self._driver.power_up()
            self.slave.reset()

    def _move(self) -> None:
        left, right = (side.wheel.turned_rad for side in self._driver.sides)
        self.ground.step(left, right)


_OUTPUTS: Final = {output.name: output for output in OUTPUTS}

Reading = Callable[[Rh3Base], float]


def _of_sides(pattern: str, read: Callable[[Side, Contact], float]) -> dict[str, Reading]:
    def of(place: int) -> Reading:
        return lambda base: read(base.sides[place], base.ground.contacts[place])

    return {pattern.format(name): of(place) for place, name in enumerate(SIDES)}


_READ: Final[Mapping[str, Reading]] = {
    "x_m": lambda base: base.ground.pose.x_m,
    "y_m": lambda base: base.ground.pose.y_m,
    "heading_rad": lambda base: base.ground.pose.heading_rad,
    "speed_m_s": lambda base: base.ground.speed_m_s,
    "turn_rad_s": lambda base: base.ground.turn_rad_s,
    **_of_sides("angle_{}_rad", lambda side, contact: side.wheel.angle_rad),
    **_of_sides("slip_{}_m_s", lambda side, contact: contact.slip_m_s),
    **_of_sides("torque_{}_pm", lambda side, contact: side.torque),
    "status": lambda base: int(base.status),
    "served": lambda base: base.slave.served,
    "garbled": lambda base: base.slave.garbled,
}
