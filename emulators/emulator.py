"""One emulated device on a serial line, with all that can be done to it while it runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from tickrig.device.core import NEVER
from tickrig.emulators.agenda import Agenda
from tickrig.emulators.bridge import Bridge
from tickrig.emulators.byte_faults import BYTE_FAULTS
from tickrig.emulators.clock import Clock
from tickrig.emulators.emulated import Emulated
from tickrig.emulators.faults import FaultyPort
from tickrig.emulators.operator import Operator
from tickrig.emulators.port import Port
from tickrig.emulators.recorder import TracedDevice, TraceFile
from tickrig.emulators.rig import Rig, Station
from tickrig.emulators.serial_line import SerialLine
from tickrig.emulators.tap import Tap
from tickrig.emulators.trace import Mark
from tickrig.emulators.wire_log import WireLog


class Outside(Port[bytes], Protocol):
    """Where the host is: a pty."""

    lost: int


class Emulator:
    """A device, its line, its operator, and a rig that runs them.

    Args:
        name: what the device is called.
        device: the device.
        outside: where the host is; without it the host is the caller (`send`, `log`).
        clock: a `VirtualClock` unless given.
        seed: seed of the wire faults' chance.
        trace: where to record the run.
        link: path under which the host finds it, for people.

    Attributes:
        operator: sets inputs, presses buttons, makes faults.
        agenda: what is to be done between ticks.
        log: the latest lines on the wire.
        rig: the rig.
        after_step: told the time after each step.
        running: False once `stop` was called.
    """

    def __init__(  # noqa: PLR0913 - options, by keyword
        self,
        name: str,
        device: Emulated[bytes],
        *,
        outside: Outside | None = None,
        clock: Clock | None = None,
        seed: int = 0,
        trace: TraceFile | None = None,
        link: str = "",
    ) -> None:
        self.name, self.device, self.link, self.running = name, device, link, True
        self._trace, self._outside = trace, outside
        self._acting_us: int | None = None
        self._line = SerialLine()
        self.wire = FaultyPort(self._line.a, BYTE_FAULTS, seed)
        self.agenda, self.log = Agenda(), WireLog()
        self.after_step: list[Callable[[int], None]] = []
        self.operator = Operator(device.inputs, device.tick_us, self.agenda, self.wire)
        station = Station(TracedDevice(device, trace) if trace else device, self.wire)
        bridges = [Bridge(self._line.b, Tap(outside, self.log.hear))] if outside else []
        self.rig = Rig(station, bridges=bridges, clock=clock)

    @property
    def touch_us(self) -> int:
        """When what is done now takes effect: at once in an action, else at the next tick."""
        if self._acting_us is not None:
            return self._acting_us
        now_us, tick_us = self.rig.now_us, self.device.tick_us
        return now_us - now_us % tick_us + tick_us if now_us else 0

    def step(self) -> None:
        """Go to the next time at which something happens, and let it happen."""
        next_us = self.rig.next_us
        if self._outside is None:
            next_us = min(next_us, self._line.b.due_us)
        if self.agenda.due_us <= min(next_us, NEVER - 1):
            next_us = max(self.agenda.due_us, self.rig.now_us)
            self._act(next_us)
        elif next_us < NEVER:
            self.rig.run_to(next_us)
        if self._outside is None and (data := self._line.b.poll(self.rig.now_us)):
            self.log.hear(self.rig.now_us, Mark.FROM_DEVICE, data)
        for look in self.after_step:
            look(next_us)

    def _act(self, now_us: int) -> None:
        """Do what is due at `now_us`, before the tick of that time."""
        self.rig.run_to(now_us - 1)
        self._acting_us = now_us
        self.agenda.run(now_us)
        self._acting_us = None

    def send(self, now_us: int, data: bytes) -> None:
        """Put bytes on the line, as the host would."""
        self.log.hear(now_us, Mark.TO_DEVICE, data)
        self._line.b.send(now_us, data)

    def stop(self) -> None:
        """Let whoever runs it end after this step."""
        self.running = False

    def close(self) -> None:
        """End the recording."""
        if self._trace is not None:
            self._trace.close(self.rig.now_us)

    @property
    def lost_bytes(self) -> int:
        """Bytes that found a buffer full, on the line or outside."""
        outside = self._outside.lost if self._outside else 0
        return self._line.a.lost + self._line.b.lost + outside

    def status(self) -> dict[str, str | int]:
        """Return how the run is going."""
        return {
            "device": self.name,
            "link": self.link,
            "now_us": self.rig.now_us,
            "late_steps": self.rig.late_steps,
            "late_us": self.rig.late_us,
            "lost_bytes": self.lost_bytes,
            "faults": " ".join(self.operator.active_faults),
            "trace_error": self._trace.error if self._trace else "",
        }
