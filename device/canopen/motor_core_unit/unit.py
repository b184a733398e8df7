"""The application of the motor core unit."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.slave import TICK_US, CanopenSlave
from tickrig.device.canopen.motor_core_unit.display import Display
from tickrig.device.canopen.motor_core_unit.faults import Signs
from tickrig.device.canopen.motor_core_unit.motion import ACTS, Act, Motion, mode_of
from tickrig.device.canopen.motor_core_unit.references import References
from tickrig.device.canopen.motor_core_unit.shaft import Shaft
from tickrig.device.canopen.motor_core_unit.supervision import Supervision
from tickrig.device.canopen.motor_core_unit.terminals import INPUTS, OUTPUTS, READINGS, feel
from tickrig.device.canopen.motor_core_unit.trajectory import CONTROL_US, DEGREE
from tickrig.device.servo.presets import MOTOR_CORE_UNIT
from tickrig.device.servo.servo import Servo
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER

MODE: Final = 0x2000

COOLING_US: Final = 1_000_000
"""How often a motor at rest is looked at until it has the temperature of the air."""

COOLED_C: Final = 0.1


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

    outputs = MappingProxyType({output.name: output for output in OUTPUTS})

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.has_inputs(INPUTS)
        self.servo = Servo(MOTOR_CORE_UNIT)
        self._shaft, self._references = Shaft(self.servo), References(node, self.request)
        self._motion = Motion(self._shaft, self._references)
        self._supervision = Supervision(node)
        self._display = Display(node.dictionary, self._shaft, self._references)
        self._mode = node.dictionary[MODE, 0]
        self._mode.written = self._mode_written
        self.watch([self._mode, *self._references.entries])
        self._begin_us, self._mode_was_written = 0, False

    def read(self, name: str) -> float | str:
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
        feel(self.servo, self.inputs)
        return NEVER if self.servo.resting else now_us + TICK_US

    def start(self) -> None:
        """Know of no fault; where the shaft is says the gear encoder."""
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
        feel(self.servo, self.inputs)
        failed = self._supervise(now_us)
        controls = failed or now_us - self._begin_us >= CONTROL_US
        if controls:
            self._control(now_us)
        self._motion.drive(now_us - self._begin_us)
        self.schedule(self._rested_us(now_us) if controls and self._rests else now_us + TICK_US)

    def _supervise(self, now_us: int) -> bool:
        """Find new faults, let go of old ones; say whether there is a new one."""
        if self._mode_was_written:
            self._mode_was_written = False
            if self._supervision.clear(self._signs(now_us)):
                self._shaft.find_zero()
        failed = self._supervision.look(now_us, self._signs(now_us))
        self._references.failed |= failed
        return failed

    def _control(self, now_us: int) -> None:
        """Begin a control tick."""
        self._begin_us = now_us
        self.servo.current_limit_a = self._references.current_limit_ma / 1_000
        self._motion.plan(self._act)
        self._display.show(self._motion, faulty=bool(self._supervision.faults))

    @property
    def _act(self) -> Act:
        """What faults, NMT state and mode let the motor do."""
        if self._supervision.faults:
            return Act.COAST
        act = ACTS[mode_of(self._mode.number)]
        if act is Act.COAST or self.node.state is NmtState.OPERATIONAL:
            return act
        return Act.BRAKE

    def _signs(self, now_us: int) -> Signs:
        servo, on = self.servo, self._motion.on
        return Signs(
            on=on,
            loops=self._motion.loops,
            tripped=on and bool(self.inputs["short_circuit"]),
            supply_mv=servo.supply_mv,
            winding_dc=servo.winding_dc,
            housing_dc=round(servo.housing_c * 10),
            velocity_deg_s=self._shaft.velocity_udeg_s / 1e6,
            current_ma=servo.current_ma,
            limited=servo.current_limited,
            astray=self._motion.astray(now_us - self._begin_us),
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
