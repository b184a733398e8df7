"""A generic I/O module (CiA 401)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, TypeVar

from tickrig.device.canopen.application import Application, number_of
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401_inputs import (
    READ_ANALOGUE_INPUT_16,
    READ_INPUT_8,
    AnalogueInput,
    DigitalInput,
)
from tickrig.device.canopen.ds401_outputs import (
    WRITE_ANALOGUE_OUTPUT_16,
    WRITE_OUTPUT_8,
    AnalogueOutput,
    DigitalOutput,
    OutputChannel,
)
from tickrig.device.canopen.entry import Entry
from tickrig.device.canopen.pdo_producer import PdoProducer
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.core import NEVER
from tickrig.wire.canopen.nmt import NmtState

DIGITAL_INTERRUPT_ENABLE: Final = 0x6005
ANALOGUE_INTERRUPT_ENABLE: Final = 0x6423

Channel = TypeVar("Channel")


class Ds401(Application):
    """Inputs and outputs of 8 bit digital and 16 bit analogue.

    A change of an input is an event for TPDOs only if the interrupt masks, limits
    and deltas say so. Stop and a communication error put the error values out;
    an output leaves its error value when the node becomes Operational or when it
    is written with another value. 6423h is off by default, 6005h on.

    Not emulated: accesses of 1, 16 and 32 bit, analogue values of other sizes,
    offset and scaling, the conversion time.

    Attributes:
        digital_inputs: by number from 1 on, minus 1.
        analogue_inputs: likewise.
        digital_outputs: likewise.
        analogue_outputs: likewise.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.digital_inputs = self._channels(READ_INPUT_8, DigitalInput)
        self.analogue_inputs = self._channels(READ_ANALOGUE_INPUT_16, AnalogueInput)
        self.digital_outputs = self._channels(WRITE_OUTPUT_8, DigitalOutput)
        self.analogue_outputs = self._channels(WRITE_ANALOGUE_OUTPUT_16, AnalogueOutput)
        self._outputs: list[OutputChannel] = [*self.digital_outputs, *self.analogue_outputs]
        self._digital_enable = node.dictionary.find(DIGITAL_INTERRUPT_ENABLE)
        self._analogue_enable = node.dictionary.find(ANALOGUE_INTERRUPT_ENABLE)
        for channel in self.digital_inputs:
            self.watch(channel.settings())
        for output in self._outputs:
            self.watch(output.settings())
            output.entry.watchers.append(partial(self._written, output))

    def set_digital(self, number: int, level: int) -> None:
        """Set eight physical lines, 0..255; they count in the next tick."""
        self.digital_inputs[number - 1].level = level & 0xFF
        self.request()

    def set_analogue(self, number: int, level: int) -> None:
        """Set a physical value, -32768..32767; it counts in the next tick."""
        self.analogue_inputs[number - 1].level = level
        self.request()

    def start(self) -> None:
        """Judge what is an event from now on."""
        producer = PdoProducer.of(self.node)
        producer.quiet |= {channel.entry.key for channel in self.digital_inputs}
        producer.quiet |= {channel.entry.key for channel in self.analogue_inputs}
        self.request()

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Leave error values in Operational, put them out in Stopped."""
        if new is NmtState.OPERATIONAL:
            self._fail(failed=False)
            for channel in self.analogue_inputs:
                channel.begin()
        elif new is NmtState.STOPPED:
            self._fail(failed=True)

    def communication_error(self) -> None:
        """Put error values out."""
        self._fail(failed=True)

    def on_execute(self, now_us: int) -> None:
        """Read inputs, tell interrupts, put outputs out."""
        digital = [channel.entry for channel in self.digital_inputs if channel.update(now_us)]
        analogue = [channel.entry for channel in self.analogue_inputs if channel.update()]
        self._tell(digital, enabled=number_of(self._digital_enable, 1))
        self._tell(analogue, enabled=number_of(self._analogue_enable, 0))
        for output in self._outputs:
            output.update()
        self.schedule(min((channel.due_us for channel in self.digital_inputs), default=NEVER))

    def _channels(
        self, index: int, make: Callable[[Dictionary, int, Entry], Channel]
    ) -> list[Channel]:
        dictionary = self.node.dictionary
        return [make(dictionary, entry.sub, entry) for entry in dictionary.elements(index)]

    def _tell(self, entries: list[Entry], *, enabled: int) -> None:
        if enabled:
            producer = PdoProducer.of(self.node)
            for entry in entries:
                producer.request_for(entry)

    def _written(self, output: OutputChannel) -> None:
        output.failed = False
        self.request()

    def _fail(self, *, failed: bool) -> None:
        for output in self._outputs:
            output.failed = failed
        self.request()
