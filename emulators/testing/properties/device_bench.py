"""A device on its wire, a host at the other end, and all that can be seen of them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.record.recorder import TracedDevice, TraceFile
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station, next_tick_us
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties.strategies import Act, Session

NOTHING: Final[Session] = ()

AFTERWARDS_US: Final = 2_000_000
"""How long a session is watched when nothing more is done."""

Observation = tuple[Any, ...]
"""What was seen: the time, what was received, and the outputs."""


@dataclass
class DeviceBench:
    """A device on its wire, a host at the other end, and all that can be seen of them.

    Attributes:
        make: makes the device.
        wire: makes the wire.
        start: what is done first.
        dense: the rig runs every tick.
        pieces: the host writes byte by byte, frame by frame.
        trace: records the device.
    """

    make: Callable[[], Any]
    wire: Callable[[], ByteLine | CanWire] = SerialLine
    start: Session = NOTHING
    dense: bool = False
    pieces: bool = False
    trace: TraceFile | None = None

    def __post_init__(self) -> None:
        self.device, self.joined = self.make(), self.wire()
        if isinstance(self.joined, CanWire):
            port: Any = self.joined.end()
            self.end: Any = self.joined.end()
        else:
            port, self.end = self.joined.a, self.joined.b
        self.nothing: Any = self.end.poll(0)
        ticked = self.device if self.trace is None else TracedDevice(self.device, self.trace)
        self.rig, self.reset = Rig(Station(ticked, port), dense=self.dense), ticked.reset
        self.play(self.start, 0)

    def fork(self, copied: Callable[[Any], Any]) -> DeviceBench:
        """Return a bench of copies."""
        other = copy.copy(self)
        other.rig, other.end, other.device = copied((self.rig, self.end, self.device))
        other.reset = other.device.reset
        return other

    def with_end(self, session: Session, afterwards_us: int = AFTERWARDS_US) -> list[Act]:
        """Return a session, and that nothing is done for a while after it."""
        return [*session, (afterwards_us, "send", self.nothing)]

    def play(self, session: Session, afterwards_us: int = AFTERWARDS_US) -> list[Observation]:
        """Play a session; return what was received of the device and seen on it."""
        log = []
        for act in self.with_end(session, afterwards_us):
            self.rig.run_for(act[0])
            log.append(self.look())
            self.do(act)
        return log

    def look(self) -> Observation:
        """Return what is seen now."""
        received = self.end.poll(self.rig.now_us)
        return (self.rig.now_us, received, *outputs_of(self.device))

    def do(self, act: Act) -> None:
        """Do an act, after its wait."""
        _, verb, what = act
        if verb == "reset":
            self.reset()
        elif verb == "set":
            self.device.inputs.set(*what)
        else:
            size = 1 if self.pieces else len(what) or 1
            for at in range(0, len(what), size):
                self.end.send(self.rig.now_us, what[at : at + size])


def outputs_of(device: Any) -> list[Any]:
    """Return the present values of all outputs of a device."""
    return [device.read(name) for name in getattr(device, "outputs", ())]


def drive(device: Any, now_us: int, session: Session, nothing: Any) -> list[Observation]:
    """Play a session to a device that is on no wire.

    Returns:
        What it sends and what is seen, with times since `now_us`.
    """
    log, begin_us = [], now_us
    for wait_us, verb, what in [*session, (AFTERWARDS_US, "send", nothing)]:
        sent, until_us = [], now_us + wait_us
        while (at_us := next_tick_us(now_us, device.due_us, device.tick_us)) <= until_us:
            now_us = at_us
            sent.append((now_us - begin_us, device.tick(now_us, nothing)))
        now_us = until_us
        if verb == "reset":
            device.reset()
        elif verb == "set":
            device.inputs.set(*what)
        elif what:
            now_us = next_tick_us(now_us, 0, device.tick_us)
            sent.append((now_us - begin_us, device.tick(now_us, what)))
        log.append((now_us - begin_us, [each for each in sent if each[1]], *outputs_of(device)))
    return log
