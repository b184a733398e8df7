"""A device on its wire, a host at the other end, and a record of everything observable."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, Final, TypeVar

from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.record.recorder import TracedDevice, TraceFile
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties.strategies import Act, Session
from tickrig.wire.instant import NEVER, next_tick_us

NOTHING: Final[Session] = ()

_AFTERWARDS_US: Final = 2_000_000
"""Time for which a device is observed after the last act of a session."""

Observation = tuple[Any, ...]
"""An observation: the time, the received traffic, and the outputs."""


@dataclass
class DeviceBench:
    """A device on a wire, with a host, for the property-based checks.

    The object records all data that the host receives, and all changes of the device's outputs.

    Attributes:
        make: function that makes the device.
        wire: function that makes the wire.
        start: actions that are executed once, when the bench is made.
        dense: whether the rig calls the device in every tick, not only when it is due.
        pieces: whether the host writes single bytes or frames. If false, it writes all bytes or
            frames of an action at once.
        trace: file in which the device is recorded, or None to record nothing.
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

    def with_end(self, session: Session, afterwards_us: int = _AFTERWARDS_US) -> list[Act]:
        """Return a session, extended by a wait."""
        return [*session, (afterwards_us, "send", self.nothing)]

    def play(self, session: Session, afterwards_us: int = _AFTERWARDS_US) -> list[Observation]:
        """Play a session; return the observations of the device."""
        log = []
        for act in self.with_end(session, afterwards_us):
            self.rig.run_for(act[0])
            log.append(self.look())
            self.do(act)
        return log

    def look(self) -> Observation:
        """Return the present observation."""
        received = self.end.poll(self.rig.now_us)
        return (self.rig.now_us, received, *outputs_of(self.device))

    def do(self, act: Act) -> None:
        """Wait as an act requires, then execute the act."""
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
    """Play a session with a device that has no wire, and return what was observed.

    Args:
        device: the device.
        now_us: time at which the session begins, in microseconds.
        session: actions of host and environment.
        nothing: empty traffic of the type that the device uses: bytes or frames.

    Returns:
        The traffic and the outputs of the device after each action, with times relative to
        `now_us`.
    """
    log, begin_us = [], now_us
    for wait_us, verb, what in [*session, (_AFTERWARDS_US, "send", nothing)]:
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


# What differs between two runs, and when: one line for people.

_SENDS: Final = "it sends"

_LONGEST: Final = 100
"""Largest number of characters shown of a value."""

DENSE, SPARSE = "if every tick is run", "if those that due_us passes over are not"


class TicksDifferError(AssertionError):
    """Dense and sparse ticks differ."""


def in_ms(time_us: int) -> str:
    """Return a time as readable text.

    >>> in_ms(2_000), in_ms(86_400_000_000)
    ('2.000 ms', '86400.000000 s')
    """
    return f"{time_us / 1_000:.3f} ms" if time_us < 10_000_000 else f"{time_us / 1e6:.6f} s"


def due_text(due_us: int) -> str:
    """Return the text of a value of `due_us`.

    >>> due_text(NEVER), due_text(2_000)
    ('NEVER', '2000')
    """
    return "NEVER" if due_us >= NEVER else str(due_us)


def difference(
    device: Any, one: Sequence[Observation], other: Sequence[Observation], first: str, second: str
) -> str:
    """Return a description of the first difference between two runs of a device, or "" if equal.

    Args:
        device: the device that was run. Only the names of its outputs are read.
        one: observations of one run.
        other: observations of the other run.
        first: name of the run `one` in the description, such as `dense`.
        second: name of the run `other` in the description, such as `sparse`.
    """
    names = [_SENDS, *getattr(device, "outputs", ())]
    for (at_us, *seen), (_, *others) in zip(one, other, strict=True):
        for name, value, another in zip(names, seen, others, strict=True):
            if value != another:
                return _message(at_us, name, (value, first), (another, second))
    return ""


def _message(at_us: int, name: str, one: tuple[Any, str], other: tuple[Any, str]) -> str:
    (value, first), (another, second) = one, other
    if isinstance(value, list):  # of what is sent, with the times
        pairs = zip_longest(value, another, fillvalue=None)
        value, another = next(pair for pair in pairs if pair[0] != pair[1])
        at_us = min(sent[0] for sent in (value, another) if sent)
    by = "by" if name == _SENDS else "at"
    shown, other_shown = shorten(value), shorten(another)
    return f"{by} {in_ms(at_us)} {name} {shown} {first}, {other_shown} {second}"


def shorten(value: Any) -> str:
    """Return a value as text for the middle of a line.

    >>> shorten((2_000, b"ok")), shorten(None)
    ("b'ok' at 2.000 ms", 'nothing')
    """
    if value is None:
        return "nothing"
    if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], int):
        return f"{shorten(value[1])} at {in_ms(value[0])}"
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def explain_ticks(bench: Callable[..., DeviceBench], start: Session, session: Session) -> str:
    """Explain a failed check of ticks: return the first difference, and what `due_us` was.

    With dense ticks a device is called at every tick, with sparse ticks only when it is due. If
    both give different results, `due_us` is wrong.

    Args:
        bench: function that makes a bench.
        start: actions before the session.
        session: a session in which dense and sparse ticks differ.
    """
    sparse, dense = bench(start=()), bench(start=(), dense=True)
    for act in sparse.with_end([*start, *session]):
        until_us = sparse.rig.now_us + act[0]
        while (now_us := sparse.rig.now_us) < until_us:
            due_us = sparse.device.due_us
            at_us = min(until_us, next_tick_us(now_us, 0, sparse.device.tick_us))
            for each in (sparse, dense):
                each.rig.run_to(at_us)
            found = difference(sparse.device, [dense.look()], [sparse.look()], DENSE, SPARSE)
            if found:
                return f"dense and sparse ticks differ: {found}; due_us said {due_text(due_us)}"
        for each in (sparse, dense):
            each.do(act)
    return ""


# The acts that a finding needs.

_T = TypeVar("_T")


def shortened(acts: Sequence[_T], fails: Callable[[list[_T]], bool]) -> list[_T]:
    """Remove actions from a failed session as long as the session still fails.

    Args:
        acts: actions with which the check fails.
        fails: function that returns whether a shorter list of actions fails in the same way.

    >>> shortened([1, 2, 3, 4], lambda fewer: 2 in fewer and 4 in fewer)
    [2, 4]
    >>> shortened([1, 2, 3], lambda fewer: fewer in ([1, 2], [2]))
    [2]
    """
    left, before = list(acts), -1
    while len(left) != before:
        before = len(left)
        for at in reversed(range(before)):
            fewer = left[:at] + left[at + 1 :]
            if fails(fewer):
                left = fewer
    return left
