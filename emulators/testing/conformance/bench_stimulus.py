"""Moves the inputs of a device on a bench."""

from __future__ import annotations

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.emulators.testing.bench.bench_device import BenchDevice
from tickrig.emulators.testing.conformance.slave_stimulus import SlaveStimulus


class BenchStimulus:
    """The hands at a device of a bench in virtual time.

    Args:
        device: a CANopen node.
        slave: what it is.
    """

    def __init__(self, device: BenchDevice, slave: CanopenSlave) -> None:
        self._device, self._inside = device, SlaveStimulus(slave)

    def __call__(self, *words: str) -> str:
        """Do it, and return what was read."""
        match words:
            case ("power", "on"):
                self._device.switch_on()
            case ("power", "off"):
                self._device.switch_off()
            case _:
                return self._inside(*words)
        return ""
