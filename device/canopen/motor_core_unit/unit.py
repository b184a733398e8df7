"""The application of the motor core unit, with its physical side."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.slave import TICK_US, CanopenSlave
from tickrig.device.canopen.motor_core_unit.faults import Measurements, Supervision
from tickrig.device.canopen.motor_core_unit.motion import ACTIONS, Action, Display, Motion, mode_of
from tickrig.device.canopen.motor_core_unit.objects import References
from tickrig.device.canopen.motor_core_unit.shaft import Shaft
from tickrig.device.canopen.motor_core_unit.trajectory import CONTROL_US, DEGREE
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.servo.presets import MOTOR_CORE_UNIT
from tickrig.device.servo.servo import Servo
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER

LOAD: Final = "torque from outside at the shaft, positive drives it forward"

INPUTS: Final = (
    InputSignal("supply_v", "supply of the motor", high=80, unit="V", initial=60, real=True),
    InputSignal("shaft_load_nm", LOAD, low=-100, high=100, unit="Nm", real=True),
    InputSignal("load_kg_m2", "inertia of what is on the shaft", high=10, unit="kg m2", real=True),
    InputSignal(
        "ambient_c", "air around it", low=-40, high=125, unit="degC", initial=25, real=True
    ),
    InputSignal("shaft_blocked", "the shaft is held", SignalType.FAULT),
    InputSignal("encoder_unplugged", "the plug of the motor encoder is off", SignalType.FAULT),
    InputSignal("motor_phase_open", "a wire of the motor is off", SignalType.FAULT),
    InputSignal("short_circuit", "two wires of the motor touch", SignalType.FAULT),
)

OUTPUTS: Final = (
    OutputSignal("angle_deg", "angle of the shaft, without the offset 2011h", "deg"),
    OutputSignal("velocity_deg_s", "velocity of the shaft", "deg/s"),
    OutputSignal("current_a", "current in the motor", "A"),
    OutputSignal("winding_c", "temperature of the winding", "degC"),
    OutputSignal("target_deg", "where the reference wants the shaft in angle mode", "deg"),
    OutputSignal("mode", "free, current, velocity or angle"),
    OutputSignal("status", "off, on, or the faults that are there"),
)

READINGS: Final[Mapping[str, Callable[[Servo], float]]] = MappingProxyType(
    {
        "angle_deg": lambda servo: servo.shaft_deg,
        "velocity_deg_s": lambda servo: servo.shaft_deg_s,
        "current_a": lambda servo: servo.current_a,
        "winding_c": lambda servo: servo.winding_c,
    }
)
"""The outputs that are the motor's own."""


def apply_inputs(servo: Servo, inputs: QuantityBank) -> None:
    """Let the world act on the motor, if it has changed."""
    if inputs.changed:
        inputs.changed = False
        servo.supply_v, servo.ambient_c = inputs["supply_v"], inputs["ambient_c"]
        servo.load_nm, servo.load_kg_m2 = inputs["shaft_load_nm"], inputs["load_kg_m2"]
        servo.blocked = bool(inputs["shaft_blocked"])
        servo.encoder_unplugged = bool(inputs["encoder_unplugged"])
        servo.phase_open = bool(inputs["motor_phase_open"])


MODE: Final = 0x2000

COOLING_US: Final = 1_000_000
"""How often a motor at rest is looked at until it has the temperature of the air."""

COOLED_C: Final = 0.1


@mypyc_attr(allow_interpreted_subclasses=True)
class MotorCoreUnit(Application):
    """A brushless motor with strain wave gear, two encoders and driver (NEDO report, Table 5).

    A reference acts only in Operational; in other NMT states a motor that has a mode
    brakes to standstill and is held there. A control tick has 10 ms; what wakes a unit
    at rest begins one. Faults take the power off the motor until a write to 2000h finds
    their causes gone.

    Not emulated: commutation, torque ripple, elasticity and play of the gear, power
    that comes back into the supply while braking, failure of the control supply.

    Attributes:
        servo: motor, gear and loops.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.has_inputs(INPUTS)
        self.outputs = {output.name: output for output in OUTPUTS}
        self.servo = Servo(MOTOR_CORE_UNIT)
        self._shaft, self._references = Shaft(self.servo), References(node, self.request)
        self._motion = Motion(self._shaft, self._references)
        self._supervision = Supervision(node)
        self._display = Display(node.dictionary, self._shaft, self._references)
        self._mode = node.dictionary[MODE, 0]
        self._mode.written = self._mode_written
        self.watch([self._mode, *self._references.entries])
        self._begin_us, self._mode_was_written = 0, False

    def read(self, name: str) -> int | float | str:
        """Return the present value of a physical output."""
        if name in READINGS:
            return READINGS[name](self.servo)
        match name:
            case "target_deg":
                return self._references.target_ndeg / DEGREE
            case "mode":
                return mode_of(self._mode.number).name.lower()
            case "status":
                return self._status
        raise KeyError(name)

    def power_on(self) -> None:
        """Find a motor that has been without power since the last tick."""
        self.servo.release()

    def without_power(self, now_us: int) -> int:
        """Let the shaft coast."""
        self.servo.release()
        self.servo.step_to(now_us)
        apply_inputs(self.servo, self.inputs)
        return NEVER if self.servo.resting else now_us + TICK_US

    def start(self) -> None:
        """Know of no fault; the gear encoder says where the shaft is."""
        self._supervision.start()
        self._references.start()
        self._mode_was_written = False
        self._shaft.find_zero()
        self.request()

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Let references act in Operational only."""
        if new is NmtState.OPERATIONAL:
            self._references.failed = False
        self.request()

    def communication_error(self) -> None:
        """Let 6443h and 6444h give the reference."""
        self._references.failed = True
        self.request()

    def on_execute(self, now_us: int) -> None:
        """Let time pass for the motor, look after it, drive it."""
        self.servo.step_to(now_us)
        apply_inputs(self.servo, self.inputs)
        failed = self._supervise(now_us)
        controls = failed or now_us - self._begin_us >= CONTROL_US
        if controls:
            self._control(now_us)
        self._motion.drive(now_us - self._begin_us)
        self.schedule(self._rested_us(now_us) if controls and self._rests else now_us + TICK_US)

    def _supervise(self, now_us: int) -> bool:
        """Find new faults, let go of old ones. Returns: whether there is a new one."""
        if self._mode_was_written:
            self._mode_was_written = False
            if self._supervision.clear(self._measurements(now_us)):
                self._shaft.find_zero()
        failed = self._supervision.look(now_us, self._measurements(now_us))
        self._references.failed |= failed
        return failed

    def _control(self, now_us: int) -> None:
        """Begin a control tick."""
        self._begin_us = now_us
        self.servo.current_limit_a = self._references.current_limit_ma / 1_000
        self._motion.plan(self._action)
        self._display.show(self._motion, faulty=bool(self._supervision.faults))

    @property
    def _action(self) -> Action:
        """What faults, NMT state and mode let the motor do."""
        if self._supervision.faults:
            return Action.COAST
        action = ACTIONS[mode_of(self._mode.number)]
        if action is Action.COAST or self.node.state is NmtState.OPERATIONAL:
            return action
        return Action.BRAKE

    def _measurements(self, now_us: int) -> Measurements:
        servo, on = self.servo, self._motion.on
        return Measurements(
            on=on,
            loops=self._motion.loops,
            tripped=on and bool(self.inputs["short_circuit"]),
            supply_mv=servo.supply_mv,
            winding_dc=servo.winding_dc,
            housing_dc=round(servo.housing_c * 10),
            velocity_deg_s=self._shaft.velocity_udeg_s / 1e6,
            current_ma=servo.current_ma,
            limited=servo.current_limited,
            deviates=self._motion.deviates(now_us - self._begin_us),
            spare_mv=servo.spare_mv,
            overloaded=servo.overloaded,
            slip_deg=self._shaft.slip_deg,
        )

    @property
    def _status(self) -> str:
        faults = ", ".join(fault.name for fault in self._supervision.faults)
        return faults or ("on" if self._motion.on else "off")

    @property
    def _rests(self) -> bool:
        return self._motion.steady and self.servo.resting and not self._supervision.waiting

    def _rested_us(self, now_us: int) -> int:
        """Return when to look at a motor at rest again: as long as it cools down or warms up."""
        air_c, servo = self.servo.ambient_c, self.servo
        warmer_c = max(abs(servo.winding_c - air_c), abs(servo.housing_c - air_c))
        return now_us + COOLING_US if warmer_c > COOLED_C else NEVER

    def _mode_written(self, entry: Entry) -> None:
        self._mode_was_written = True
        self.request()
