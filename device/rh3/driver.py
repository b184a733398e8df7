"""The motor driver: its registers, and its control of two wheels."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Final

from tickrig.device.modbus import Register, Registers
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.rh3.parameters import COUNTS_PER_RAD, ENCODER_COUNTS, BaseParameters
from tickrig.device.rh3.side import STALL_MS, Side
from tickrig.device.twin import Part
from tickrig.wire.instant import NEVER
from tickrig.wire.modbus import DEVICE_ID, VERSION, Address, Command, Fault, Mode, Status

# The registers of the driver (rh3-control, drive protocol: register map A).

_INT32: Final = range(-(2**31), 2**31)
_SPEED_LIMIT: Final = round(10 * COUNTS_PER_RAD)
"""Speed limit in counts/s: Velocity_limit 10.0 of the specification, taken as rad/s of the
wheel."""
_ACCELERATION_LIMIT: Final = round(50 * COUNTS_PER_RAD)
"""Acceleration limit in counts/s2: Acceleration_limit 50.0, taken as rad/s2 of the wheel."""
_MOST_GAIN: Final = 32_767


def _fixed(address: Address, text: str, value: int) -> Register:
    return Register(address, address.name.lower(), text, initial=value)


def _setting(address: Address, text: str, high: int, initial: int) -> Register:
    name = address.name.lower()
    return Register(address, name, text, high=high, initial=initial, writable=True)


def _wide(address: Address, text: str, initial: int = 0, *, target: bool = False) -> Register:
    low, high = (_INT32[0], _INT32[-1]) if target else (0, _INT32[-1])
    name = address.name.lower()
    return Register(address, name, text, 2, target, low, high, initial, writable=True)


def _measured(address: Address, text: str, words: int = 1) -> Register:
    return Register(address, address.name.lower(), text, words, signed=words == 2)


TABLE: Final = (
    _fixed(Address.DEVICE_ID, "5248h", DEVICE_ID),
    _fixed(Address.VERSION, "high byte major, low byte minor", VERSION),
    _setting(Address.MODE, "0 free, 1 velocity, 2 position", 2, Mode.FREE),
    _setting(Address.COMMAND, "1 enable .. 6 zero counters", 6, Command.NONE),
    _setting(Address.WATCHDOG_MS, "silence that stops the base, 0 for never", 0xFFFF, 500),
    _setting(Address.GAIN_P, "position, 1/s", _MOST_GAIN, 10),
    _setting(Address.GAIN_I, "position, 1/s2", _MOST_GAIN, 0),
    _setting(Address.GAIN_D, "position", _MOST_GAIN, 0),
    _setting(Address.GAIN_VP, "velocity, per mille of torque for a count/ms", _MOST_GAIN, 10),
    _setting(Address.GAIN_VI, "velocity, per mille for a count", _MOST_GAIN, 0),
    _setting(Address.GAIN_VD, "velocity, per mille for a count/ms in a ms", _MOST_GAIN, 1),
    _wide(Address.SPEED_LIMIT, "counts/s", _SPEED_LIMIT),
    _wide(Address.ACCELERATION_LIMIT, "counts/s2", _ACCELERATION_LIMIT),
    _fixed(
        Address.ENCODER_COUNTS,
        "counts in a turn of a motor",
        ENCODER_COUNTS,
    ),
    _setting(Address.DIRECTION, "bit 0: left runs backward; bit 1: right", 3, 0),
    _wide(Address.TARGET_SPEED_LEFT, "counts/s", target=True),
    _wide(Address.TARGET_SPEED_RIGHT, "counts/s", target=True),
    _wide(Address.TARGET_POSITION_LEFT, "counts", target=True),
    _wide(Address.TARGET_POSITION_RIGHT, "counts", target=True),
    _measured(Address.STATUS, "see Status"),
    _measured(Address.FAULT_LEFT, "see Fault"),
    _measured(Address.FAULT_RIGHT, "see Fault"),
    _measured(Address.SAMPLE, "milliseconds since power-up, modulo 65536"),
    _measured(Address.POSITION_LEFT, "counts", 2),
    _measured(Address.POSITION_RIGHT, "counts", 2),
    _measured(Address.SPEED_LEFT, "counts/s", 2),
    _measured(Address.SPEED_RIGHT, "counts/s", 2),
    _measured(Address.CURRENT_LEFT, "mA, two's complement"),
    _measured(Address.CURRENT_RIGHT, "mA, two's complement"),
)


# Physical inputs and outputs of a base.

_SIDES: Final = ("left", "right")

INPUTS: Final = (
    InputSignal("emergency_stop", "the red button is down", SignalType.FAULT),
    InputSignal("bumper", "the bumper touches something", SignalType.BUTTON),
    *(
        InputSignal(
            f"load_{side}_nm",
            f"torque against the {side} wheel",
            low=-100,
            high=100,
            unit="Nm",
            real=True,
        )
        for side in _SIDES
    ),
    *(
        InputSignal(f"jam_{side}", f"something holds the {side} wheel", SignalType.FAULT)
        for side in _SIDES
    ),
    *(
        InputSignal(
            f"encoder_unplugged_{side}", f"no signal of the {side} encoder", SignalType.FAULT
        )
        for side in _SIDES
    ),
    *(
        InputSignal(
            f"short_circuit_{side}", f"windings of the {side} motor touch", SignalType.FAULT
        )
        for side in _SIDES
    ),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

OUTPUTS: Final = (
    OutputSignal("x_m", "true place", "m"),
    OutputSignal("y_m", "true place, to the left of x", "m"),
    OutputSignal("heading_rad", "true heading, not wrapped", "rad"),
    OutputSignal("speed_m_s", "true speed forward", "m/s"),
    OutputSignal("turn_rad_s", "true turning to the left", "rad/s"),
    OutputSignal("angle_left_rad", "true angle of the left wheel", "rad"),
    OutputSignal("angle_right_rad", "true angle of the right wheel", "rad"),
    OutputSignal("slip_left_m_s", "speed of the left rim over the ground", "m/s"),
    OutputSignal("slip_right_m_s", "speed of the right rim over the ground", "m/s"),
    OutputSignal("torque_left_pm", "torque of the left motor, of the rated one", "per mille"),
    OutputSignal("torque_right_pm", "torque of the right motor, of the rated one", "per mille"),
    OutputSignal("status", "status register 0200h"),
    OutputSignal("served", "requests that were answered or obeyed"),
    OutputSignal("garbled", "frames with a wrong length or CRC"),
)


_TARGETS: Final = frozenset(f"target_{what}_{s}" for what in ("speed", "position") for s in _SIDES)
ENABLED, MOVING, FAULT, WATCHDOG, CLIPPED, EMERGENCY_STOP, BUMPER = (int(bit) for bit in Status)
"""Bits of the status, as plain numbers because an enum flag takes ten times as long."""

_STEP_US: Final = 1_000

_Pair = tuple[list[float], list[float]]
"""Speeds of the left and right wheel in each millisecond."""

_DELAYED: Final = _TARGETS | {"mode", "command"}
"""Registers whose orders take effect after the delay."""


class Driver(Part):
    """Controls two wheels by its registers (rh3-control, drive protocol, register map A).

    A fault of one wheel switches both wheels off and shorts the motors. The fault stays until it is
    cleared and its cause is gone. If a master is silent for `watchdog_ms` while the base moves, the
    driver stops the base on the ramp. A new target starts the base again. The driver ignores an
    order to enable that it cannot execute. The status then shows that the driver is not enabled.

    Args:
        parameters: parameters of the base.
        inputs: physical inputs of the base.

    Attributes:
        now_us: present time, which must be set before any other call.
        registers: registers of the master.
        sides: left and right wheel with their control loops.
    """

    def __init__(self, parameters: BaseParameters, inputs: QuantityBank) -> None:
        self._inputs, self._delay_us = inputs, parameters.delay_ms * 1_000
        self.now_us = self._start_us = 0
        measured = {"status": self._status, "sample": self._sample}
        self.registers = Registers(TABLE, measured)
        self.sides = tuple(
            Side(name, bit, parameters, self.registers) for bit, name in enumerate(_SIDES)
        )
        for side in self.sides:
            measured.update(side.measured)
        self.power_up()

    def power_up(self) -> None:
        """Restart; turning wheels keep turning."""
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
        """Status register."""
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
        """Whether a step leaves everything unchanged."""
        left, right = self.sides
        return not self._waiting and left.resting and right.resting

    def written(self, values: Mapping[str, int]) -> None:
        """Apply a write of the master, at once or after the delay."""
        if values.keys() - _DELAYED:
            self._configure()
        if values.keys() & _DELAYED:
            self._waiting.append((self.now_us + self._delay_us, values))

    def step(self, last_request_us: int, until_us: int) -> _Pair:
        """Run both wheels for one millisecond, or for several if nothing changes between them.

        Args:
            last_request_us: time of the latest request of the master.
            until_us: time of the last millisecond that the call may run. After the call, the
                attribute `now_us` of this object is the time of the last millisecond that the call
                has run.

        Returns:
            The speeds of the left and the right wheel in each millisecond, in counts/ms.
        """
        if self._waiting:
            self._take_waiting()
        # After the orders: a target that takes effect clears a trip of the watchdog. It does not
        # end the silence that led to the trip, so without another request the base stops again.
        if self.now_us - last_request_us >= self._watch_us:
            self._watch()
        left, right = self.sides
        if left.stalled or right.stalled:
            self.find_faults()
        # Mode 0 leaves the motors open; a fault shorts both, whichever wheel has it.
        powered = self._enabled and self._mode is not Mode.FREE
        if powered != self._powered:
            powered = self._switch(powered=powered)
        if not powered:
            return left.coast(shorted=self._faulty), right.coast(shorted=self._faulty)
        stop, to_position = self._stopped, self._mode is Mode.POSITION
        steps = 1
        if until_us > self.now_us and not to_position:
            steps = self._alike(last_request_us, until_us)
            self.now_us += (steps - 1) * _STEP_US
        return (
            left.drive(steps, stop=stop, to_position=to_position),
            right.drive(steps, stop=stop, to_position=to_position),
        )

    def coast(self) -> _Pair:
        """Run a millisecond without supply, in which a relay shorts the motors."""
        left, right = self.sides
        return left.coast(shorted=True), right.coast(shorted=True)

    def _alike(self, last_request_us: int, until_us: int) -> int:
        """Return the number of equal milliseconds from the present one on, with a silent master."""
        left, right = self.sides
        if left.stalling or right.stalling:
            return 1
        # The run ends before a millisecond that differs from the present one: the one in which the
        # silence becomes long enough, or the one of the next waiting order. STALL_MS bounds the
        # run, so that a stall is found in its own millisecond.
        until_us = min(until_us, last_request_us + self._watch_us - 1)
        if self._waiting:
            until_us = min(until_us, self._waiting[0][0] - 1)
        return max(1, min((until_us - self.now_us) // _STEP_US + 1, STALL_MS))

    def _status(self) -> int:
        return self.status

    def _sample(self) -> int:
        return (self.now_us - self._start_us) // 1_000 & 0xFFFF

    def find_faults(self) -> None:
        """Check for faults, and switch both wheels off if one is present."""
        for side in self.sides:
            side.find_faults(self._inputs, powered=self._powered)
        self._faulty = any(side.fault for side in self.sides)
        if self._faulty:
            self._enabled = False

    def _take_waiting(self) -> None:
        while self._waiting and self._waiting[0][0] <= self.now_us:
            self._obey(self._waiting.popleft()[1])

    def _obey(self, values: Mapping[str, int]) -> None:
        # Any new target ends a stop, also a stop of the watchdog. A master that sends again need
        # not clear it.
        if values.keys() & _TARGETS:
            self._tripped = self._stopped = False
        for side in self.sides:
            side.obey(values)
        self._mode = Mode(values.get("mode", self._mode))
        match values.get("command"):
            case Command.ENABLE:
                # Enabling is ignored while a fault is present. Bit 0 of the status shows this,
                # because map A has no answer for it.
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
        """Stop because the master is silent."""
        if self._powered and not self._stopped and not self.resting:
            self._stop(quick=False)
            self._tripped = True

    def _configure(self) -> None:
        # 0 switches the watchdog off (0012h).
        self._watch_us = self.registers["watchdog_ms"] * 1_000 or NEVER
        for side in self.sides:
            side.configure()

    def _switch(self, *, powered: bool) -> bool:
        """Switch the power on or off; return whether it is on, which a fault may prevent."""
        self._powered = powered
        for side in self.sides:
            side.take_over()
        self.find_faults()
        return powered and self._enabled
