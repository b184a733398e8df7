"""A running emulator: its rig, operator, event queue and wire log."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final

from tickrig.emulators.bench.operator import Operator, WireFaults
from tickrig.emulators.record.candump_file import CandumpFile
from tickrig.emulators.record.recorder import TraceFile
from tickrig.emulators.record.trace_recorder import TraceRecorder
from tickrig.emulators.record.wire_log import WireLog
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.rig import Rig
from tickrig.wire.instant import NEVER

UNSEEN_US: Final = 100_000
"""So far ahead devices may work where nobody looks after each step (32 drives: 2 times as fast)."""


class RunningEmulator(ABC):
    """A rig, the hands at its devices, and what is to be done and seen.

    Args:
        name: what the device is called.
        device: the physical side.
        wire: where faults of the wire are armed.
        link: where the host finds it, for people.
        trace: where the run is recorded, to be closed in the end.

    Attributes:
        operator: sets inputs, presses buttons, makes faults.
        event_queue: what is to be done between ticks, by whoever makes the rig's time pass.
        log: the latest lines or frames on the wire.
        rig: the rig.
        after_step: called with the time after each step.
        running: False once `stop` was called.
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
        """When what is done now takes effect: at once in an action, else at the next tick."""
        if self.rig.acting_us is not None:
            return self.rig.acting_us
        now_us, tick_us = self.rig.now_us, self.device.tick_us
        return now_us - now_us % tick_us + tick_us if now_us else 0

    def step(self) -> None:
        """Go to the next time at which something happens, and let it happen."""
        next_us = min(self.rig.next_us, self._host_due_us)
        if self.event_queue.due_us <= min(next_us, NEVER - 1):
            self.rig.step()  # the actions alone; the tick of their time is the next step
        elif next_us < NEVER:
            self.rig.run_to(next_us, unseen_us=0 if self.after_step else UNSEEN_US)
        self._listen(self.rig.now_us)
        for look in self.after_step:
            look(next_us)

    @property
    @abstractmethod
    def _host_due_us(self) -> int:
        """When something arrives at a host that is the caller; `NEVER` if it is outside."""

    @abstractmethod
    def _listen(self, now_us: int) -> None:
        """Take what has arrived there."""

    @abstractmethod
    def send(self, now_us: int, data: bytes) -> None:
        """Put something on the wire, as the host would."""

    @property
    @abstractmethod
    def lost(self) -> dict[str, int]:
        """What found a buffer full."""

    @property
    def trace_error(self) -> str:
        """Why the recording ended early, empty while all is well."""
        return self._trace.error if self._trace else ""

    def stop(self) -> None:
        """Let whoever runs it end after this step."""
        self.running = False

    def close(self) -> None:
        """End the recording."""
        if self._trace is not None:
            self._trace.close(self.rig.now_us)

    def status(self) -> dict[str, str | int]:
        """Return how the run is going."""
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
