"""A base on its serial line: driver, wheels and ground in each millisecond."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from tickrig.device.body.contact import Contact
from tickrig.device.modbus.slave import ModbusSlave
from tickrig.device.physical import Output, QuantityBank
from tickrig.device.rh3.driver import Driver
from tickrig.device.rh3.ground import Ground
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rh3.side import Side
from tickrig.device.rh3.terminals import INPUTS, OUTPUTS, SIDES
from tickrig.wire.rh3 import Status

TICK_US: Final = 1_000

LOOK_US: Final = 10_000
"""How often the world looks at it."""


class Rh3Base:
    """The base of Reference Hardware 3 as a Modbus RTU slave; a `Device[bytes]`.

    The real one speaks an unpublished protocol; rh3-control proposes Modbus RTU in its
    place, with the register map of `register_map`. In each millisecond: bytes from the
    line, targets, watchdog and faults, servo, ground. Nobody need tick it for that: what
    has passed since is made up for. `read` gives what was to be seen at the latest
    multiple of `LOOK_US`.

    Not emulated: the library libsvm, battery, heat, the outline of the robot.

    Args:
        parameters: what it is like.

    Attributes:
        inputs: what the world does to it, see `terminals.INPUTS`.
        ground: where it is; its pose may be set.
        sides: left and right wheel with their loops.
        slave: its end of the line.
    """

    def __init__(self, parameters: BaseParameters | None = None) -> None:
        self.parameters = parameters or BaseParameters()
        self.inputs = QuantityBank(INPUTS)
        self.ground = Ground(self.parameters)
        self._driver = driver = Driver(self.parameters, self.inputs)
        self.sides = driver.sides
        self.slave = ModbusSlave(driver.registers, driver.written, self.parameters.address)
        self._on, self._moving, self._unseen, self._now_us = True, False, True, 0
        self._seen = {name: read(self) for name, read in _READ.items()}

    @property
    def tick_us(self) -> int:
        """The period of the servo."""
        return TICK_US

    @property
    def due_us(self) -> int:
        """When anything would happen without input."""
        if self.inputs.changed:
            return 0
        due_us = self.slave.due_us
        if self._unseen:
            due_us = min(due_us, self._now_us - self._now_us % LOOK_US + LOOK_US)
        return due_us

    @property
    def outputs(self) -> Mapping[str, Output]:
        """What `read` knows."""
        return _OUTPUTS

    @property
    def status(self) -> Status:
        """What the driver says of itself; nothing without supply."""
        return self._driver.status if self._on else Status(0)

    def reset(self) -> None:
        """Begin as after power-up, where it stands."""
        self._driver.power_up()
        self.slave.reset()
        self._on = self.inputs.changed = True

    def read(self, name: str, /) -> float:
        """Return one of `outputs`; KeyError if unknown."""
        return self._seen[name]

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Let time pass up to now."""
        self._catch_up(now_us)
        if self.inputs.changed:
            self._touched()
        sent = b""
        if self._on:
            self._unseen |= bool(rx) or self.slave.due_us <= now_us
            sent = self.slave.tick(now_us, rx)
        self._step()
        if now_us % LOOK_US == 0:
            self._seen = {name: read(self) for name, read in _READ.items()}
            self._unseen = self._moving
        return sent

    def _catch_up(self, now_us: int) -> None:
        """Make the steps of the milliseconds before this one."""
        driver = self._driver
        while self._moving and driver.now_us < now_us - TICK_US:
            driver.now_us += TICK_US
            self._step()
        self._now_us = driver.now_us = now_us

    def _step(self) -> None:
        driver, ground = self._driver, self.ground
        if self._on:
            driver.step(self.slave.heard_us)
        else:
            driver.coast()
        left, right = self.sides
        ground.step(left.wheel.turned_rad, right.wheel.turned_rad)
        self._moving = not (driver.resting and ground.resting)
        self._unseen |= self._moving

    def _touched(self) -> None:
        self.inputs.changed, self._unseen = False, True
        for side in self.sides:
            side.touched(self.inputs)
        on = not self.inputs["power_cut"]
        if on != self._on:
            self._on = on
            self._driver.power_up()
            self.slave.reset()
        self._driver.find_faults()


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
