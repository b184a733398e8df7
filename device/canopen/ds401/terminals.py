"""The terminals of a module: what its physical inputs and outputs are called."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from tickrig.device.canopen.ds401.analogue_output import AnalogueOutput
from tickrig.device.canopen.ds401.digital_outputs import DigitalOutputs
from tickrig.device.physical import InputSignal, OutputSignal

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


def outputs(digital: DigitalOutputs, analogue: Iterable[AnalogueOutput]) -> dict[str, Terminal]:
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
