"""A drive (CiA 402-2): its objects, its modes of operation and its motor."""

# Theory of operation.
#
# A drive is an `Application` of its slave: it works in the ticks that are requested. A tick
# (`on_execute`) has these steps:
#
# 1. The motor moves up to the present time (`step_to`).
# 2. Inputs and shaft are read, and `Supervision` detects the faults.
# 3. `Automaton` runs the state machine, and in it one step of the mode of operation.
# 4. The motor gets its new demand, and the actual values are updated.
#
# Watchers detect changes of objects (controlword, mode, target, configuration) and request a tick
# (`request`). A controlword takes effect at once, before the tick, with the configuration before
# it.
#
# At the end of a tick `_sleep` schedules the next one: never while nothing moves and the mode has
# settled, each second while the winding cools, otherwise in the next millisecond.
#
# Run-ahead. Between two SYNCs a drive in csp does the same work each millisecond. `_sleep` calls
# `Stretch.plan`, which computes such ticks in one loop over floats. The result is equal to that
# of single ticks to the bit. This has two conditions:
#   - The rig must allow it (`Horizon.until_us`).
#   - The next ticks must be plain (`goes_on_plainly`): the state is Operation enabled, no input
#     or configuration has changed, no fault is waiting, no limit switch is in reach, no actual
#     value is watched.
# The loop ends before the first tick in which anything else would happen: heat must be computed,
# a demand is cut, the following error is too large, the shaft stands or sticks. `on_execute` runs
# that tick. The loop computes as many ticks as the latest quiet period had, less one: a SYNC that
# comes a tick early must not make the loop run twice.
#
# The result (`RunAhead`) becomes the state of the drive only as time passes. Code that reads the
# drive earlier gets the state at that moment: `axis`, `limited`, `read` and the objects call
# `Stretch.catch_up`, which applies the ticks up to `Horizon.passed_us` and computes the rest
# again. Code that changes the drive calls `_interrupt` first. `_interrupt` catches up, drops the
# ticks ahead and writes the actual values, so that they are those of the tick before. A drive
# without `horizon` (no rig, dense, couplings, watchers) works tick by tick.
#
# Actual values are computed when they are read (`ActualValues`). `begin` makes the written values
# visible while the drive works. `renew` makes the values follow the drive again and writes those
# that are watched.
#
# Homing, another mode or another table of limits belongs to `modes/`. What all modes obey
# (limits, switches, stopping) is in `axis`. Objects and their units are in `settings`.

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from enum import IntEnum
from functools import partial
from typing import ClassVar, Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Dictionary, Entry, SdoAbort
from tickrig.device.canopen.ds402 import automaton, indices, settings, terminals
from tickrig.device.canopen.ds402.actual_values import MEASURES, ActualValues, Measure
from tickrig.device.canopen.ds402.axis import (
    Axis,
    IdealMotor,
    Limits,
    Motor,
    Ramp,
    Stopping,
    Switches,
)
from tickrig.device.canopen.ds402.modes.homing import METHODS
from tickrig.device.canopen.ds402.modes.mode import DriveView, Mode
from tickrig.device.canopen.ds402.modes.modes import MODES, offered, supported
from tickrig.device.canopen.ds402.stretch import Stretch
from tickrig.device.canopen.ds402.trapezoid import RampShape
from tickrig.device.canopen.slave import TICK_US, Application, CanopenSlave
from tickrig.device.servo.servo import Servo
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.drive import Controlword, DriveState
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

# Values that objects of a drive accept; others are refused with 0609 0030h (CiA 402-2).

_ALLOWED: Final[dict[int, Container[Value]]] = {
    indices.ABORT_CONNECTION: (0, 1, 2, 3),
    indices.QUICK_STOP_OPTION: (0, 1, 2, 3, 5, 6, 7),
    indices.SHUTDOWN_OPTION: (0, 1),
    indices.DISABLE_OPERATION_OPTION: (0, 1),
    indices.HALT_OPTION: (1, 2, 3),
    indices.FAULT_REACTION_OPTION: (0, 1, 2, 3),
    indices.MOTION_PROFILE: tuple(RampShape),
    indices.HOMING_METHOD: (0, *METHODS),
    indices.INTERPOLATION_SUBMODE: (0,),
}
"""Accepted values by index; homing method 0 means no homing."""


def _guard_values(dictionary: Dictionary, modes: Iterable[int]) -> None:
    """Attach guards that refuse values a drive with these modes of operation does not have."""
    for index, allowed in {**_ALLOWED, indices.MODES_OF_OPERATION: tuple(modes)}.items():
        entry = dictionary.find(index)
        if entry is not None:
            entry.guard = partial(_check, allowed)


def _check(allowed: Container[Value], entry: Entry, value: Value) -> None:
    if value not in allowed:
        raise SdoAbort(AbortCode.VALUE_RANGE)


_TARGETS: Final = (
    *(indices.TARGET_TORQUE, indices.TARGET_POSITION, indices.TARGET_VELOCITY),
    *(indices.POSITION_OFFSET, indices.VELOCITY_OFFSET, indices.TORQUE_OFFSET),
    indices.INTERPOLATION_DATA,
)

_MOVING: Final = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
"""States in which a lost connection matters."""

_COOLING_US: Final = 1_000_000
"""Period at which a drive at rest updates its temperature."""


class _AbortConnection(IntEnum):
    """Reactions to a lost connection (6007h). Other values have no effect."""

    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


@mypyc_attr(allow_interpreted_subclasses=True)
class Ds402(Application):
    """A drive of one axis.

    A controlword takes effect when it changes. From Ready to switch on, Enable operation leads
    through Switched on at once. After a lost connection or NMT Stop the drive reacts according to
    6007h while the motor has power. A mode that the drive does not have is refused with 0609
    0030h. Without a servo, the motor is an ideal motor.

    A pressed limit switch stops the motor with the quick stop deceleration. So does a software
    limit that the motion would exceed if it did not brake. Afterwards the motor can be moved
    back.

    Not emulated: a brake, the velocity mode 2 of frequency converters, touch probes.

    Args:
        node: the slave.
        slot: position of the application in the order in which services act in a tick.
        servo: motor, power stage and load, or None for an ideal motor.
        defaults: values of objects that the dictionary does not have, by (index, sub-index).

    Attributes:
        modes: modes of operation that the drive has, by number.
        measures: functions for the actual values, by index.
        bounds: limits within which the drive reports no fault.
        encoder_error: error code of an encoder that is pulled out.
        limits_are_faults: whether reaching a limit is a fault, not only a stop.
        more_targets: manufacturer-specific objects whose change is a new target.
        outputs: physical outputs. `read` returns their values.
        parameters: objects of the drive, by index.
        offered: modes by number that both the drive and its dictionary have.
        limits: limits of position and velocity.
        automaton: state machine of CiA 402.
        supervision: object that detects faults of supply, temperature, encoder and following error.
        actual_values: objects that show measurements.
        switches: limit switches and home switch.
        mode: active mode of operation.
        mode_number: number of the active mode, as in 6061h.
    """

    modes: ClassVar[Mapping[int, type[Mode]]] = MODES
    measures: ClassVar[Mapping[int, Measure]] = MEASURES
    bounds: ClassVar[automaton.Bounds] = automaton.Bounds()
    encoder_error: ClassVar[settings.ErrorCode] = settings.ErrorCode.INCREMENTAL_SENSOR
    limits_are_faults: ClassVar[bool] = False
    more_targets: ClassVar[tuple[int, ...]] = ()

    switches: Switches
    mode: Mode
    mode_number: int

    def __init__(
        self,
        node: CanopenSlave,
        slot: int,
        servo: Servo | None = None,
        defaults: Mapping[tuple[int, int], int] = indices.DEFAULTS,
    ) -> None:
        super().__init__(node, slot)
        self._servo, self.outputs = servo, terminals.OUTPUTS
        motor: Motor = servo or IdealMotor()
        self.parameters = parameters = settings.Parameters(node.dictionary, defaults)
        listed = parameters.number(indices.SUPPORTED_MODES)
        self.offered: Mapping[int, type[Mode]] = offered(self.modes, listed)
        self._supported = listed or supported(self.offered)
        self._axis = Axis(motor, settings.read_settings(parameters, motor.counts_per_turn))
        self.switches, self.stopping = Switches(), Stopping(self._axis, parameters)
        self.limits = Limits(self._axis, self.switches)
        self._view = DriveView(
            parameters=parameters,
            axis=self._axis,
            switches=self.switches,
            limits=self.limits,
            stopping=self.stopping,
        )
        self.mode, self.mode_number = Mode(self._view), 0
        self.automaton = automaton.Automaton(self.stopping, self._begin_mode)
        self.supervision = automaton.Supervision(self._axis, self.bounds)
        self.actual_values = ActualValues(self, node.dictionary)
        self._limited, self._stale, self._winding_dc = False, True, 0
        self._stretch, self._requested = Stretch(self, self._axis, servo), True
        self._faults: list[int] = []
        self._lost: set[int] = set()
        plant = () if servo is None else terminals.PLANT_INPUTS
        self.has_inputs((*terminals.DRIVE_INPUTS, *plant))
        parameters.watch((indices.CONTROLWORD,), self._controlled)
        parameters.watch((indices.MODES_OF_OPERATION,), self._mode_written)
        parameters.watch((*_TARGETS, *self.more_targets), self._target_written)
        parameters.watch(settings.CONFIGURATION, self._configuration_written)
        _guard_values(node.dictionary, self.offered)
        node.sync_handlers.append(self._sync)
        node.watch_handlers.append(self._values_watched)

    @property
    def state(self) -> DriveState:
        """The state of the drive."""
        return self.automaton.state

    @property
    def axis(self) -> Axis:
        """Motor, reference, settings and zero after the latest tick."""
        self._stretch.catch_up()
        return self._axis

    @property
    def limited(self) -> bool:
        """Whether a limit reduced a demand in the latest tick (bit 11 of the statusword)."""
        self._stretch.catch_up()
        return self._limited

    @property
    def goes_on_plainly(self) -> bool:
        """Whether the drive only continues its present motion in the next ticks.

        Several ticks can then be computed at once. The value is false if an input or a setting has
        changed, if a time-out runs, or if a limit switch could act. It is also false if a function
        must be called for each change of an actual value.
        """
        changes = self._stale or self.inputs.changed or self.actual_values.watched
        waits = self.supervision.waiting or not self.switches.free
        return self.automaton.operating and not (changes or waits)

    @property
    def enabled(self) -> bool:
        """Whether the drive is in Operation enabled."""
        return self.automaton.state is DriveState.OPERATION_ENABLED

    @property
    def error_code(self) -> int:
        """The latest error code that no reset has cleared, or 0 if there is none."""
        return self._faults[-1] if self._faults else 0

    def read(self, name: str) -> int | float | str:
        """Return the value that a physical output had after the latest tick.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        return terminals.READ[name](self)

    def fault(self, code: int) -> None:
        """Put the drive into a fault, and send its emergency error code by EMCY.

        The call has no effect if the drive already has this fault.

        Args:
            code: emergency error code.
        """
        if code not in self._faults:
            self._note(code)
            self.node.emergency(code, settings.register_of(code))

    def power_on(self) -> None:
        """Start counting at 0."""
        self._interrupt()
        axis = self._axis
        axis.motor.release()
        axis.zero, axis.homed = float(axis.motor.counts), False

    def without_power(self, now_us: int) -> int:
        """Let the shaft coast; see `Application.without_power`."""
        self._interrupt()
        self.automaton.restart()
        motor = self._axis.motor
        motor.release()
        motor.step_to(now_us)
        self._follow_inputs()
        return NEVER if motor.resting else now_us + TICK_US

    def start(self) -> None:
        """Switch off."""
        self._stretch.drop()
        self.actual_values.begin()
        self._faults.clear()
        self._lost.clear()
        self.automaton.restart()
        self._view.controlword = self.parameters.number(indices.CONTROLWORD)
        self.parameters.write(indices.SUPPORTED_MODES, self._supported)
        self._stale = True
        self._change_mode()

    def emergency(self, code: int, register: int, text: bytes) -> None:
        """Record that the connection is lost."""
        if code in settings.COMMUNICATION_ERRORS:
            self._lost.add(code)

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        """Record that the connection is restored."""
        self._lost.discard(code)

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Treat NMT Stop as a lost connection."""
        if new is NmtState.STOPPED:
            self.communication_error()

    def communication_error(self) -> None:
        """React according to 6007h while the motor has power."""
        if self.state not in _MOVING:
            return
        self._interrupt()
        match self.parameters.number(indices.ABORT_CONNECTION):
            case _AbortConnection.FAULT:
                self._note(max(self._lost, default=settings.ErrorCode.COMMUNICATION))
            case _AbortConnection.DISABLE_VOLTAGE:
                self.automaton.enter(DriveState.SWITCH_ON_DISABLED)
            case _AbortConnection.QUICK_STOP:
                self.automaton.enter(DriveState.QUICK_STOP_ACTIVE)
            case _:  # no action, or a manufacturer-specific one
                return
        self.request()

    def on_execute(self, now_us: int) -> None:
        """Measure, supervise, make a step, command the motor, show actual values."""
        self._stretch.drop()
        requested, self._requested = self._requested, False
        self.actual_values.begin()
        self._axis.motor.step_to(now_us)
        self._follow_outside()
        for code in self.supervision.step(now_us, powered=self.automaton.powered):
            self.fault(code)
        self._limited = False
        operating = self.automaton.operating  # no bound method is called, 1 % of a drive
        settled = self._operate(now_us) if operating else self.automaton.run()
        if self.automaton.powered:
            self._axis.command()
        else:
            self._axis.release()
        self._view.fresh = False
        self.actual_values.renew()
        self._sleep(now_us, settled and not self.supervision.waiting, requested=requested)

    def request(self) -> None:
        """Request `on_execute` in this tick, or between two ticks in the next tick."""
        self._requested = True
        super().request()

    def skip(self, ticks: int, now_us: int, position: float, velocity: float) -> None:
        """Bring the drive to the state after ticks that were computed ahead.

        A `Stretch` computes several ticks of the drive at once. Afterwards the state is the same as
        if the ticks had been run one by one.

        Args:
            ticks: number of computed ticks.
            now_us: time of the last computed tick.
            position: position of the reference after these ticks.
            velocity: velocity of the reference after these ticks.
        """
        axis = self._axis
        axis.reference.place(position, velocity)
        axis.reference.current_a = axis.motor.current_ma / 1_000
        self.mode.skip(ticks)
        self.supervision.skip(now_us)
        self._limited = False

    def _interrupt(self) -> None:
        """Catch up with the latest tick and write the actual values before something changes."""
        self._stretch.drop()
        self.actual_values.keep()

    def _note(self, code: int) -> None:
        """Set a fault that the master already knows."""
        self._interrupt()
        self._faults.append(code)
        self.parameters.write(indices.ERROR_CODE, code)
        self.automaton.react(code)
        self.request()

    def _reset_faults(self) -> None:
        """Leave Fault if no cause with an error code is present: transition 15."""
        present = self.supervision.present(powered=self.automaton.powered)
        if not self._lost.union(present).isdisjoint(self._faults):
            return
        for code in self._faults:
            self.node.emergency_clear(code)
        self._faults.clear()
        self.parameters.write(indices.ERROR_CODE, 0)
        self.automaton.enter(DriveState.SWITCH_ON_DISABLED)

    def _begin_mode(self, *, enabled: bool = False) -> None:
        """Restart the chosen mode."""
        self.mode = self.modes[self.mode_number](self._view)
        self.mode.enter(enabled=enabled)

    def _operate(self, now_us: int) -> bool:
        """Run one control period of the mode, or brake if the motion would exceed a limit."""
        mode, axis = self.mode, self._axis
        axis.control = mode.control
        position, velocity = axis.reference.position, axis.reference.velocity
        settled = mode.step(now_us)
        self._limited = mode.limited
        code = self.limits.reached() if mode.minds_limits else None
        if code is None:
            return settled
        self._limited = True
        axis.reference.place(position, velocity)
        if self.limits_are_faults:
            self.fault(code)
        return self.stopping.brake(Ramp.QUICK_STOP)

    def _follow_outside(self) -> None:
        """Apply configuration, physical inputs and the position of the shaft."""
        self._configure()
        self._follow_inputs()
        if self.switches.by_angle:
            self.switches.look(self._axis.motor.shaft_deg)
        self._axis.wrap()

    def _configure(self) -> None:
        if self._stale:
            self._stale = False
            motor = self._axis.motor
            motor.step_to(self.node.now_us)
            self._axis.configure(settings.read_settings(self.parameters, motor.counts_per_turn))

    def _follow_inputs(self) -> None:
        inputs = self.inputs
        if not inputs.changed:
            return
        inputs.changed = False
        self.switches.set(inputs)
        wired = (
            (terminals.SHORT_CIRCUIT, settings.ErrorCode.OVER_CURRENT),
            (terminals.ENCODER_UNPLUGGED, self.encoder_error),
        )
        self.supervision.wired = tuple(code for name, code in wired if inputs[name])
        if self._servo is not None:
            terminals.load(self._servo, inputs)

    def _sleep(self, now_us: int, settled: bool, *, requested: bool) -> None:
        """Schedule the next tick: at an event, every second while the winding cools, or never."""
        motor = self._axis.motor
        if not (settled and motor.resting):
            self.schedule(now_us + TICK_US + self._stretch.plan(now_us, requested=requested))
            return
        self.actual_values.keep()
        if self._winding_dc != motor.winding_dc:
            self._winding_dc = motor.winding_dc
            self.schedule(now_us + _COOLING_US)

    def _values_watched(self) -> None:
        """Work tick by tick from now on, because a TPDO follows each change of an actual value."""
        if self._stretch.ahead:
            self.request()

    def _controlled(self, entry: Entry) -> None:
        """Act on a new controlword with the configuration that was valid before the controlword."""
        self._interrupt()
        self._configure()
        before = self._view.controlword
        self._view.controlword = controlword = self.parameters.number(indices.CONTROLWORD)
        rising, falling = controlword & ~before, before & ~controlword
        command = automaton.command_of(controlword)
        if self.state is DriveState.FAULT and rising & Controlword.FAULT_RESET:
            self._reset_faults()
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
        self._interrupt()
        number = self.parameters.number(indices.MODES_OF_OPERATION)
        if number in self.offered:
            self.mode_number = number
            self.parameters.write(indices.MODES_OF_OPERATION_DISPLAY, number)
            if self.enabled:
                self._begin_mode(enabled=True)
        self.request()

    def _sync(self, counter: int) -> None:
        self._view.fresh = True
        if self.enabled:
            self.request()

    def _target_written(self, entry: Entry) -> None:
        self._view.fresh = True
        self.request()

    def _configuration_written(self, entry: Entry) -> None:
        self._stale = True
        self.request()
