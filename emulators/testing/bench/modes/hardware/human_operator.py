"""A human at the terminal who is hands and eyes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.device.physical import InputSignal, SignalType
from tickrig.emulators.bench.fault_spec import FaultSpec
from tickrig.emulators.bench.operator import Operator
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.testing.bench.assembly import AssemblyFaults
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.modes.hardware.power_switch import PowerSwitch
from tickrig.emulators.testing.bench.modes.hardware.terminal import Terminal
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting, parse_setting
from tickrig.wire.instant import NEVER

HOLD_US: Final = 1_000_000
"""Who holds a button for so long is told how long."""


class HumanOperator:
    """`DeviceOperator` of a human, who is asked in the words of the device's type.

    What was set is remembered: nobody is asked for it again.

    Args:
        device: name of the device.
        physical: such a device, for its tables; it remembers.
        terminal: where the human is.
        power: switches the device; the human does if there is none.
    """

    late_us, quick = 0, False

    def __init__(
        self,
        device: str,
        physical: HasSignals,
        terminal: Terminal,
        power: PowerSwitch | None = None,
    ) -> None:
        self._device, self._physical, self._terminal = device, physical, terminal
        self._power, self.said_no = power, False
        no_faults = AssemblyFaults({})
        self._record = Operator(physical.inputs, physical.tick_us, EventQueue(), no_faults)

    def prepare(self, like: HasSignals) -> None:
        """Switch it off, if a command can; nobody is asked to bring it anywhere."""
        if self._power is not None:
            self._power.switch(on=False)

    def begin(self) -> None:
        """Switch it on, if a command can."""
        if self._power is not None:
            self._power.switch(on=True)

    def set(self, name: str, values: tuple[Setting, ...]) -> None:
        """Have an input set, or all inputs of a group, and held."""
        pairs = self._record.check_set(name, *values)
        wanted = [self._wish(self._physical.inputs.table[member], value) for member, value in pairs]
        self.have_done(f"{' and '.join(wanted)}, and leave it so")
        self._record.set(name, *values)

    def set_all(self, values: Mapping[str, Setting]) -> None:
        """Have several inputs set, and held, in one go."""
        table = self._physical.inputs.table
        wanted = [self._wish(table[name], value) for name, value in values.items()]
        self.have_done(f"{' and '.join(wanted)}, and leave it so")
        for name, value in values.items():
            self._record.set(name, value)

    def get(self, name: str) -> Setting:
        """Return what an input was set to, or ask for what is seen of an output."""
        if name in self._physical.inputs.table:
            return self._physical.inputs[name]
        output = self._physical.outputs.get(name)
        if output is None:
            names = [*self._physical.inputs.table, *self._physical.outputs]
            raise ValueError(f"no input or output {name!r}; {near(name, names)}")
        unit = f" in {output.unit}" if output.unit else ""
        while True:
            text = self._terminal.prompt(
                f"{self._device}: what is {name} now{unit}? ({output.text})"
            )
            value = parse_setting(text)
            if text and not (output.unit and isinstance(value, str)):
                return value

    def press(self, name: str, duration_us: int) -> None:
        """Have a button pressed and let go."""
        text = self._physical.inputs.find(name, SignalType.BUTTON).text
        held = f", hold it for {duration_us / 1e6:g} s" if duration_us >= HOLD_US else ""
        self.have_done(f"press the {text}{held} and let it go")

    def fault(self, spec: FaultSpec, now_us: int, for_us: int | None) -> None:
        """Have a physical fault made; NotOnThisBench for one of the wire, or of a certain time."""
        item = self._find_fault(spec.name)
        if (spec.rate, spec.from_us, spec.to_us, for_us) != (None, 0, NEVER, None):
            raise NotOnThisBench(f"no hand makes {spec.name} at a certain time")
        self.have_done(f"make this fault: {item.text} ({item.name})")
        self._record.set(spec.name, 1)

    def clear(self, fault: str) -> None:
        """Have a physical fault mended."""
        item = self._find_fault(fault)
        self.have_done(f"mend this fault: {item.text} ({item.name})")
        self._record.set(fault, 0)

    def sees(self, text: str) -> bool | None:
        """Ask whether something is seen."""
        seen = self._terminal.sees(f"{self._device}: is it so? {text}")
        self.said_no |= not seen
        return seen

    def have_done(self, text: str) -> bool:
        """Have something done, told in words."""
        self._terminal.have_done(f"{self._device}: {text}")
        return True

    def switch_power(self, *, on: bool) -> None:
        """Switch the device, or have it switched."""
        if self._power is not None:
            self._power.switch(on=on)
        else:
            self.have_done(f"switch it {'on' if on else 'off'}")

    def close(self) -> None:
        """Nothing is held."""

    def _find_fault(self, name: str) -> InputSignal:
        if name not in self._physical.inputs.table:
            raise NotOnThisBench(f"no hand can make {name}: it is a fault of the wire")
        return self._physical.inputs.find(name, SignalType.FAULT)

    def _wish(self, item: InputSignal, value: Setting) -> str:
        """Say what an input is to become."""
        if item.type is SignalType.FAULT:
            return f"{'make' if value else 'mend'} this fault: {item.text}"
        if item.type is SignalType.BUTTON:
            return f"{'press' if value else 'let go'} the {item.text}"
        unit = f" {item.unit}" if item.unit else ""
        return f"set {item.name} ({item.text}) to {value}{unit}"
