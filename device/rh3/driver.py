"""The motor driver: what a master told it, and what its two wheels do."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Final

from tickrig.device.modbus.registers import Registers
from tickrig.device.physical import QuantityBank
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rh3.register_map import TABLE
from tickrig.device.rh3.side import STALL_MS, Side
from tickrig.device.rh3.terminals import SIDES
from tickrig.device.twin import Part
from tickrig.wire.instant import NEVER
from tickrig.wire.modbus.rh3 import Command, Fault, Mode, Status

TARGETS: Final = frozenset(f"target_{what}_{s}" for what in ("speed", "position") for s in SIDES)
ENABLED, MOVING, FAULT, WATCHDOG, CLIPPED, EMERGENCY_STOP, BUMPER = (int(bit) for bit in Status)
"""Plain numbers: a flag takes ten times as long."""

STEP_US: Final = 1_000

Pair = tuple[list[float], list[float]]
"""Left and right, of each millisecond."""

DELAYED: Final = TARGETS | {"mode", "command"}
"""What takes effect after the delay."""


class Driver(Part):
    """Runs two wheels as its registers say (rh3-control, drive protocol, register map A).

    A fault of one wheel takes the power from both and shorts the motors; it stays until
    it is cleared and its cause is gone. A master that is silent for `watchdog_ms` while
    the base moves stops it on the ramp; a new target starts it again. An order to enable
    that cannot be followed is passed over; the status tells.

    Args:
        parameters: of the base.
        inputs: what the world does to it.

    Attributes:
        now_us: the present time, set before anything is asked of it.
        registers: what a master sees.
        sides: left and right wheel with their loops.
    """

    def __init__(self, parameters: BaseParameters, inputs: QuantityBank) -> None:
        self._inputs, self._delay_us = inputs, parameters.delay_ms * 1_000
        self.now_us = self._start_us = 0
        measured = {"status": self._status, "sample": self._sample}
        self.registers = Registers(TABLE, measured)
        self.sides = tuple(
            Side(name, bit, parameters, self.registers) for bit, name in enumerate(SIDES)
        )
        for side in self.sides:
            measured.update(side.measured)
        self.power_up()

    def power_up(self) -> None:
        """Begin anew; what turns goes on turning."""
        self._start_us = self.now_us
        self.registers.reset()
        self._waiting: deque[tuple[int, Mapping[str, int]]] = deque()
        self._enabled = self._powered = self._tripped = self._stopped = False
        self._mode, self._faulty = Mode.FREE, False
        self._watch_us = self.registers["watchdog_ms"] * 1_000
        for side in self.sides:
            side.power_up()

    @property
    def status(self) -> int:
        """What the driver says of itself."""
        left, right = self.sides
        status = ENABLED * self._enabled | FAULT * self._faulty | WATCHDOG * self._tripped
        if left.wheel.speed or right.wheel.speed:
            status |= MOVING
        if left.clipped or right.clipped:
            status |= CLIPPED
        if self._inputs["emergency_stop"]:
            status |= EMERGENCY_STOP
        if self._inputs["bumper"]:
            status |= BUMPER
        return status

    @property
    def resting(self) -> bool:
        """Whether a step would change nothing."""
        left, right = self.sides
        return not self._waiting and left.resting and right.resting

    def written(self, values: Mapping[str, int]) -> None:
        """Take what a master wrote, at once or after the delay."""
        if values.keys() - DELAYED:
            self._configure()
        if values.keys() & DELAYED:
            self._waiting.append((self.now_us + self._delay_us, values))

    def step(self, last_request_us: int, until_us: int) -> Pair:
        """Let the millisecond of `now_us` pass, and those behind it in which nothing happens.

        Args:
            last_request_us: when the master was heard last.
            until_us: the last of them; `now_us` becomes the one that was made last.

        Returns:
            The speeds of the wheels in each, counts/ms.
        """
        if self._waiting:
            self._take_waiting()
        if self.now_us - last_request_us >= self._watch_us:
            self._watch()
        left, right = self.sides
        if left.stalled or right.stalled:
            self.find_faults()
        powered = self._enabled and self._mode is not Mode.FREE
        if powered != self._powered:
            powered = self._switch(powered=powered)
        if not powered:
            return left.coast(shorted=self._faulty), right.coast(shorted=self._faulty)
        stop, to_position = self._stopped, self._mode is Mode.POSITION
        steps = 1
        if until_us > self.now_us and not to_position:
            steps = self._alike(last_request_us, until_us)
            self.now_us += (steps - 1) * STEP_US
        return (
            left.drive(steps, stop=stop, to_position=to_position),
            right.drive(steps, stop=stop, to_position=to_position),
        )

    def coast(self) -> Pair:
        """Let a millisecond pass without supply: a relay shorts the motors."""
        left, right = self.sides
        return left.coast(shorted=True), right.coast(shorted=True)

    def _alike(self, last_request_us: int, until_us: int) -> int:
        """Return how many milliseconds are like the present one, with it: the master is silent."""
        left, right = self.sides
        if left.stalling or right.stalling:
            return 1
        until_us = min(until_us, last_request_us + self._watch_us - 1)
        if self._waiting:
            until_us = min(until_us, self._waiting[0][0] - 1)
        return max(1, min((until_us - self.now_us) // STEP_US + 1, STALL_MS))

    def _status(self) -> int:
        return self.status

    def _sample(self) -> int:
        return (self.now_us - self._start_us) // 1_000 & 0xFFFF

    def find_faults(self) -> None:
        """Look for faults, and take the power from both wheels if there is one."""
        for side in self.sides:
            side.find_faults(self._inputs, powered=self._powered)
        self._faulty = any(side.fault for side in self.sides)
        if self._faulty:
            self._enabled = False

    def _take_waiting(self) -> None:
        while self._waiting and self._waiting[0][0] <= self.now_us:
            self._obey(self._waiting.popleft()[1])

    def _obey(self, values: Mapping[str, int]) -> None:
        if values.keys() & TARGETS:
            self._tripped = self._stopped = False
        for side in self.sides:
            side.obey(values)
        self._mode = Mode(values.get("mode", self._mode))
        match values.get("command"):
            case Command.ENABLE:
                self._enabled = not self._faulty
            case Command.DISABLE:
                self._enabled = False
            case Command.STOP | Command.QUICK_STOP as command:
                self._stop(quick=command == Command.QUICK_STOP)
            case Command.CLEAR_FAULT:
                self._clear_faults()
            case Command.ZERO_COUNTERS:
                for side in self.sides:
                    side.zero()
            case _:
                return

    def _clear_faults(self) -> None:
        for side in self.sides:
            side.fault = Fault(0)
        self.find_faults()

    def _stop(self, *, quick: bool) -> None:
        self._stopped = True
        for side in self.sides:
            side.stop(quick=quick)

    def _watch(self) -> None:
        """Stop: the master is silent."""
        if self._powered and not self._stopped and not self.resting:
            self._stop(quick=False)
            self._tripped = True

    def _configure(self) -> None:
        self._watch_us = self.registers["watchdog_ms"] * 1_000 or NEVER
        for side in self.sides:
            side.configure()

    def _switch(self, *, powered: bool) -> bool:
        """Give or take power; return whether the wheels have it, as a fault may take it."""
        self._powered = powered
        for side in self.sides:
            side.take_over()
        self.find_faults()
        return powered and self._enabled
