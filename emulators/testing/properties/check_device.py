"""One call that tests what every device must keep, whoever wrote it."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tickrig.device.core import Device
from tickrig.device.twin import twin
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.commands.device_type import DeviceType
from tickrig.emulators.record.recorder import TracedDevice, TraceFile
from tickrig.emulators.record.replay import read_recording, replay
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties import strategies
from tickrig.emulators.testing.properties.strategies import Session
from tickrig.host.text.trace import Header

NOTHING: Final[Session] = ()

SLOW: Final = (HealthCheck.too_slow, HealthCheck.data_too_large)

AFTERWARDS_US: Final = 2_000_000
"""How long a session is watched when nothing more is done."""


def check_device(
    device_type: DeviceType | Callable[[], Device[Any]],
    *,
    traffic: st.SearchStrategy[Any] | None = None,
    wire: Callable[[], ByteLine | CanWire] | None = None,
    start: Session = NOTHING,
    max_examples: int = 30,
) -> None:
    """Test a type of device with any session: bytes or frames, inputs, resets, pauses.

    - Nothing that it meets raises, and what it sends is of the type of its wire.
    - Ticks at which it is not due change nothing (dense = sparse).
    - A host that writes in pieces is answered as one that writes at once.
    - A reset device is as one that was reset twice, with the same inputs.
    - A fresh device that meets the same does the same; on a line from its trace, too.
    - A copy, by `copy.deepcopy`, by pickle and with its rig, goes on as the original; what is
      done to it leaves the original unchanged. One that is put back by a snapshot goes on as
      it was.

    Args:
        device_type: what makes the device: its `DeviceType`, class or function.
        traffic: what a host sends at once, `strategies.chunks(...)` or `strategies.frames(...)`;
            noise unless given.
        wire: makes what the device is on, as `CanWire`; a serial line unless given.
        start: what is done before each session, so that the device is at work:
            `(5_000, "set", ("power_button", 1))` presses a button after 5 ms.
        max_examples: how many sessions for each of the tests.

    Raises:
        AssertionError: one of these does not hold; the text has the shortest session found.

    >>> from tickrig.device.urg.sensor import Urg
    >>> check_device(Urg, traffic=strategies.chunks([b"BM", b"V", b"SCIP2.0"]), max_examples=2)
    """
    if isinstance(device_type, DeviceType):
        make: Callable[[], Any] = partial(device_type.build, {})
        wire = wire or partial(device_type.line.wire, device_type.line.baud)
    else:
        make = device_type
    bench = partial(_Bench, make, wire or SerialLine, start)
    if traffic is None:
        on_can = isinstance(bench().end, CanEnd)
        traffic = strategies.frames() if on_can else strategies.chunks()
    sessions = strategies.sessions(make(), traffic)
    allowed = settings(max_examples=max_examples, deadline=None, suppress_health_check=SLOW)
    for check in (_check_ticks, _check_reset, _check_replay, _check_copies):

        @allowed
        @given(sessions, sessions, sessions)
        def session_of(first: Session, second: Session, third: Session) -> None:
            check(bench, first, second, third)  # noqa: B023 - it is called at once

        session_of()


@dataclass
class _Bench:
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
    wire: Callable[[], ByteLine | CanWire]
    start: Session
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

    def fork(self, copied: Callable[[Any], Any]) -> _Bench:
        """Return a bench of copies."""
        other = copy.copy(self)
        other.rig, other.end, other.device = copied((self.rig, self.end, self.device))
        other.reset = other.device.reset
        return other

    def play(
        self, session: Session, afterwards_us: int = AFTERWARDS_US
    ) -> list[tuple[object, ...]]:
        """Play a session; return what was received of the device and seen on it."""
        log = []
        for wait_us, verb, what in [*session, (afterwards_us, "send", self.nothing)]:
            self.rig.run_for(wait_us)
            received = self.end.poll(self.rig.now_us)
            assert type(received) is type(self.nothing)
            seen = [self.device.read(name) for name in getattr(self.device, "outputs", ())]
            log.append((self.rig.now_us, received, *seen))
            if verb == "reset":
                self.reset()
            elif verb == "set":
                self.device.inputs.set(*what)
            else:
                size = 1 if self.pieces else len(what) or 1
                for at in range(0, len(what), size):
                    self.end.send(self.rig.now_us, what[at : at + size])
        return log


Benches = Callable[..., _Bench]


def _check_ticks(bench: Benches, session: Session, _: Session, __: Session) -> None:
    wanted = bench().play(session)
    assert bench(dense=True).play(session) == wanted, "dense and sparse ticks differ"
    pieces = bench(pieces=True)
    if not isinstance(pieces.joined, Rs485Line):  # where each piece ends on a whole microsecond
        assert pieces.play(session) == wanted, "writing in pieces makes a difference"


def _check_reset(bench: Benches, session: Session, after: Session, _: Session) -> None:
    once, twice = bench(), bench()
    once.play([*session, (0, "reset", None)])
    twice.play([*session, (0, "reset", None), (0, "reset", None)])
    assert once.play(after) == twice.play(after), "a second reset makes a difference"


def _check_replay(bench: Benches, session: Session, _: Session, __: Session) -> None:
    wanted = bench().play(session)
    assert bench().play(session) == wanted, "a fresh device that meets the same does other things"
    if not hasattr(bench().device, "inputs") or bench().nothing != b"":
        return
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trace"
        trace = TraceFile(path, Header("device", {}))
        recorded = bench(trace=trace)
        assert recorded.play(session) == wanted, "a recorded device does other things"
        trace.close(recorded.rig.now_us)
        difference = replay(read_recording(path.read_bytes()), bench().make())
        assert difference is None, f"a replay of its trace differs: {difference}"


def _check_copies(bench: Benches, before: Session, after: Session, otherwise: Session) -> None:
    original, unchanged = bench(), bench()
    original.play(before)
    unchanged.play(before)
    forks = {way: original.fork(copied) for way, copied in COPIES.items()}
    alone = [copied(original.device) for copied in (copy.deepcopy, _pickled)]
    original.fork(twin).play(otherwise)
    now_us, wanted = original.rig.now_us, unchanged.play(after)
    for way, fork in forks.items():
        assert fork.play(after) == wanted, f"a copy by {way} goes on otherwise"
    snapshot = original.rig.snapshot(original.device, original.end)
    assert original.play(after) == wanted, "a copy acts on the original"
    snapshot.restore()
    assert original.play(after) == wanted, "what a snapshot has put back goes on otherwise"
    first, second = (_tick(device, now_us, after, original.nothing) for device in alone)
    assert first == second, "a copy by pickle goes on otherwise"


def _pickled(item: Any) -> Any:
    return pickle.loads(pickle.dumps(item))


def _fork(parts: tuple[Any, ...]) -> Any:
    rig, *others = parts
    return rig.fork(*others)


COPIES: Final[dict[str, Callable[[Any], Any]]] = {
    "copy.deepcopy": copy.deepcopy,
    "pickle": _pickled,
    "rig.fork": _fork,
}


def _tick(device: Any, now_us: int, session: Session, nothing: Any) -> list[object]:
    """Tick a device that is on no wire; return what it sends."""
    sent = []
    for wait_us, verb, what in session:
        until_us = now_us + wait_us + device.tick_us
        if verb == "reset":
            device.reset()
        elif verb == "set":
            device.inputs.set(*what)
        rx = what if verb == "send" else nothing
        while now_us < until_us:
            now_us += device.tick_us - now_us % device.tick_us
            sent.append(device.tick(now_us, rx))
            rx = nothing
    return sent
