"""A drive (CiA 402-2): its objects, its modes of operation and its motor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Final

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.slave import TICK_US, CanopenSlave
from tickrig.device.canopen.ds402.modes.mode import Mode
from tickrig.device.canopen.ds402.modes.modes import MODES, offered, supported
from tickrig.device.canopen.ds402.motion.axis import Axis
from tickrig.device.canopen.ds402.motion.limits import Limits
from tickrig.device.canopen.ds402.motion.motor import IdealMotor, Motor
from tickrig.device.canopen.ds402.motion.reference import Control, Reference
from tickrig.device.canopen.ds402.motion.stopping import Stopping
from tickrig.device.canopen.ds402.motion.switches import Switches
from tickrig.device.canopen.ds402.objects import indices, terminals
from tickrig.device.canopen.ds402.objects.allowed import guard_values
from tickrig.device.canopen.ds402.objects.parameters import Parameters
from tickrig.device.canopen.ds402.objects.settings import CONFIGURATION, Settings, read_settings
from tickrig.device.canopen.ds402.objects.telling import MEASURES, Measure, Multiplexer, Telling
from tickrig.device.canopen.ds402.state.automaton import Automaton
from tickrig.device.canopen.ds402.state.connection import Connection
from tickrig.device.canopen.ds402.state.fault_memory import FaultMemory
from tickrig.device.canopen.ds402.state.faults import ErrorCode
from tickrig.device.canopen.ds402.state.state import Controlword, DriveState, command_of
from tickrig.device.canopen.ds402.state.supervision import Bounds, Supervision
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.servo.servo import Servo

TARGETS: Final = (
    *(indices.TARGET_TORQUE, indices.TARGET_POSITION, indices.TARGET_VELOCITY),
    *(indices.POSITION_OFFSET, indices.VELOCITY_OFFSET, indices.TORQUE_OFFSET),
    indices.INTERPOLATION_DATA,
)


COOLING_US: Final = 1_000_000
"""Period in which a drive at rest looks at its temperature."""


class Ds402(Application):
    """A drive of one axis.

    The controlword acts when it changes; from Ready to switch on, Enable operation
    leads through Switched on at once. A lost connection and NMT Stop act as 6007h
    says while the motor has power. A mode that the drive has not is refused with
    0609 0030h. Without a servo, the motor is an ideal one.

    Not emulated: a brake, the velocity mode 2 of frequency converters, touch probes.

    Args:
        node: the slave.
        slot: its place in the tick.
        servo: motor, power stage and load.

    Attributes:
        modes: the modes that the drive has, by number.
        measures: what its objects tell.
        bounds: what it takes for sound.
        encoder_error: what it calls a pulled encoder.
        limits_are_faults: the end of the way is a fault, not just a stop.
        more_targets: objects of a maker whose change is a new target.
        settings: the present configuration.
        axis: motor, reference and zero.
        faults: those since the last reset.
        connection: the way to the master.
        control: the loop that the motor works with in this tick.
        controlword: as it was written last.
        mode: the mode of operation at work.
        mode_number: its number, as in 6061h.
        fresh: a SYNC came or a target changed since the last step.
        limited: a limit cut something in this step (bit 11 of the statusword).
    """

    modes: ClassVar[Mapping[int, type[Mode]]] = MODES
    measures: ClassVar[Mapping[Multiplexer, Measure]] = MEASURES
    bounds: ClassVar[Bounds] = Bounds()
    encoder_error: ClassVar[ErrorCode] = ErrorCode.INCREMENTAL_SENSOR
    limits_are_faults: ClassVar[bool] = False
    more_targets: ClassVar[tuple[int, ...]] = ()
    outputs = terminals.OUTPUTS

    settings: Settings
    axis: Axis
    motor: Motor
    reference: Reference
    switches: Switches
    control: Control
    mode: Mode
    mode_number: int

    def __init__(self, node: CanopenSlave, slot: int, servo: Servo | None = None) -> None:
        super().__init__(node, slot)
        self._servo = servo
        motor: Motor = servo or IdealMotor()
        self.parameters = Parameters(node.dictionary)
        listed = self.parameters.number(indices.SUPPORTED_MODES)
        self.offered = offered(self.modes, listed)
        self._supported = listed or supported(self.offered)
        self.settings = read_settings(self.parameters, motor.counts_per_turn)
        self.axis = Axis(motor, self.settings)
        self.motor, self.reference, self.switches = motor, self.axis.reference, Switches()
        self.automaton, self.stopping, self.limits = Automaton(self), Stopping(self), Limits(self)
        self.supervision, self.telling = (
            Supervision(self, self.bounds),
            Telling(self, self.measures),
        )
        self.faults, self.connection = FaultMemory(self), Connection(self)
        self.control, self.controlword = Control.POSITION, 0
        self.mode, self.mode_number = Mode(self), 0
        self.fresh = self.limited = False
        self._stale = True
        self._wired: tuple[ErrorCode, ...] = ()
        self._winding_dc = 0
        plant = () if servo is None else terminals.PLANT_INPUTS
        self.has_inputs((*terminals.DRIVE_INPUTS, *plant))
        self._listen()

    def _listen(self) -> None:
        parameters = self.parameters
        parameters.watch((indices.CONTROLWORD,), self._controlled)
        parameters.watch((indices.MODES_OF_OPERATION,), self._mode_written)
        parameters.watch((*TARGETS, *self.more_targets), self._refresh)
        parameters.watch(CONFIGURATION, self._outdate)
        guard_values(self.node.dictionary, self.offered)
        self.node.on_sync.append(self._sync)

    @property
    def state(self) -> DriveState:
        """The state of the drive."""
        return self.automaton.state

    @property
    def enabled(self) -> bool:
        """Whether it is in Operation enabled."""
        return self.automaton.state is DriveState.OPERATION_ENABLED

    @property
    def following_error(self) -> float:
        """Counts from the motor to the reference."""
        return self.reference.position - self.motor.counts

    def read(self, name: str) -> float | str:
        """Return a physical output."""
        return terminals.READ[name](self)

    def target_velocity(self, offset: int = 0) -> float:
        """Return 60FFh and an offset in counts per second, cut to the limits."""
        settings = self.settings
        wanted = self.parameters.number(indices.TARGET_VELOCITY) + offset
        return self.limits.velocity(wanted * settings.units.per_velocity)

    def target_current(self, offset: int = 0) -> float:
        """Return 6071h and an offset in amperes, cut to the limits."""
        per_mille = (self.parameters.number(indices.TARGET_TORQUE) + offset) * self.axis.forward
        return self.limits.current(per_mille * self.settings.rated_current_a / 1_000)

    def within(self, counts: float) -> float:
        """Return a position in counts, cut to the software limits."""
        return self.limits.position(counts)

    def fault(self, code: int) -> None:
        """Have a fault with an emergency error code."""
        self.faults.take(code)

    def wired_faults(self) -> list[ErrorCode]:
        """Return the faults that the electronics see; a short circuit needs power to be seen."""
        if not self._wired:
            return []
        powered = self.automaton.powered
        return [code for code in self._wired if powered or code is not ErrorCode.OVER_CURRENT]

    def begin_mode(self) -> None:
        """Begin the chosen mode anew."""
        self.mode = self.modes[self.mode_number](self)
        self.mode.enter()

    def operate(self, now_us: int) -> bool:
        """Make a step of the mode; say whether nothing is left to do."""
        mode = self.mode
        self.control = mode.control
        step = mode.halt if mode.halts and mode.halted else mode.run
        return self.limits.guard(step, now_us) if mode.minds_limits else step(now_us)

    def power_on(self) -> None:
        """Count from 0 on."""
        self.motor.release()
        self.axis.zero, self.axis.homed = float(self.motor.counts), False

    def without_power(self, now_us: int) -> int:
        """Let the shaft coast."""
        self.motor.release()
        self.motor.step_to(now_us)
        if self.inputs.changed:
            self.inputs.changed = False
            self._inputs_changed()
        return NEVER if self.motor.resting else now_us + TICK_US

    def start(self) -> None:
        """Switch off."""
        self.faults.forget()
        self.connection.lost.clear()
        self.automaton.restart()
        self.controlword = self.parameters.number(indices.CONTROLWORD)
        self.parameters.write(indices.SUPPORTED_MODES, self._supported)
        self._stale = True
        self._change_mode()

    def emergency(self, code: int, register: int, text: bytes) -> None:
        """Remember that the connection is lost."""
        self.connection.lose(code)

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        """Remember that it is there again."""
        self.connection.lost.discard(code)

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Take NMT Stop for a lost connection."""
        if new is NmtState.STOPPED:
            self.communication_error()

    def communication_error(self) -> None:
        """Act as 6007h says."""
        self.connection.abort()

    def on_execute(self, now_us: int) -> None:
        """Measure, watch, make a step, command the motor, tell."""
        self.motor.step_to(now_us)
        self._look()
        for code in self.supervision.find(now_us):
            self.fault(code)
        self.limited = False
        settled = self.automaton.run(now_us)
        if self.automaton.powered:
            self.axis.command(self.control)
        else:
            self.axis.release()
        self.fresh = False
        self.telling.tell()
        self._sleep(now_us, settled and not self.supervision.waiting)

    def _look(self) -> None:
        """Follow configuration, physical inputs and the shaft."""
        self._configure()
        if self.inputs.changed:
            self.inputs.changed = False
            self._inputs_changed()
        if self.switches.by_angle:
            self.switches.look(self.motor.shaft_deg)
        self.axis.wrap()

    def _configure(self) -> None:
        if self._stale:
            self._stale = False
            self.motor.step_to(self.node.now_us)
            self.settings = read_settings(self.parameters, self.motor.counts_per_turn)
            self.axis.configure(self.settings)

    def _inputs_changed(self) -> None:
        inputs = self.inputs
        self.switches.set(inputs)
        wired = (
            (terminals.SHORT_CIRCUIT, ErrorCode.OVER_CURRENT),
            (terminals.ENCODER_UNPLUGGED, self.encoder_error),
        )
        self._wired = tuple(code for name, code in wired if inputs[name])
        if self._servo is not None:
            terminals.load(self._servo, inputs)

    def _sleep(self, now_us: int, settled: bool) -> None:
        """Come back in the next tick, or each second while the winding cools, or never."""
        if not (settled and self.motor.resting):
            self.schedule(now_us + TICK_US)
        elif self._winding_dc != self.motor.winding_dc:
            self._winding_dc = self.motor.winding_dc
            self.schedule(now_us + COOLING_US)

    def _controlled(self, entry: Entry) -> None:
        """Obey a new controlword, with what was configured before it."""
        self._configure()
        before, self.controlword = self.controlword, self.parameters.number(indices.CONTROLWORD)
        rising, falling = self.controlword & ~before, before & ~self.controlword
        command = command_of(self.controlword)
        if self.state is DriveState.FAULT and rising & Controlword.FAULT_RESET:
            self.faults.reset((*self.supervision.present(), *self.connection.lost))
        elif command is not None:
            self.automaton.obey(command)
        if self.enabled:
            if rising & Controlword.START:
                self.mode.start()
            if falling & Controlword.START:
                self.mode.stop()
        self.request()

    def _mode_written(self, entry: Entry) -> None:
        self._change_mode()

    def _change_mode(self) -> None:
        number = self.parameters.number(indices.MODES_OF_OPERATION)
        if number in self.offered:
            self.mode_number = number
            self.parameters.write(indices.MODES_OF_OPERATION_DISPLAY, number)
            if self.enabled:
                self.begin_mode()
        self.request()

    def _sync(self, counter: int) -> None:
        self.fresh = True
        if self.enabled:
            self.request()

    def _refresh(self, entry: Entry) -> None:
        self.fresh = True
        self.request()

    def _outdate(self, entry: Entry) -> None:
        self._stale = True
        self.request()
