"""The physical inputs and outputs of a drive."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402 import axis as switches
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402
    from tickrig.device.servo.servo import Servo

SHORT_CIRCUIT: Final = "short_circuit"
ENCODER_UNPLUGGED: Final = "encoder_unplugged"

DRIVE_INPUTS: Final = (
    *switches.INPUTS,
    InputSignal(SHORT_CIRCUIT, "the motor cable has a short circuit", SignalType.FAULT),
    InputSignal(ENCODER_UNPLUGGED, "the encoder cable is pulled", SignalType.FAULT),
)
"""Inputs of any drive."""

PLANT_INPUTS: Final = (
    InputSignal("supply_v", "supply of the power stage", high=100, unit="V", initial=24, real=True),
    InputSignal(
        "load_nm", "torque on the shaft, forward", low=-1_000, high=1_000, unit="Nm", real=True
    ),
    InputSignal("load_kg_m2", "inertia on the shaft", high=1_000, unit="kg m2", real=True),
    InputSignal(
        "ambient_c", "air temperature", low=-40, high=85, unit="degC", initial=25, real=True
    ),
    InputSignal("shaft_blocked", "the shaft is held", SignalType.FAULT),
    InputSignal("motor_phase_open", "a wire of the motor is broken", SignalType.FAULT),
)
"""Inputs of a drive with a simulated motor."""

OUTPUTS: Final = {
    item.name: item
    for item in (
        OutputSignal("shaft_deg", "angle of the output shaft", "deg"),
        OutputSignal("shaft_deg_s", "speed of the output shaft", "deg/s"),
        OutputSignal("position", "position actual value", "user units"),
        OutputSignal("current_a", "current of the motor", "A"),
        OutputSignal("winding_c", "temperature of the winding", "degC"),
        OutputSignal("drive_state", "state of the drive"),
        OutputSignal("mode", "mode of operation, as in 6061h"),
        OutputSignal("error_code", "latest error code since the last reset, 0 for none"),
        OutputSignal("at_negative_limit", "the drive sees its negative limit switch pressed"),
        OutputSignal("at_positive_limit", "the drive sees its positive limit switch pressed"),
        OutputSignal("at_home", "the drive sees its home switch pressed"),
    )
}

READ: Final[dict[str, Callable[[Ds402], float | str]]] = {
    "shaft_deg": lambda drive: drive.axis.motor.shaft_deg,
    "shaft_deg_s": lambda drive: drive.axis.motor.shaft_deg_s,
    "position": lambda drive: drive.axis.position,
    "current_a": lambda drive: drive.axis.motor.current_ma / 1_000,
    "winding_c": lambda drive: drive.axis.motor.winding_dc / 10,
    "drive_state": lambda drive: drive.state.words,
    "mode": lambda drive: drive.mode_number,
    "error_code": lambda drive: drive.error_code,
    "at_negative_limit": lambda drive: int(drive.switches.negative_limit),
    "at_positive_limit": lambda drive: int(drive.switches.positive_limit),
    "at_home": lambda drive: int(drive.switches.home),
}


def load(servo: Servo, inputs: QuantityBank) -> None:
    """Apply the physical inputs to a motor."""
    servo.supply_v, servo.ambient_c = inputs["supply_v"], inputs["ambient_c"]
    servo.load_nm, servo.load_kg_m2 = inputs["load_nm"], inputs["load_kg_m2"]
    servo.blocked = bool(inputs["shaft_blocked"])
    servo.phase_open = bool(inputs["motor_phase_open"])
    servo.encoder_unplugged = bool(inputs[ENCODER_UNPLUGGED])
