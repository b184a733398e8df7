"""A generic I/O module (CiA 401)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.canopen.ds401 import families
from tickrig.device.canopen.ds401.analogue import (
    AnalogueInput,
    AnalogueOutput,
    Converter,
    InterruptSource,
)
from tickrig.device.canopen.ds401.digital import DigitalInputs, DigitalOutputs
from tickrig.device.canopen.errors import INPUT_ERROR, OUTPUT_ERROR, ErrorBehaviour
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.canopen.slave import Application, CanopenSlave, number_of
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.twin import Immutable, Part
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import NmtState

# Theory of operation
# ===================
#
# The module works once a tick, in `on_execute`, and only in ticks in which it has a reason: a
# physical input was set, one of its objects was written, the NMT state changed, or the filter of
# the digital inputs is due. It works in this order:
#
# 1. faults of the module: EMCY and 1029h; outputs go to their error values at once
# 2. digital inputs: filter, then polarity, then the interrupt masks decide which objects changed
# 3. analogue inputs: converter, then scaling, then limits and deltas (`EventRule`)
# 4. outputs: the values of the objects, or the error values while `failed` is set
#
# Inputs are handled before TPDOs and outputs after RPDOs, because the application is between the
# two in the tick (stack.py). A value that is read in step 2 or 3 is sent in the TPDO of the same
# tick.
#
# How an event is decided: the PDO producer treats each change of a mapped object as an event,
# unless its key is in `quiet`. The module adds all its input objects to `quiet` in `power_on` and
# calls `request_for` itself. So a mapped input whose masks forbid the event sends nothing,
# although its object changes. The deltas of analogue inputs count from the value that was sent
# last, by any TPDO and for any reason. Therefore the producer reports each transmission to
# `_sent`.
#
# `power_on` replaces these lists and does not append to them, because it runs at each power-on of
# the same objects.
#
# The objects or the error mode determine the outputs. Stopped, a communication error (lost
# heartbeat, bus-off) and a fault set `failed`. Operational clears it, unless a fault that stops
# outputs is still present. Both changes go through `_fail`, which requests a tick, because
# `state_changed` and `communication_error` may be called in ticks in which nothing else happens.
#
# Sources: CiA 401 for objects, masks, triggers, error modes and defaults (families.py has its
# tables). If an object is missing, digital events (6005h) and analogue events (6423h) are on. A
# scaling of 0 counts as 1, because many EDS files have 0.

# Faults that a module detects in itself and reports.

_NO_BEHAVIOUR: Final = 0
"""Sub-index for faults to which 1029h does not apply."""


@dataclass(frozen=True, slots=True)
class _DeviceFault(Immutable):
    """A physical fault that the module detects.

    Attributes:
        name: name of the physical input.
        text: description for display.
        code: emergency error code of the fault.
        register: bits of the error register.
        behaviour: sub-index of 1029h that determines the NMT state.
        stops_outputs: whether outputs go to their error values.
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


_INPUT_OVERCURRENT: Final = _DeviceFault(
    "input_overcurrent",
    "the current into an analogue input is too high",
    0x2110,
    ErrorRegister.CURRENT,
    INPUT_ERROR,
    stops_outputs=False,
)
_OUTPUT_OVERLOAD: Final = _DeviceFault(
    "output_overload",
    "the current out of an output is too high",
    0x2310,
    ErrorRegister.CURRENT,
    OUTPUT_ERROR,
    stops_outputs=True,
)
_INTERNAL_FAILURE: Final = _DeviceFault(
    "internal_failure",
    "the electronics of the module fail",
    EmcyCode.HARDWARE,
    ErrorRegister.GENERIC,
    _NO_BEHAVIOUR,
    stops_outputs=True,
)


class _FaultDetector(Part):
    """Detects faults and the end of faults, sends EMCY, and applies 1029h.

    Args:
        node: the slave that reports the faults.
        faults: the faults that the module can have.

    Attributes:
        faults: faults that the module can have, as given.
    """

    def __init__(self, node: CanopenSlave, faults: Sequence[_DeviceFault]) -> None:
        self._node, self.faults = node, faults
        self._present: list[_DeviceFault] = []

    @property
    def stops_outputs(self) -> bool:
        """Whether a present fault stops the outputs."""
        return any(fault.stops_outputs for fault in self._present)

    def forget(self) -> None:
        """Detect the present faults again."""
        self._present.clear()

    def look(self, inputs: QuantityBank) -> bool:
        """Check the physical inputs for faults, and report new and ended faults by EMCY.

        Returns:
            True if a new fault stops the outputs.
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


_GROUP_LINES: Final = 8


class _DigitalTerminal(NamedTuple):
    """One digital output, or all of them."""

    output: OutputSignal
    outputs: DigitalOutputs
    shift: int
    mask: int

    @property
    def level(self) -> int:
        """The lines as one number."""
        return self.outputs.level >> self.shift & self.mask


_Terminal = _DigitalTerminal | AnalogueOutput


def _digital_input_names(lines: int) -> tuple[str, ...]:
    """Return the names `di1` to the last one."""
    return tuple(f"di{line}" for line in range(1, lines + 1))


def _inputs_of(names: Sequence[str]) -> Iterator[InputSignal]:
    """Yield the digital inputs, for which 1 is high."""
    for line, name in enumerate(names, 1):
        yield InputSignal(name, f"digital input {line}")


def _groups(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the names of eight digital inputs at once: `di`, then `di9_16` and so on."""
    found = {}
    for first in range(0, len(names), _GROUP_LINES):
        members = tuple(names[first : first + _GROUP_LINES])
        found[f"di{first + 1}_{first + len(members)}" if first else "di"] = members
    return found


def _outputs_by_name(
    digital: DigitalOutputs, analogue: Iterable[AnalogueOutput]
) -> dict[str, _Terminal]:
    """Return the outputs by name: `do1`.., `do` and `ao1`.."""
    found: list[_Terminal] = [
        _DigitalTerminal(OutputSignal(f"do{line}", f"digital output {line}"), digital, line - 1, 1)
        for line in range(1, digital.lines + 1)
    ]
    if found:
        everything = OutputSignal("do", "all digital outputs as a number, output 1 is bit 0")
        found.append(_DigitalTerminal(everything, digital, 0, (1 << digital.lines) - 1))
    found += analogue
    return {terminal.output.name: terminal for terminal in found}


@mypyc_attr(allow_interpreted_subclasses=True)
class Ds401(Application):
    """Digital and analogue inputs and outputs, as described in the dictionary.

    Events are detected once a tick. A change of an input is an event for TPDOs only if the
    interrupt masks, or the trigger with its limits and deltas, allow it (see `EventRule`). NMT
    Stop, a communication error and a failure of the device switch the outputs to the error
    values. An output leaves its error value when the node becomes Operational or when the output
    is written with another value.

    Digital events are on if 6005h is missing, analogue events if 6423h is missing.

    Not emulated: joysticks; objects of the manufacturer (6404h, 6414h); SI units (6430h and 6450h
    are stored and have no effect); the conversion time.

    Args:
        node: the slave.
        slot: position of the application in the order in which services act in a tick.
        inputs: converters of the analogue inputs, starting with the first input. Inputs without a
            converter use plain counts.
        outputs: converters of the analogue outputs, in the same way.

    Attributes:
        analogue_inputs: analogue inputs of the module.
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
        self._digital_enable = dictionary.find(families.DIGITAL_INTERRUPT_ENABLE)
        self._analogue_enable = dictionary.find(families.ANALOGUE_INTERRUPT_ENABLE)
        self._faults = self._make_faults()
        self._lines = _digital_input_names(self._digital_inputs.lines)
        self._terminals = _outputs_by_name(self._digital_outputs, self._analogue_outputs)
        self.outputs = {name: terminal.output for name, terminal in self._terminals.items()}
        self._has_physical_inputs()
        self._watch_objects()

    def power_on(self) -> None:
        """Accept the inputs as they are, and set the outputs to their resting values."""
        producer = PdoProducer.of(self.node)
        producer.on_sent = [self._sent]
        producer.quiet |= {view.entry.key for view in self._digital_inputs.value.views}
        producer.quiet |= {*self._channels, *(entry.key for entry in self._source.entries)}
        self._digital_inputs.power_on(self._level)
        self._digital_outputs.power_on()
        for output in self._analogue_outputs:
            output.power_on()

    def start(self) -> None:
        """Update which changes are events, and detect faults again."""
        self._faults.forget()
        self._fail(failed=False)
        for channel in self.analogue_inputs:
            channel.begin(self.inputs[channel.name])

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """End the error values in Operational, output them in Stopped."""
        if new is NmtState.OPERATIONAL:
            self._fail(failed=self._faults.stops_outputs)
        elif new is NmtState.STOPPED:
            self._fail(failed=True)

    def communication_error(self) -> None:
        """Output the error values."""
        self._fail(failed=True)

    def read(self, name: str) -> int | float:
        """Return the level that a physical output has after the latest tick.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The level of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        return self._terminals[name].level

    def on_execute(self, now_us: int) -> None:
        """Detect faults, read inputs, cause events, update outputs."""
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
        """The physical digital inputs; line 1 is the lowest bit."""
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

    def _make_faults(self) -> _FaultDetector:
        faults = [_INTERNAL_FAILURE]
        if self.analogue_inputs:
            faults.append(_INPUT_OVERCURRENT)
        if self._digital_outputs.lines or self._analogue_outputs:
            faults.append(_OUTPUT_OVERLOAD)
        return _FaultDetector(self.node, faults)

    def _has_physical_inputs(self) -> None:
        lines = _inputs_of(self._lines)
        analogue = (channel.input for channel in self.analogue_inputs)
        faults = (fault.input for fault in self._faults.faults)
        self.has_inputs((*lines, *analogue, *faults), _groups(self._lines))

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
        for number in families.channels(dictionary, families.ANALOGUE_INPUT)
    ]


def _analogue_outputs(
    dictionary: Dictionary, converters: Sequence[Converter]
) -> list[AnalogueOutput]:
    return [
        AnalogueOutput(dictionary, number, _at(converters, number))
        for number in families.channels(dictionary, families.ANALOGUE_OUTPUT)
    ]


def _at(converters: Sequence[Converter], number: int) -> Converter | None:
    return converters[number - 1] if number <= len(converters) else None
