"""Objects of the motor core unit Ver. 1.1 (NEDO report, 3.4.43.3, Tables 5 and 6; DECISION K19)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.canopen.models import motor_core_motion
from tickrig.device.canopen.slave import TICK_US, Application, CanopenSlave, Nonvolatile
from tickrig.device.canopen.stack import make_slave
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.servo.parameters import MOTOR_CORE_UNIT
from tickrig.device.servo.servo import Servo
from tickrig.device.twin import Immutable, Part
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds import object_table
from tickrig.wire.canopen.emcy import ErrorRegister
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.pdo import PdoDescription
from tickrig.wire.instant import NEVER

# Faults of a motor core unit, how they are detected, and their EMCYs.


@dataclass(frozen=True, slots=True)
class _Measurements(Immutable):
    """Measurements of the unit.

    Attributes:
        on: whether the power stage is on.
        loops: whether a velocity is demanded.
        tripped: whether the comparator of the power stage has switched it off.
        supply_mv: supply of the motor.
        winding_dc: temperature of the winding, in 0.1 degC.
        housing_dc: temperature of the housing and of the power stage in it, in 0.1 degC.
        velocity_deg_s: velocity of the shaft, measured by the motor encoder.
        current_ma: current in the motor.
        limited: whether limits or the supply keep the current below the demand of the loops.
        deviates: whether the motor is far from its demand.
        spare_mv: voltage of the supply above the back-EMF, which is available for current.
        overloaded: whether the I2t of the power stage is used up.
        slip_deg: difference between motor encoder and gear encoder.
    """

    on: bool
    loops: bool
    tripped: bool
    supply_mv: int
    winding_dc: int
    housing_dc: int
    velocity_deg_s: float
    current_ma: int
    limited: bool
    deviates: bool
    spare_mv: int
    overloaded: bool
    slip_deg: float


@dataclass(frozen=True, slots=True)
class _Fault(Immutable):
    """A row of the table of faults.

    Attributes:
        name: name of the fault, for display.
        code: emergency error code of the fault (CiA 402-1).
        register: bits of the error register.
        seen: function that returns whether the cause is present.
        gone: function that returns whether the cause has ended. It is not always the opposite of
            `seen`.
        after_us: time for which the cause must be present before the fault is reported.
    """

    name: str
    code: int
    register: ErrorRegister
    seen: Callable[[_Measurements], bool]
    gone: Callable[[_Measurements], bool]
    after_us: int = 0

    def __reduce__(self) -> tuple[Callable[[str], _Fault], tuple[str]]:
        """Return the name of the fault for a pickle."""
        return _fault, (self.name,)


def _fault(name: str) -> _Fault:
    return next(fault for fault in _FAULTS if fault.name == name)


_SUPPLY_MV: Final = (10_000, 66_000)
"""Limits of the supply: 10 V (NEDO report, Table 6), and a tenth above the 60 V of the report."""

_SUPPLY_MARGIN_MV: Final = 1_000
_WINDING_DC: Final = 1_180
_HOUSING_DC: Final = 1_100
_COOLED_DC: Final = 100
"""Hysteresis by which a temperature must fall before its fault can be cleared."""

_STALLED_DEG_S: Final = 1.0
_STALLED_US: Final = 500_000
_OVERLOADED_US: Final = 1_000_000
_NO_CURRENT_MA: Final = 50
_NO_CURRENT_US: Final = 100_000
_SPARE_MV: Final = 500
"""Voltage below which a missing current is no fault, because the motor turns as fast as its supply
allows."""
_SLIP_DEG: Final = 1.0
_DIP_US: Final = 5_000

_DRIVE: Final = ErrorRegister.DEVICE_PROFILE


def _unless_tripped(measured: _Measurements) -> bool:
    """Return whether a cause that shows only with power or motion counts as ended."""
    return not measured.tripped


_FAULTS: Final = (
    _Fault("short circuit", 0x2320, ErrorRegister.CURRENT, lambda s: s.tripped, _unless_tripped),
    _Fault(
        *("under-voltage", 0x3220, ErrorRegister.VOLTAGE),
        seen=lambda s: s.supply_mv < _SUPPLY_MV[0],
        gone=lambda s: s.supply_mv >= _SUPPLY_MV[0] + _SUPPLY_MARGIN_MV,
        after_us=_DIP_US,
    ),
    _Fault(
        *("over-voltage", 0x3210, ErrorRegister.VOLTAGE),
        seen=lambda s: s.supply_mv > _SUPPLY_MV[1],
        gone=lambda s: s.supply_mv <= _SUPPLY_MV[1] - _SUPPLY_MARGIN_MV,
    ),
    _Fault(
        *("over-temperature of the housing", 0x4210, ErrorRegister.TEMPERATURE),
        seen=lambda s: s.housing_dc > _HOUSING_DC,
        gone=lambda s: s.housing_dc <= _HOUSING_DC - _COOLED_DC,
    ),
    _Fault(
        *("over-temperature of the motor", 0x4310, ErrorRegister.TEMPERATURE),
        seen=lambda s: s.winding_dc > _WINDING_DC,
        gone=lambda s: s.winding_dc <= _WINDING_DC - _COOLED_DC,
    ),
    _Fault(
        *("motor encoder", 0x7305, _DRIVE),
        seen=lambda s: s.slip_deg > _SLIP_DEG,
        gone=_unless_tripped,
    ),
    _Fault(
        *("motor commutation", 0x7122, _DRIVE),
        seen=lambda s: s.deviates and abs(s.current_ma) < _NO_CURRENT_MA and s.spare_mv > _SPARE_MV,
        gone=_unless_tripped,
        after_us=_NO_CURRENT_US,
    ),
    _Fault(
        *("motor blocked", 0x7121, _DRIVE),
        seen=lambda s: s.loops and s.limited and abs(s.velocity_deg_s) < _STALLED_DEG_S,
        gone=_unless_tripped,
        after_us=_STALLED_US,
    ),
    _Fault(
        *("continuous over-current", 0x2310, ErrorRegister.CURRENT),
        seen=lambda s: s.overloaded and s.limited,
        gone=_unless_tripped,
        after_us=_OVERLOADED_US,
    ),
)
"""The faults in the order in which they are checked and reported."""


class _Supervision(Part):
    """The present faults.

    Each fault is reported by EMCY when it occurs and when it is cleared.

    Args:
        node: the slave.

    Attributes:
        faults: the present faults in order of occurrence.
    """

    def __init__(self, node: CanopenSlave) -> None:
        self._node = node
        self.faults: list[_Fault] = []
        self._since_us: dict[_Fault, int] = {}

    @property
    def waiting(self) -> bool:
        """Whether a cause has been seen, but not yet for long enough."""
        return bool(self._since_us)

    def start(self) -> None:
        """Clear all faults; a cause that remains is detected again."""
        self.faults.clear()
        self._since_us.clear()

    def look(self, now_us: int, measured: _Measurements) -> bool:
        """Check for causes; return whether there is a new fault."""
        known = len(self.faults)
        for fault in _FAULTS:
            if fault in self.faults:
                continue
            if not fault.seen(measured):
                self._since_us.pop(fault, None)
            elif now_us - self._since_us.setdefault(fault, now_us) >= fault.after_us:
                self._raise(fault)
        return len(self.faults) > known

    def clear(self, measured: _Measurements) -> bool:
        """Clear the faults whose cause has ended; return whether there were any."""
        gone = [fault for fault in self.faults if fault.gone(measured)]
        for fault in gone:
            self.faults.remove(fault)
            self._node.emergency_clear(fault.code)
        return bool(gone)

    def _raise(self, fault: _Fault) -> None:
        del self._since_us[fault]
        self.faults.append(fault)
        self._node.emergency(fault.code, fault.register)


# The application of the motor core unit, with its physical side.

_LOAD: Final = "torque from outside at the shaft, positive drives it forward"

INPUTS: Final = (
    InputSignal("supply_v", "supply of the motor", high=80, unit="V", initial=60, real=True),
    InputSignal("shaft_load_nm", _LOAD, low=-100, high=100, unit="Nm", real=True),
    InputSignal("load_kg_m2", "inertia of what is on the shaft", high=10, unit="kg m2", real=True),
    InputSignal(
        "ambient_c", "air around it", low=-40, high=125, unit="degC", initial=25, real=True
    ),
    InputSignal("shaft_blocked", "the shaft is held", SignalType.FAULT),
    InputSignal("encoder_unplugged", "the plug of the motor encoder is off", SignalType.FAULT),
    InputSignal("motor_phase_open", "a wire of the motor is off", SignalType.FAULT),
    InputSignal("short_circuit", "two wires of the motor touch", SignalType.FAULT),
)

_OUTPUTS: Final = (
    OutputSignal("angle_deg", "angle of the shaft, without the offset 2011h", "deg"),
    OutputSignal("velocity_deg_s", "velocity of the shaft", "deg/s"),
    OutputSignal("current_a", "current in the motor", "A"),
    OutputSignal("winding_c", "temperature of the winding", "degC"),
    OutputSignal("target_deg", "where the reference wants the shaft in angle mode", "deg"),
    OutputSignal("mode", "free, current, velocity or angle"),
    OutputSignal("status", "off, on, or the faults that are there"),
)

_READINGS: Final[Mapping[str, Callable[[Servo], float]]] = MappingProxyType(
    {
        "angle_deg": lambda servo: servo.shaft_deg,
        "velocity_deg_s": lambda servo: servo.shaft_deg_s,
        "current_a": lambda servo: servo.current_a,
        "winding_c": lambda servo: servo.winding_c,
    }
)
"""Outputs of the motor itself."""


def _apply_inputs(servo: Servo, inputs: QuantityBank) -> None:
    """Apply the physical inputs to the motor if they have changed."""
    if inputs.changed:
        inputs.changed = False
        servo.supply_v, servo.ambient_c = inputs["supply_v"], inputs["ambient_c"]
        servo.load_nm, servo.load_kg_m2 = inputs["shaft_load_nm"], inputs["load_kg_m2"]
        servo.blocked = bool(inputs["shaft_blocked"])
        servo.encoder_unplugged = bool(inputs["encoder_unplugged"])
        servo.phase_open = bool(inputs["motor_phase_open"])


_MODE: Final = 0x2000

_COOLING_US: Final = 1_000_000
"""Update period of a motor at rest, until it has the temperature of the air."""

_COOLED_C: Final = 0.1


@mypyc_attr(allow_interpreted_subclasses=True)
class MotorCoreUnit(Application):
    """Application of a motor core unit: a brushless motor with gear (NEDO report, Table 5).

    The unit has a strain wave gear, two encoders and a driver. A reference takes effect only in
    Operational. In other NMT states a motor that has a mode brakes to standstill and is held there.
    A control tick lasts 10 ms. While the unit rests, an event starts a control tick. A fault
    switches off the motor. The motor stays off until 2000h is written after the causes of all
    faults have ended.

    Not emulated: commutation, torque ripple, elasticity and play of the gear, power that flows back
    into the supply while braking, failure of the control supply.

    Attributes:
        servo: servo with the motor, the gear and the control loops.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.has_inputs(INPUTS)
        self.outputs = {output.name: output for output in _OUTPUTS}
        self.servo = Servo(MOTOR_CORE_UNIT)
        self._shaft, self._references = (
            motor_core_motion.Shaft(self.servo),
            motor_core_motion.References(node, self.request),
        )
        self._motion = motor_core_motion.Motion(self._shaft, self._references)
        self._supervision = _Supervision(node)
        self._display = motor_core_motion.Display(node.dictionary, self._shaft, self._references)
        self._mode = node.dictionary[_MODE, 0]
        self._mode.written = self._mode_written
        self.watch([self._mode, *self._references.entries])
        self._begin_us, self._mode_was_written = 0, False

    def read(self, name: str) -> int | float | str:
        """Return the present value of a physical output."""
        if name in _READINGS:
            return _READINGS[name](self.servo)
        match name:
            case "target_deg":
                return self._references.target_ndeg / motor_core_motion.DEGREE
            case "mode":
                return motor_core_motion.mode_of(self._mode.number).name.lower()
            case "status":
                return self._status
        raise KeyError(name)

    def power_on(self) -> None:
        """Start with a motor that has been without power since the latest tick."""
        self.servo.release()

    def without_power(self, now_us: int) -> int:
        """Let the shaft coast."""
        self.servo.release()
        self.servo.step_to(now_us)
        _apply_inputs(self.servo, self.inputs)
        return NEVER if self.servo.resting else now_us + TICK_US

    def start(self) -> None:
        """Clear all faults, and take the angle of the shaft from the gear encoder."""
        self._supervision.start()
        self._references.start()
        self._mode_was_written = False
        self._shaft.find_zero()
        self.request()

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Make references effective in Operational only."""
        if new is NmtState.OPERATIONAL:
            self._references.failed = False
        self.request()

    def communication_error(self) -> None:
        """Use the error value of 6443h and 6444h as reference."""
        self._references.failed = True
        self.request()

    def on_execute(self, now_us: int) -> None:
        """Advance the motor, check for faults, and drive it."""
        self.servo.step_to(now_us)
        _apply_inputs(self.servo, self.inputs)
        failed = self._supervise(now_us)
        controls = failed or now_us - self._begin_us >= motor_core_motion.CONTROL_US
        if controls:
            self._control(now_us)
        self._motion.drive(now_us - self._begin_us)
        self.schedule(self._rested_us(now_us) if controls and self._rests else now_us + TICK_US)

    def _supervise(self, now_us: int) -> bool:
        """Detect new faults, and clear faults that have ended; return whether a fault is new."""
        if self._mode_was_written:
            self._mode_was_written = False
            if self._supervision.clear(self._measurements(now_us)):
                self._shaft.find_zero()
        failed = self._supervision.look(now_us, self._measurements(now_us))
        self._references.failed |= failed
        return failed

    def _control(self, now_us: int) -> None:
        """Start a control tick."""
        self._begin_us = now_us
        self.servo.current_limit_a = self._references.current_limit_ma / 1_000
        self._motion.plan(self._action)
        self._display.show(self._motion, faulty=bool(self._supervision.faults))

    @property
    def _action(self) -> motor_core_motion.Action:
        """Action of the motor allowed by faults, NMT state and mode."""
        if self._supervision.faults:
            return motor_core_motion.Action.COAST
        action = motor_core_motion.ACTIONS[motor_core_motion.mode_of(self._mode.number)]
        if action is motor_core_motion.Action.COAST or self.node.state is NmtState.OPERATIONAL:
            return action
        return motor_core_motion.Action.BRAKE

    def _measurements(self, now_us: int) -> _Measurements:
        servo, on = self.servo, self._motion.on
        return _Measurements(
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
        """Return the time of the next update of a motor at rest, while its temperature changes."""
        air_c, servo = self.servo.ambient_c, self.servo
        warmer_c = max(abs(servo.winding_c - air_c), abs(servo.housing_c - air_c))
        return now_us + _COOLING_US if warmer_c > _COOLED_C else NEVER

    def _mode_written(self, entry: Entry) -> None:
        self._mode_was_written = True
        self.request()


NODE_ID: Final = 32
"""Default node-ID."""

I16: Final = DataType.INTEGER16
I32: Final = DataType.INTEGER32

_ANALOGUE_IN_AND_OUT: Final = 0x000C_0191
"""Device type: CiA 401, analogue inputs and outputs."""

_CHANNELS: Final = 4


def _channels(index: int) -> tuple[int, ...]:
    """Map the four 16-bit channels of an array."""
    return tuple(index << 16 | sub << 8 | I16.bits for sub in range(1, _CHANNELS + 1))


_PROFILE: Final = object_table.CommunicationProfile(
    device_type=_ANALOGUE_IN_AND_OUT,
    name="motor core unit",
    hardware="1.1",
    software="tickrig",
    product_code=2,
    rpdos=[
        PdoDescription(object_table.OFF | 0x200),
        PdoDescription(0x300, _channels(0x6411)),
        PdoDescription(object_table.OFF | 0x400),
        PdoDescription(object_table.OFF | 0x500),
    ],
    tpdos=[
        PdoDescription(object_table.OFF | 0x180),
        PdoDescription(0x280, _channels(0x6401)),
        PdoDescription(object_table.OFF | 0x380),
        PdoDescription(object_table.OFF | 0x480),
    ],
)

make_application: Final = MotorCoreUnit
"""Return the application of the unit."""


def make_motor_core_unit(
    node_id: int = NODE_ID, nonvolatile: Nonvolatile | None = None
) -> CanopenSlave:
    """Make an emulated motor core unit, a CANopen slave with its motor and gear.

    Args:
        node_id: node-ID 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: memory with parameters from an earlier run, or None for empty memory.

    Returns:
        A slave that boots in its first tick.

    Raises:
        ValueError: the node-ID is invalid.
    """
    slave = make_slave(dictionary(), node_id, nonvolatile, make_application)
    slave.model = "motor-core-unit"
    return slave


def dictionary() -> Dictionary:
    """Return the objects of one slave with default values; slaves share the description."""
    return _template().copy()


@cache
def _template() -> Dictionary:
    objects = object_table.ObjectTable()
    object_table.add_communication(objects, _PROFILE)
    objects.variable(0x2000, "Mode", object_table.U8, object_table.RW, high=3)
    objects.variable(0x2001, "Status", object_table.U16, object_table.ROT)
    full_scales = (
        object_table.Element(
            1, "Full scale angle, 0.001 deg", object_table.U32, object_table.RW, 180_000
        ),
        object_table.Element(
            2, "Full scale velocity, 0.001 deg/s", object_table.U32, object_table.RW, 360_000
        ),
        object_table.Element(
            3, "Full scale current, mA", object_table.U32, object_table.RW, 10_000
        ),
    )
    objects.record(0x2010, "Full scale", full_scales)
    objects.variable(0x2011, "Angle offset, 0.001 deg", I32, object_table.RW)
    objects.array(0x6401, "Read analogue input 16-bit", _CHANNELS, I16, object_table.ROT)
    objects.array(0x6411, "Write analogue output 16-bit", _CHANNELS, I16, object_table.RWW)
    objects.array(0x6443, "Analogue output error mode", 1, object_table.U8, object_table.RW, 1)
    objects.array(0x6444, "Analogue output error value", 1, I32, object_table.RW)
    return Dictionary(objects, objects.objects)
