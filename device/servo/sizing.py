"""Servos of another size than the shipped ones: as large as a joint needs them."""

from __future__ import annotations

from dataclasses import replace

from tickrig.device.servo.parameters import ServoParameters


def peak_torque_nm(servo: ServoParameters) -> float:
    """Return the torque of the peak current at the output shaft, friction not taken off.

    >>> from tickrig.device.servo.presets import EPOS_WHEEL
    >>> round(peak_torque_nm(EPOS_WHEEL), 2)
    13.21
    """
    return servo.stage.peak_a * servo.motor.torque_constant_nm_a * servo.gear.ratio


def free_speed_rad_s(servo: ServoParameters) -> float:
    """Return the speed of the output shaft at which the back-EMF takes the whole voltage.

    >>> from tickrig.device.servo.presets import EPOS_WHEEL
    >>> round(free_speed_rad_s(EPOS_WHEEL), 1)
    16.4
    """
    volts = servo.stage.duty_max * servo.stage.supply_v
    return volts / servo.motor.torque_constant_nm_a / servo.gear.ratio


def of_size(servo: ServoParameters, size: float) -> ServoParameters:
    """Return what so many of a servo are, side by side on one shaft.

    Currents, torques, inertias and friction grow with the size, resistances to current and heat
    fall with it; speeds, voltages, temperatures and all time constants stay.

    Args:
        servo: one of them.
        size: above 0; a fraction is a smaller one.
    """
    motor, stage, gear = servo.motor, servo.stage, servo.gear
    return replace(
        servo,
        motor=replace(
            motor,
            resistance_ohm=motor.resistance_ohm / size,
            inductance_h=motor.inductance_h / size,
            inertia_kg_m2=motor.inertia_kg_m2 * size,
            coulomb_nm=motor.coulomb_nm * size,
            viscous_nm_s=motor.viscous_nm_s * size,
            winding_housing_k_w=motor.winding_housing_k_w / size,
            housing_ambient_k_w=motor.housing_ambient_k_w / size,
        ),
        stage=replace(stage, continuous_a=stage.continuous_a * size, peak_a=stage.peak_a * size),
        gear=replace(
            gear, inertia_kg_m2=gear.inertia_kg_m2 * size, coulomb_nm=gear.coulomb_nm * size
        ),
    )
