"""A human at the terminal who is hands and eyes."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from typing import IO, Final

from tickrig.device.physical import InputSignal, SignalType
from tickrig.emulators.bench.operator import AssemblyFaults, FaultSpec, Operator
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.testing.bench.errors import BenchBlocked, NotOnThisBench, OperatorRefused
from tickrig.emulators.testing.rig_file.plan import PowerPlan
from tickrig.host.links.ready import ready
from tickrig.host.text.names import near
from tickrig.host.text.page_text import harmless
from tickrig.host.text.values import Setting, parse_setting
from tickrig.wire.instant import NEVER

# A device that is switched by commands.

_SWITCH_S: Final = 30.0
"""A command that takes longer is ended."""


class PowerSwitch:
    """Switches a device by the commands of a rig file.

    Args:
        device: name of the device.
        plan: the commands.
    """

    def __init__(self, device: str, plan: PowerPlan) -> None:
        self._device, self._plan = device, plan

    def switch(self, *, on: bool) -> None:
        """Give or take the supply.

        Raises:
            BenchBlocked: the command cannot be run, failed, or did not end.
        """
        command = self._plan.on if on else self._plan.off
        try:
            done = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=_SWITCH_S,
                check=False,
            )
        except OSError as error:
            raise self._blocked(on, error.strerror or str(error)) from None
        except subprocess.TimeoutExpired:
            raise self._blocked(on, f"has not ended after {_SWITCH_S:g} s") from None
        if done.returncode:
            said = done.stderr.decode("utf-8", "replace").strip().split("\n")[-1]
            raise self._blocked(on, f"exit status {done.returncode}{said and f': {said}'}")

    def _blocked(self, on: bool, why: str) -> BenchBlocked:
        state, command = ("on", self._plan.on) if on else ("off", self._plan.off)
        return BenchBlocked(f"{self._device} was not switched {state}: {' '.join(command)}: {why}")


# Who sits at the terminal is told what to do, and asked what happened.

_TERMINAL: Final = "/dev/tty"
_POLL_US: Final = 10_000
_DONE: Final = "then press Enter (n: not done, c: cannot be done)"


class Terminal:
    """Asks at the terminal of this process, whatever its standard input and output are.

    So tests may run with both caught. Hosts go on meanwhile.

    Args:
        path: of the terminal.

    Attributes:
        hosts: are called in turn with microseconds while an answer is awaited.
    """

    def __init__(self, path: str = _TERMINAL) -> None:
        self._path = path
        self.hosts: list[Callable[[int], object]] = []

    def prompt(self, text: str) -> str:
        """Show a text and return the line that is typed.

        Raises:
            OperatorRefused: nobody is there.
        """
        try:
            with open(self._path, "r+b", buffering=0) as terminal:
                terminal.write(f"\n{harmless(text)} ".encode())
                while not self._is_typed(terminal):
                    for host in self.hosts:
                        host(_POLL_US)
                line = terminal.readline()
        except OSError as error:
            raise OperatorRefused(f"nobody is at the terminal ({error.strerror})") from None
        if not line:
            raise OperatorRefused("nobody is at the terminal (end of input)")
        return line.decode("utf-8", "replace").strip()

    def have_done(self, text: str) -> None:
        """Ask for something to be done.

        Args:
            text: what, as a sentence without its end.

        Raises:
            OperatorRefused: it was not done.
            NotOnThisBench: it cannot be done.
        """
        while answer := self.prompt(f"{text}, {_DONE}:").lower():
            if answer == "n":
                raise OperatorRefused(f"the operator did not do this: {text}")
            if answer == "c":
                raise NotOnThisBench(f"the operator cannot do this: {text}")

    def sees(self, question: str) -> bool:
        """Ask a question that is answered by yes or no."""
        while (answer := self.prompt(f"{question} [y/n]").lower()) not in ("y", "n"):
            continue
        return answer == "y"

    def _is_typed(self, terminal: IO[bytes]) -> bool:
        wait_s = 0 if self.hosts else _POLL_US / 1e6
        return bool(ready([terminal], wait_s=wait_s)[0])


_HOLD_US: Final = 1_000_000
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
        held = f", hold it for {duration_us / 1e6:g} s" if duration_us >= _HOLD_US else ""
        self.have_done(f"press the {text}{held} and let it go")

    def fault(self, spec: FaultSpec, now_us: int, for_us: int | None) -> None:
        """Have a physical fault made; NotOnThisBench for one of the wire, or of a certain time."""
        item = self._find_fault(spec.name)
        if (spec.arguments, spec.from_us, spec.to_us, for_us) != ((), 0, NEVER, None):
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
