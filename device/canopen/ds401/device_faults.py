"""What a module finds wrong with itself, and what it reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.errors.error_behaviour import INPUT_ERROR, OUTPUT_ERROR, ErrorBehaviour
from tickrig.device.physical import InputSignal, QuantityBank, SignalType
from tickrig.device.twin import Immutable, Part
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister

NO_BEHAVIOUR: Final = 0
"""1029h says nothing about it."""


@dataclass(frozen=True, slots=True)
class DeviceFault(Immutable):
    """A physical fault that the module detects.

    Attributes:
        name: of the physical input.
        text: what it is, for people.
        code: emergency error code.
        register: bits of the error register.
        behaviour: sub-index of 1029h that decides about the NMT state.
        stops_outputs: whether error values are put out.
    """

    name: str
    text: str
    code: int
    register: int
    behaviour: int
    stops_outputs: bool

    @property
    def input(self) -> InputSignal:
        """The physical input."""
        return InputSignal(self.name, self.text, SignalType.FAULT)


INPUT_OVERCURRENT: Final = DeviceFault(
    "input_overcurrent",
    "the current into an analogue input is too high",
    0x2110,
    ErrorRegister.CURRENT,
    INPUT_ERROR,
    stops_outputs=False,
)
OUTPUT_OVERLOAD: Final = DeviceFault(
    "output_overload",
    "the current out of an output is too high",
    0x2310,
    ErrorRegister.CURRENT,
    OUTPUT_ERROR,
    stops_outputs=True,
)
INTERNAL_FAILURE: Final = DeviceFault(
    "internal_failure",
    "the electronics of the module fail",
    EmcyCode.HARDWARE,
    ErrorRegister.GENERIC,
    NO_BEHAVIOUR,
    stops_outputs=True,
)


class FaultDetector(Part):
    """Sees faults come and go: EMCY, and what 1029h says.

    Args:
        node: where it is reported.
        faults: those that the module can have.

    Attributes:
        faults: see above.
    """

    def __init__(self, node: CanopenSlave, faults: Sequence[DeviceFault]) -> None:
        self._node, self.faults = node, faults
        self._present: list[DeviceFault] = []

    @property
    def stops_outputs(self) -> bool:
        """Whether a fault is there that lets no output be."""
        return any(fault.stops_outputs for fault in self._present)

    def forget(self) -> None:
        """Find what is there anew."""
        self._present.clear()

    def look(self, inputs: QuantityBank) -> bool:
        """Report what has come and gone.

        Returns:
            Whether outputs have to stop for what has come.
        """
        before = self._present
        self._present = [fault for fault in self.faults if inputs[fault.name]]
        come = [fault for fault in self._present if fault not in before]
        for fault in come:
            self._node.emergency(fault.code, fault.register)
            ErrorBehaviour.of(self._node).act(fault.behaviour)
        for fault in before:
            if fault not in self._present:
                self._node.emergency_clear(fault.code)
        return any(fault.stops_outputs for fault in come)
