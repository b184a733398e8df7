"""What every device must keep, each for sessions that are drawn."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from tickrig.device.twin import twin
from tickrig.emulators.record.recorder import TraceFile
from tickrig.emulators.record.replay import read_recording, replay
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.testing.properties.contract import check_acts, must
from tickrig.emulators.testing.properties.device_bench import DeviceBench, Observation, drive
from tickrig.emulators.testing.properties.difference import TicksDifferError, difference
from tickrig.emulators.testing.properties.due_probe import (
    SETTLES,
    changed_input,
    check_due_us,
    some_inputs,
)
from tickrig.emulators.testing.properties.pauses import check_pauses
from tickrig.emulators.testing.properties.strategies import Session
from tickrig.host.text.trace import Header

Benches = Callable[..., DeviceBench]

FRESH: Final = (
    "two fresh devices that met the same differ (chance, the machine's clock, or state that they"
    " share)"
)


KEEPS: Final = "reset keeps something (if it is to: check_device(remembers=True))"


class DeviceChecks:
    """The checks of one type of device.

    Args:
        bench: makes a bench with one.
        remembers: a reset leaves more than configuration and inputs.
        pauses: what a host sends means the same with pauses in it.
    """

    def __init__(self, bench: Benches, remembers: bool, pauses: bool) -> None:
        self._bench, self._remembers, self._pauses = bench, remembers, pauses

    def check_ticks(self, session: Session) -> None:
        """Which ticks are run, and how the host writes, makes no difference."""
        bench, played = self._bench, self._bench()
        check_acts(bench(start=()).device, [*played.start, *session], played.nothing)
        wanted = played.play(session)
        again = bench().play(session)
        _same(played, wanted, again, FRESH, "of one", "of the other")
        dense = bench(dense=True).play(session)
        if text := difference(played.device, dense, wanted, "dense", "sparse"):
            raise TicksDifferError(f"dense and sparse ticks differ: {text}", session)
        self._check_pieces(session, wanted)
        check_due_us(bench, session)
        if self._pauses and played.nothing == b"":
            check_pauses(played, session)

    def _check_pieces(self, session: Session, wanted: list[Observation]) -> None:
        pieces = self._bench(pieces=True)
        if isinstance(pieces.joined, Rs485Line):
            return  # where each piece ends on a whole microsecond
        what = "writing in pieces makes a difference"
        _same(pieces, pieces.play(session), wanted, what, "in pieces", "at once")

    def check_reset(self, session: Session, after: Session) -> None:
        """A reset leaves nothing but the inputs."""
        once, twice = self._bench(), self._bench()
        once.play([*session, (0, "reset", None)])
        twice.play([*session, (0, "reset", None), (0, "reset", None)])
        if not self._remembers:
            self._check_fresh(once, once.device, after)
            self._check_inputs_forgotten(session)
        what = "a second reset makes a difference"
        _same(once, twice.play(after), once.play(after), what, "after two", "after one")

    def _check_inputs_forgotten(self, session: Session) -> None:
        """What an input does, and a reset after it, leaves the input alone."""
        played = self._bench()
        played.play(session)
        for item in some_inputs(played.device, len(session)):
            device, _ = changed_input(played, item)
            self._check_fresh(played, device, ())

    def _check_fresh(self, once: DeviceBench, device: Any, after: Session) -> None:
        """A device that was reset is as one that was made now, or at 0, with the same inputs."""
        was_reset, now_us = twin(device), once.rig.now_us
        now_us += (SETTLES + 1) * device.tick_us  # it may have been ticked so often since then
        was_reset.reset()
        devices = (was_reset, once.make(), once.make())
        for name in device.inputs.table if hasattr(device, "inputs") else ():
            for each in devices:  # all know that something was set
                each.inputs.set(name, device.inputs[name])
        times = (now_us, now_us, 0)
        one, *others = map(drive, devices, times, [after] * 3, [once.nothing] * 3)
        if one not in others:
            _same(once, one, others[-1], KEEPS, "after a reset", "of a fresh one")

    def check_replay(self, session: Session) -> None:
        """A device that is made anew does the same from its trace."""
        bench, wanted = self._bench, self._bench().play(session)
        if not hasattr(bench().device, "inputs") or bench().nothing != b"":
            return
        with TemporaryDirectory() as folder:
            path = Path(folder) / "trace"
            trace = TraceFile(path, Header("device", {}))
            recorded = bench(trace=trace)
            seen = recorded.play(session)
            what = "a recorded device does other things"
            _same(recorded, seen, wanted, what, "recorded", "unrecorded")
            trace.close(recorded.rig.now_us)
            differs = replay(read_recording(path.read_bytes()), bench().make())
            must(differs is None, f"a replay of its trace differs: {differs}")

    def check_copies(self, session: Session, after: Session, otherwise: Session) -> None:
        """A copy goes on as the original, and leaves it alone."""
        original, unchanged = self._bench(), self._bench()
        original.play(session)
        unchanged.play(session)
        forks = {way: original.fork(copied) for way, copied in COPIES.items()}
        alone = [copied(original.device) for copied in (copy.deepcopy, _pickled)]
        original.fork(twin).play(otherwise)
        now_us, wanted = original.rig.now_us, unchanged.play(after)
        for way, fork in forks.items():
            what = f"a copy by {way} goes on otherwise"
            _same(fork, fork.play(after), wanted, what, "of the copy", "of the original")
        snapshot = original.rig.snapshot(original.device, original.end)
        what = "a copy acts on the original"
        _same(original, original.play(after), wanted, what, "with a copy", "without")
        snapshot.restore()
        what = "what a snapshot has put back goes on otherwise"
        _same(original, original.play(after), wanted, what, "put back", "before")
        one, other = (drive(each, now_us, after, original.nothing) for each in alone)
        what = "a copy by pickle goes on otherwise"
        _same(original, other, one, what, "of that", "of one by copy.deepcopy")


def _same(  # noqa: PLR0913, PLR0917 - in the order of its text
    bench: DeviceBench,
    one: list[Observation],
    other: list[Observation],
    what: str,
    first: str,
    second: str,
) -> None:
    text = difference(bench.device, one, other, first, second)
    must(not text, f"{what}: {text}")


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
