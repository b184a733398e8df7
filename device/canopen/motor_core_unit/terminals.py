"""What the world does to a motor core unit, and what it sees of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.servo.servo import Servo

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


def feel(servo: Servo, inputs: QuantityBank) -> None:
    """Let the world act on the motor, if it has changed."""
    if inputs.changed:
        inputs.changed = False
        servo.supply_v, servo.ambient_c = inputs["supply_v"], inputs["ambient_c"]
        servo.load_nm, servo.load_kg_m2 = inputs["shaft_load_nm"], inputs["load_kg_m2"]
        servo.blocked = bool(inputs["shaft_blocked"])
        servo.encoder_unplugged = bool(inputs["encoder_unplugged"])
        servo.phase_open = bool(inputs["motor_phase_open"])
