"""What the motor core unit shows on the bus: status and measured values."""

from __future__ import annotations

from enum import IntFlag
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.motor_core_unit.motion import Motion
from tickrig.device.canopen.motor_core_unit.references import References
from tickrig.device.canopen.motor_core_unit.shaft import Shaft

STATUS: Final = 0x2001
MEASURED: Final = 0x6401


class Status(IntFlag):
    """Bits of 2001h (our decision K19)."""

    ON = 1
    REACHED = 2
    LIMITED = 4
    FAULT = 8


class Display:
    """Writes 2001h and 6401h, once a control tick.

    Args:
        dictionary: of the unit.
        shaft: what is measured.
        references: they know the full scales.
    """

    def __init__(self, dictionary: Dictionary, shaft: Shaft, references: References) -> None:
        self._status = dictionary[STATUS, 0]
        self._angle, self._velocity, self._current, self._supply = dictionary.elements(MEASURED)
        self._shaft, self._references = shaft, references

    def show(self, motion: Motion, *, faulty: bool) -> None:
        """Show what is."""
        shaft, references = self._shaft, self._references
        self._angle.value = references.angle(shaft.angle_ndeg / 1e6)
        self._velocity.value = references.velocity(shaft.velocity_udeg_s / 1e3)
        self._current.value = references.current(shaft.current_ma)
        self._supply.value = shaft.servo.supply_mv // 10
        self._status.value = self._bits(motion, faulty=faulty)

    def _bits(self, motion: Motion, *, faulty: bool) -> int:
        status = Status.FAULT if faulty else Status(0)
        if motion.on:
            status |= Status.ON
            if motion.reached:
                status |= Status.REACHED
            if self._shaft.servo.current_limited:
                status |= Status.LIMITED
        return int(status)
