"""A running emulator: its rig, operator, event queue and wire log."""

from __future__ import annotations

import gc
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Final

from tickrig.emulators.bench.operator import Operator, WireFaults
from tickrig.emulators.record.recorder import CandumpFile, TraceFile, TraceRecorder
from tickrig.emulators.record.wire_log import WireLine, WireLog
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.rig import Rig
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.instant import NEVER

# Measures of a process to keep time: no thread delays the others for long.

_SWITCH_S: Final = 0.0005
"""Switch interval of threads (the default of Python is 5 ms)."""


@contextmanager
def keeping_time() -> Iterator[None]:
    """Context manager that makes a program in real time more punctual.

    Inside the context, Python switches threads more often. A garbage collection of all objects
    takes 50 ms. Therefore garbage collection skips all objects that exist at the start of the
    context (they are "frozen").
    """
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_S)
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before_s)


UNSEEN_US: Final = 100_000
"""Time by which devices may compute ahead if no observer needs each step (32 drives: twice as
fast)."""


class RunningEmulator(ABC):
    """Base class of a running emulator: a rig with its operator, event queue, log and recording.

    Args:
        name: name of the device.
        device: physical inputs and outputs of the device.
        wire: object at which faults of the wire are switched on.
        link: address at which a host reaches the device, as text.
        trace: recording, which is closed at the end.

    Attributes:
        operator: operator that sets inputs, presses buttons and starts faults.
        event_queue: actions between ticks. The code that advances the rig's time runs them.
        log: the latest lines or frames on the wire.
        rig: the rig.
        after_step: functions that are called with the time after each step.
        running: whether the emulator runs, which is false once `stop` was called.
    """

    rig: Rig

    def __init__(
        self,
        name: str,
        device: HasSignals,
        wire: WireFaults,
        link: str,
        trace: TraceFile | CandumpFile | TraceRecorder | None,
    ) -> None:
        self.name, self.wire, self.link, self.running = name, wire, link, True
        self._device, self._trace = device, trace
        self.event_queue, self.log = EventQueue(), WireLog()
        self.after_step: list[Callable[[int], None]] = []
        self.operator = Operator(device.inputs, device.tick_us, self.event_queue, wire)

    @property
    def device(self) -> HasSignals:
        """The physical side of the device."""
        return self._device

    @property
    def effective_us(self) -> int:
        """Time at which an action of the operator takes effect.

        It is the time of the next tick. If the rig is just running a scheduled action from its
        event queue, it is the present time.
        """
        if self.rig.acting_us is not None:
            return self.rig.acting_us
        now_us, tick_us = self.rig.now_us, self.device.tick_us
        return now_us - now_us % tick_us + tick_us if now_us else 0

    def step(self) -> None:
        """Advance to the next event and run it."""
        next_us = min(self.rig.next_us, self._host_due_us)
        if self.event_queue.due_us <= min(next_us, NEVER - 1):
            self.rig.step()  # the actions alone; the tick of their time is the next step
        elif next_us < NEVER:
            self.rig.run_to(next_us, unseen_us=0 if self.after_step else UNSEEN_US)
        self._listen(self.rig.now_us)
        for look in self.after_step:
            look(next_us)

    @property
    def _host_due_us(self) -> int:
        """Arrival time of the next data for a host in this process, or `NEVER`."""
        return NEVER

    def _listen(self, now_us: int) -> None:  # noqa: B027 - hosts of a bench poll themselves
        """Take the data that have arrived for the host."""

    @abstractmethod
    def send(self, now_us: int, data: bytes) -> None:
        """Send on the wire as the host."""

    @property
    @abstractmethod
    def lost(self) -> dict[str, int]:
        """Amount of lost data by buffer."""

    @property
    def trace_error(self) -> str:
        """Reason for which the recording ended early, or "" if there was no error."""
        return self._trace.error if self._trace else ""

    def stop(self) -> None:
        """Stop the run after this step."""
        self.running = False

    def close(self) -> None:
        """End the recording."""
        if self._trace is not None:
            self._trace.close(self.rig.now_us)

    def status(self) -> dict[str, str | int]:
        """Return the status of the run."""
        return {
            "device": self.name,
            "link": self.link,
            "now_us": self.rig.now_us,
            "late_steps": self.rig.late_ticks,
            "late_us": self.rig.worst_late_us,
            **self.lost,
            "faults": " ".join(self.operator.active_faults),
            "trace_error": self.trace_error,
        }


# Transcript of a run, line by line, for people and golden files.

STATE: Final = "state"
"""The output that is watched by default, if the device has it."""


class OutputWatch:
    """Prints physical outputs whenever they change, as lines `TIME * NAME VALUE`.

    Args:
        device: the device with the outputs.
        write: function that is called with each line.
        names: names of the outputs that are watched from the start.
    """

    def __init__(
        self, device: HasSignals, write: Callable[[str], None], names: Iterable[str] = ()
    ) -> None:
        self._device, self._write = device, write
        self._shown: dict[str, Setting] = dict.fromkeys(names, "")

    def add(self, *names: str) -> None:
        """Watch more outputs."""
        for name in names:
            self._shown.setdefault(name, "")

    def __call__(self, now_us: int) -> None:
        """Write the outputs that have changed."""
        for name, shown in self._shown.items():
            if (value := read_signal(self._device, name)) != shown:
                self._shown[name] = value
                self._write(f"{format_time(now_us)} * {name} {value}".rstrip())


class Transcript:
    """Prints what happens in an emulator: lines on the wire, actions of the operator, outputs.

    The lines of the wire appear as the host sees them.

    Args:
        emulator: the emulator to watch.
        write: function that is called with each line.
        wanted: function that decides which lines of the wire are printed.
    """

    def __init__(
        self,
        emulator: RunningEmulator,
        write: Callable[[str], None],
        wanted: Callable[[WireLine], bool] = lambda line: True,
    ) -> None:
        self._emulator, self._write, self._wanted = emulator, write, wanted
        self._watch, self._sending = OutputWatch(emulator.device, write), False
        emulator.operator.note = lambda text: self.write(emulator.effective_us, "!", text)
        emulator.log.listeners.append(self._hear)
        emulator.after_step.append(self._watch)
        if STATE in emulator.device.outputs:
            self.watch(emulator.effective_us, STATE)

    def write(self, now_us: int, mark: str, text: str) -> None:
        """Write a line."""
        self._write(f"{format_time(now_us)} {mark} {text}".rstrip())

    def watch(self, now_us: int, *names: str) -> None:
        """Show outputs now and whenever they change."""
        self._watch.add(*names)
        self._watch(now_us)

    def send(self, now_us: int, data: bytes, shown: bytes) -> None:
        """Send data to the device as the host, and print the data at once.

        An incomplete line is printed, too.

        Args:
            now_us: present time.
            data: bytes to send.
            shown: bytes to print instead of the data. They may lack a part that is the same in each
                message, such as the line end or the CRC.
        """
        self.write(now_us, Mark.TO_DEVICE, escape(shown))
        self._sending = True
        self._emulator.send(now_us, data)
        self._sending = False

    def _hear(self, line: WireLine) -> None:
        if not self._sending and self._wanted(line):
            self.write(line.at_us, line.mark, escape(line.data))
