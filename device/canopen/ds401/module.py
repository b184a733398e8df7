"""A generic I/O module (CiA 401)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.application import Application, number_of
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.ds401.analogue_input import AnalogueInput, InterruptSource
from tickrig.device.canopen.ds401.analogue_output import AnalogueOutput
from tickrig.device.canopen.ds401.converter import Converter
from tickrig.device.canopen.ds401.device_faults import (
    INPUT_OVERCURRENT,
    INTERNAL_FAILURE,
    OUTPUT_OVERLOAD,
    FaultDetector,
)
from tickrig.device.canopen.ds401.digital import DigitalInputs, DigitalOutputs
from tickrig.device.canopen.ds401.families import (
    ANALOGUE_INPUT,
    ANALOGUE_INTERRUPT_ENABLE,
    ANALOGUE_OUTPUT,
    DIGITAL_INTERRUPT_ENABLE,
    channels,
)
from tickrig.device.canopen.pdo.pdo_producer import PdoProducer
from tickrig.device.physical import InputSignal, OutputSignal
from tickrig.wire.canopen.nmt import NmtState

GROUP_LINES: Final = 8


class DigitalTerminal(NamedTuple):
    """One digital output, or all of them."""

    output: OutputSignal
    outputs: DigitalOutputs
    shift: int
    mask: int

    @property
    def level(self) -> int:
        """The lines as a number."""
        return self.outputs.level >> self.shift & self.mask


Terminal = DigitalTerminal | AnalogueOutput


def digital_input_names(lines: int) -> tuple[str, ...]:
    """Return `di1` to the last one."""
    return tuple(f"di{line}" for line in range(1, lines + 1))


def digital_inputs(names: Sequence[str]) -> Iterator[InputSignal]:
    """Give the digital inputs; 1 is high."""
    for line, name in enumerate(names, 1):
        yield InputSignal(name, f"digital input {line}")


def groups(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the names of eight digital inputs at once: `di`, then `di9_16` and so on."""
    found = {}
    for first in range(0, len(names), GROUP_LINES):
        members = tuple(names[first : first + GROUP_LINES])
        found[f"di{first + 1}_{first + len(members)}" if first else "di"] = members
    return found


def outputs_by_name(
    digital: DigitalOutputs, analogue: Iterable[AnalogueOutput]
) -> dict[str, Terminal]:
    """Return the outputs by name: `do1`.., `do` and `ao1`.."""
    found: list[Terminal] = [
        DigitalTerminal(OutputSignal(f"do{line}", f"digital output {line}"), digital, line - 1, 1)
        for line in range(1, digital.lines + 1)
    ]
    if found:
        everything = OutputSignal("do", "all digital outputs as a number, output 1 is bit 0")
        found.append(DigitalTerminal(everything, digital, 0, (1 << digital.lines) - 1))
    found += analogue
    return {terminal.output.name: terminal for terminal in found}


@mypyc_attr(allow_interpreted_subclasses=True)
class Ds401(Application):
    """Digital and analogue inputs and outputs, as the dictionary has them.

    Events are judged once a tick. A change of an input is an event for TPDOs only
    if the interrupt masks, or the trigger with its limits and deltas, say so (see
    `EventRule`). Stop, a communication error and a failure of the device put the
    error values out; an output leaves its error value when the node becomes
    Operational or when it is written with another value.

    Without 6005h digital events are on, without 6423h analogue ones.

    Not emulated: joysticks; objects of the manufacturer (6404h, 6414h); SI units
    (6430h, 6450h are kept and mean nothing); the conversion time.

    Args:
        node: the slave.
        slot: its place in the tick.
        inputs: converters of the analogue inputs, from the first one on; plain counts without.
        outputs: those of the analogue outputs.

    Attributes:
        analogue_inputs: its analogue inputs.
    """

    def __init__(
        self,
        node: CanopenSlave,
        slot: int,
        *,
        inputs: Sequence[Converter] = (),
        outputs: Sequence[Converter] = (),
    ) -> None:
        super().__init__(node, slot)
        dictionary = node.dictionary
        self._digital_inputs = DigitalInputs(dictionary)
        self._digital_outputs = DigitalOutputs(dictionary)
        self.analogue_inputs = _analogue_inputs(dictionary, inputs)
        self._analogue_outputs = _analogue_outputs(dictionary, outputs)
        self._channels = {
            entry.key: channel for channel in self.analogue_inputs for entry in channel.entries
        }
        self._source = InterruptSource(dictionary)
        self._digital_enable = dictionary.find(DIGITAL_INTERRUPT_ENABLE)
        self._analogue_enable = dictionary.find(ANALOGUE_INTERRUPT_ENABLE)
        self._faults = self._make_faults()
        self._lines = digital_input_names(self._digital_inputs.lines)
        self._terminals = outputs_by_name(self._digital_outputs, self._analogue_outputs)
        self.outputs = {name: terminal.output for name, terminal in self._terminals.items()}
        self._has_physical_inputs()
        self._watch_objects()

    def power_on(self) -> None:
        """Take inputs as they are, begin with outputs at rest."""
        producer = PdoProducer.of(self.node)
        producer.on_sent = [self._sent]
        producer.quiet |= {view.entry.key for view in self._digital_inputs.value.views}
        producer.quiet |= {*self._channels, *(entry.key for entry in self._source.entries)}
        self._digital_inputs.power_on(self._level)
        self._digital_outputs.power_on()
        for output in self._analogue_outputs:
            output.power_on()

    def start(self) -> None:
        """Judge what is an event from now on; look for faults anew."""
        self._faults.forget()
        self._fail(failed=False)
        for channel in self.analogue_inputs:
            channel.begin(self.inputs[channel.name])

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Leave error values in Operational, put them out in Stopped."""
        if new is NmtState.OPERATIONAL:
            self._fail(failed=self._faults.stops_outputs)
        elif new is NmtState.STOPPED:
            self._fail(failed=True)

    def communication_error(self) -> None:
        """Put error values out."""
        self._fail(failed=True)

    def read(self, name: str) -> int | float:
        """Look at an output, as it was left by the latest tick.

        Args:
            name: one of `outputs`.

        Returns:
            Its value.

        Raises:
            KeyError: there is none of that name.
        """
        return self._terminals[name].level

    def on_execute(self, now_us: int) -> None:
        """Look for faults, read inputs, cause events, put outputs out."""
        if self._faults.look(self.inputs):
            self._fail(failed=True)
        digital = self._digital_inputs.update(self._level, now_us)
        if number_of(self._digital_enable, 1):
            self._cause_events(digital)
        self._read_analogue()
        self._digital_outputs.update()
        for output in self._analogue_outputs:
            output.update()
        self.schedule(self._digital_inputs.due_us)

    @property
    def _level(self) -> int:
        """The digital inputs as the world sets them; line 1 is the lowest bit."""
        return sum(1 << bit for bit, name in enumerate(self._lines) if self.inputs[name])

    def _read_analogue(self) -> None:
        enabled = bool(number_of(self._analogue_enable, 1))
        for channel in self.analogue_inputs:
            if channel.update(self.inputs[channel.name], enabled=enabled):
                self._source.note(channel.number)
                self._cause_events(channel.entries)

    def _cause_events(self, entries: list[Entry]) -> None:
        producer = PdoProducer.of(self.node)
        for entry in entries:
            producer.request_for(entry)

    def _sent(self, entries: list[Entry]) -> None:
        for entry in entries:
            if (channel := self._channels.get(entry.key)) is not None:
                channel.sent()

    def _fail(self, *, failed: bool) -> None:
        self._digital_outputs.fail(failed=failed)
        for output in self._analogue_outputs:
            output.failed = failed
        self.request()

    def _make_faults(self) -> FaultDetector:
        faults = [INTERNAL_FAILURE]
        if self.analogue_inputs:
            faults.append(INPUT_OVERCURRENT)
        if self._digital_outputs.lines or self._analogue_outputs:
            faults.append(OUTPUT_OVERLOAD)
        return FaultDetector(self.node, faults)

    def _has_physical_inputs(self) -> None:
        lines = digital_inputs(self._lines)
        analogue = (channel.input for channel in self.analogue_inputs)
        faults = (fault.input for fault in self._faults.faults)
        self.has_inputs((*lines, *analogue, *faults), groups(self._lines))

    def _watch_objects(self) -> None:
        self.watch(self._digital_inputs.settings())
        self.watch(self._digital_outputs.objects())
        self.watch([self._analogue_enable] if self._analogue_enable is not None else [])
        for channel in self.analogue_inputs:
            self.watch(channel.objects())
        for output in self._analogue_outputs:
            self.watch(output.objects())


def _analogue_inputs(
    dictionary: Dictionary, converters: Sequence[Converter]
) -> list[AnalogueInput]:
    return [
        AnalogueInput(dictionary, number, _at(converters, number))
        for number in channels(dictionary, ANALOGUE_INPUT)
    ]


def _analogue_outputs(
    dictionary: Dictionary, converters: Sequence[Converter]
) -> list[AnalogueOutput]:
    return [
        AnalogueOutput(dictionary, number, _at(converters, number))
        for number in channels(dictionary, ANALOGUE_OUTPUT)
    ]


def _at(converters: Sequence[Converter], number: int) -> Converter | None:
    return converters[number - 1] if number <= len(converters) else None
