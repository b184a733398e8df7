"""Properties that every device must have, each checked with drawn sessions."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from tickrig.device.physical import InputSignal, SignalType
from tickrig.device.twin import twin
from tickrig.emulators.record.recorder import TraceFile
from tickrig.emulators.record.replay import read_recording, replay
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.testing.properties import device_bench
from tickrig.emulators.testing.properties.contract import check_acts, must
from tickrig.emulators.testing.properties.strategies import Session, Word
from tickrig.host.text.trace import Header
from tickrig.wire.instant import next_tick_us

# Theory of operation
# ===================
#
# Each check plays a random session on two benches that differ in one aspect that must not matter.
# It compares what was sent, with its time, and all outputs. The aspects are:
#
# - dense and sparse ticks
# - pieces and whole writes
# - a pause inside a word
# - one reset and two
# - a reset device and a new one
# - an original and its copy
# - a recording and its replay
#
# No check knows what the device should do, because the device is compared with itself. The checks
# therefore work for any device.
#
# The order in `check_ticks` follows the cost and the meaning of a finding. Two new devices come
# first, because random choices or shared state would make every later comparison fail for the wrong
# reason. Then dense ticks are compared with sparse ticks, to find the most common fault (`due_us`
# too late). The rest follows.
#
# `_check_due_us` finds errors in timers of hours without running ticks for hours. A tick before
# `due_us` must change nothing. Copies are therefore ticked at a few times up to just before
# `due_us`, and any change shows that `due_us` was too late. `_refuse` then finds the first such
# tick by bisection, for the message.
#
# State that no output shows is not compared. Such state is found when it has an effect, for example
# when a word is sent after such a tick (`check_answers`).
#
# Devices that work ahead (`horizon`) are observed between ticks here, so copies work tick by tick.
# RS485 lines are excluded from the check of pieces, because each piece ends on a whole microsecond
# on such a line.

# Words that come with a pause in them: a line means the same, whenever its second half comes.

_WORDS_WITH_PAUSES: Final = 2
"""Number of words tried in each session; there are many sessions."""

_Answer = tuple[bytes, list[Any]]
"""Bytes that the device sends, and the outputs afterwards."""

_TICKS: Final = 20
"""Number of ticks to wait for an answer."""


def _check_pauses(played: device_bench.DeviceBench, session: Session) -> None:
    """Check words that arrive in two ticks, a part in each.

    A word counts when its end arrives. The answer must therefore be the same as for a whole word
    that arrives together with its end. The first part ends at the latest before the first byte that
    equals the last byte of the word: a word of several lines is divided within its first line.

    Args:
        played: a bench with a device at work.
        session: the acts already executed.

    Raises:
        AssertionError: the answer differs.
    """
    words = list(dict.fromkeys(what for _, _, what in session if isinstance(what, Word)))
    for word in words[:_WORDS_WITH_PAUSES]:
        # The first byte like the last one ends the beginning: `a\nb\n` is cut within `a\n`,
        # where a pause inside one line is meant and not one between two.
        inside = word.index(word[-1:])
        wanted = _answer(played, b"", word)
        for at in sorted({1, inside // 2, inside} - {0}):
            if at > inside:
                continue
            answer = _answer(played, word[:at], word[at:])
            # Sorted: what the device sends by itself (a status line) may come before or
            # after the answer.
            same = sorted(answer[0]) == sorted(wanted[0]) and answer[1] == wanted[1]
            must(same, _message(word, at, wanted, answer))


def _answer(played: device_bench.DeviceBench, first: bytes, rest: bytes) -> _Answer:
    """Return the answer of a copy of the device to two halves, and the outputs afterwards."""
    device = twin(played.device)
    if hasattr(device, "horizon"):
        device.horizon = None
    now_us = played.rig.now_us - played.rig.now_us % device.tick_us
    sent = []
    for rx in [first, rest, *[b""] * _TICKS]:
        now_us += device.tick_us
        sent.append(device.tick(now_us, rx))
    return b"".join(sent), device_bench.outputs_of(device)


def _message(word: Word, at: int, wanted: _Answer, got: _Answer) -> str:
    what = f"{bytes(word[:at])!r}, and {bytes(word[at:])!r} in the next tick"
    late, once = device_bench.shorten(got[0]), device_bench.shorten(wanted[0])
    told = f"a pause in a word makes a difference: after {what} it sends {late}, "
    told += f"after {bytes(word)!r} at once {once}"
    if got[1] != wanted[1]:
        told += f"; its outputs are {got[1]!r} and {wanted[1]!r}"
    return f"{told}. If a pause ends a frame, as in Modbus RTU: check_device(pauses=False)"


# Ticks long before and just before a device is due: they must change nothing.

_DAY_US: Final = 86_400_000_000

_AHEAD_US: Final = (0, 10_000, 100_000, 1_000_000, 10_000_000, 60_000_000, 600_000_000)
"""Delays after which a tick is tried. The last tick is tried just before the device is due, or
after a day."""

_MOST_WORDS: Final = 3
"""Number of words of a session that are sent after the session."""

_MOST_INPUTS: Final = 8
"""Number of inputs that are tried at the end of a session."""

_SETTLES: Final = 50
"""Number of ticks for a device to become idle after a change of an input. If the device is not idle
then, this check is omitted."""


def _check_due_us(bench: Callable[..., device_bench.DeviceBench], session: Session) -> None:
    """Tick copies of a device before it is due, at the end of each wait of a session.

    This finds errors in timers of hours without running ticks for hours. At the end of the session
    the check is repeated after a change of each input alone.

    Args:
        bench: function that makes a bench.
        session: acts of the session.

    Raises:
        AssertionError: a tick before the device is due changes something.
    """
    played = bench()
    words = dict.fromkeys(what for _, verb, what in reversed(session) if verb == "send" and what)
    for act in played.with_end(session):
        played.rig.run_for(act[0])
        probe = _Probe(played.device, played.rig.now_us, played.nothing)
        probe.check()
        played.do(act)
    probe.check_answers([*words][:_MOST_WORDS])
    for item in _some_inputs(played.device, len(session)):
        _probe_after(played, item)


def _some_inputs(device: Any, number: int) -> list[InputSignal]:
    """Return a part of the inputs; each session gets another part."""
    table = device.inputs.table.values() if hasattr(device, "inputs") else ()
    items = [item for item in table if item.type is not SignalType.TEXT]
    parts = -(-len(items) // _MOST_INPUTS) or 1
    return items[number % parts :: parts]


def _changed_input(played: device_bench.DeviceBench, item: InputSignal) -> tuple[Any, int]:
    """Change an input of a copy, and wait until the copy is idle.

    Returns:
        The copy, and the time.
    """
    device, now_us = _copy(played.device), played.rig.now_us
    value = item.low if device.inputs[item.name] == item.high else item.high
    device.inputs.set(item.name, value if item.real else int(value))  # compiled, bounds are floats
    for _ in range(_SETTLES):
        now_us = next_tick_us(now_us, 0, device.tick_us)
        device.tick(now_us, played.nothing)
        if device.due_us > now_us + device.tick_us:
            break
    return device, now_us


def _probe_after(played: device_bench.DeviceBench, item: InputSignal) -> None:
    """Check whether a copy is due in time after a change of an input."""
    device, now_us = _changed_input(played, item)
    try:
        _Probe(device, now_us, played.nothing).check()
    except AssertionError as error:
        raise AssertionError(f"{error} (when {item.name} was set)") from None


def _copy(device: Any) -> Any:
    copied = twin(device)
    if hasattr(copied, "horizon"):
        copied.horizon = None  # an observer after each tick
    return copied


class _Probe:
    """Ticks of copies of a device, from now on."""

    def __init__(self, device: Any, now_us: int, nothing: Any) -> None:
        self._device, self._nothing = device, nothing
        self._now_us, self._tick_us = now_us, device.tick_us
        self._due_us = device.due_us
        self._first_us = self._now_us - self._now_us % self._tick_us + self._tick_us
        last_us = min(self._due_us - 1, self._now_us + _DAY_US)
        self._last_us = last_us - last_us % self._tick_us

    def check(self) -> None:
        """Raise AssertionError if a tick before the device is due changes something."""
        if self._last_us < self._first_us:
            return
        copied = _copy(self._device)
        before = device_bench.outputs_of(copied)
        for at_us in self._times():
            if self._changes(copied, at_us, before):
                self._refuse(at_us, before)

    def _times(self) -> list[int]:
        times = {self._first_us + ahead - ahead % self._tick_us for ahead in _AHEAD_US}
        return sorted({*(each for each in times if each < self._last_us), self._last_us})

    def _changes(self, copied: Any, at_us: int, before: list[Any]) -> bool:
        sent = copied.tick(at_us, self._nothing)
        return bool(sent) or device_bench.outputs_of(copied) != before

    def _refuse(self, late_us: int, before: list[Any]) -> None:
        """Look for the first tick that changes something, and raise."""
        low, high = 0, (late_us - self._first_us) // self._tick_us
        while low < high:
            middle = (low + high) // 2
            if self._changes(_copy(self._device), self._first_us + middle * self._tick_us, before):
                high = middle
            else:
                low = middle + 1
        at_us = self._first_us + high * self._tick_us
        copied = _copy(self._device)
        now = (at_us, copied.tick(at_us, self._nothing), *device_bench.outputs_of(copied))
        then: device_bench.Observation = (at_us, self._nothing, *before)
        text = device_bench.difference(copied, [now], [then], "after a tick there", "without it")
        said = (
            f"{device_bench.in_ms(self._now_us)} due_us said {device_bench.due_text(self._due_us)}"
        )
        raise AssertionError(
            f"a tick that is not due changes something: {text or 'it, after others'}; "
            f"at {said}, it must be at most {at_us}"
        )

    def check_answers(self, words: list[Any]) -> None:
        """Raise AssertionError if the answers of a copy differ after an early tick."""
        if self._last_us < self._first_us:
            return
        for word in words:
            ticked, other = _copy(self._device), _copy(self._device)
            ticked.tick(self._last_us, self._nothing)
            at_us = self._last_us + self._tick_us
            one, two = (
                [(at_us, each.tick(at_us, word), *device_bench.outputs_of(each))]
                for each in (ticked, other)
            )
            text = device_bench.difference(other, one, two, "after a tick before", "without it")
            due = device_bench.due_text(self._due_us)
            said = f"{device_bench.in_ms(self._now_us)} due_us said {due}"
            told = f"a tick that is not due changes what follows {word!r}: {text}; at {said}"
            must(not text, told)


_Benches = Callable[..., device_bench.DeviceBench]

_FRESH: Final = (
    "two fresh devices that met the same differ (chance, the machine's clock, or state that they"
    " share)"
)


_KEEPS: Final = "reset keeps something (if it is to: check_device(remembers=True))"


class DeviceChecks:
    """Property-based checks of one device type.

    In each check, a session of actions is played: a host sends data, inputs of the device change,
    or the device is reset.

    Args:
        bench: function that makes a bench with one device.
        remembers: whether the device keeps more than its configuration and inputs when it is reset,
            for example stored parameters.
        pauses: whether to check that the answers of the device do not change if the host pauses
            within a message. The value is false for a device whose frames end by a pause.
    """

    def __init__(self, bench: _Benches, remembers: bool, pauses: bool) -> None:
        self._bench, self._remembers, self._pauses = bench, remembers, pauses

    def check_ticks(self, session: Session) -> None:
        """Check that a device behaves the same whether it is called in every tick or only when due.

        The size of the chunks in which the host writes must have no effect either.

        Args:
            session: actions of host and environment, one after the other.
        """
        bench, played = self._bench, self._bench()
        acts = played.with_end([*played.start, *session])  # it ticks at least once
        check_acts(bench(start=()).device, acts, played.nothing)
        wanted = played.play(session)
        again = bench().play(session)
        _same(played, wanted, again, _FRESH, "of one", "of the other")
        dense = bench(dense=True).play(session)
        if text := device_bench.difference(played.device, dense, wanted, "dense", "sparse"):
            raise device_bench.TicksDifferError(f"dense and sparse ticks differ: {text}", session)
        self._check_pieces(session, wanted)
        _check_due_us(bench, session)
        if self._pauses and played.nothing == b"":
            _check_pauses(played, session)

    def _check_pieces(self, session: Session, wanted: list[device_bench.Observation]) -> None:
        pieces = self._bench(pieces=True)
        if isinstance(pieces.joined, Rs485Line):
            return  # where each piece ends on a whole microsecond
        what = "writing in pieces makes a difference"
        _same(pieces, pieces.play(session), wanted, what, "in pieces", "at once")

    def check_reset(self, session: Session, after: Session) -> None:
        """Check that a reset keeps only the inputs."""
        once, twice = self._bench(), self._bench()
        once.play([*session, (0, "reset", None)])
        twice.play([*session, (0, "reset", None), (0, "reset", None)])
        if not self._remembers:
            self._check_fresh(once, once.device, after)
            self._check_inputs_forgotten(session)
        what = "a second reset makes a difference"
        _same(once, twice.play(after), once.play(after), what, "after two", "after one")

    def _check_inputs_forgotten(self, session: Session) -> None:
        """Check that a reset keeps only the inputs, but not their effects."""
        played = self._bench()
        played.play(session)
        for item in _some_inputs(played.device, len(session)):
            device, _ = _changed_input(played, item)
            self._check_fresh(played, device, ())

    def _check_fresh(self, once: device_bench.DeviceBench, device: Any, after: Session) -> None:
        """Check that a reset device equals a device made now, or at 0, with the same inputs."""
        was_reset, now_us = twin(device), once.rig.now_us
        now_us += (_SETTLES + 1) * device.tick_us  # it may have been ticked so often since then
        was_reset.reset()
        devices = (was_reset, once.make(), once.make())
        for name in device.inputs.table if hasattr(device, "inputs") else ():
            for each in devices:  # all know that something was set
                each.inputs.set(name, device.inputs[name])
        times = (now_us, now_us, 0)
        one, *others = map(device_bench.drive, devices, times, [after] * 3, [once.nothing] * 3)
        if one not in others:
            _same(once, one, others[-1], _KEEPS, "after a reset", "of a fresh one")

    def check_replay(self, session: Session) -> None:
        """Check that a device made from the trace of a run behaves identically."""
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
        """Check that a copy behaves like the original, and does not change the original."""
        original, unchanged = self._bench(), self._bench()
        original.play(session)
        unchanged.play(session)
        forks = {way: original.fork(copied) for way, copied in _COPIES.items()}
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
        one, other = (device_bench.drive(each, now_us, after, original.nothing) for each in alone)
        what = "a copy by pickle goes on otherwise"
        _same(original, other, one, what, "of that", "of one by copy.deepcopy")


def _same(  # noqa: PLR0913, PLR0917 - in the order of its text
    bench: device_bench.DeviceBench,
    one: list[device_bench.Observation],
    other: list[device_bench.Observation],
    what: str,
    first: str,
    second: str,
) -> None:
    text = device_bench.difference(bench.device, one, other, first, second)
    must(not text, f"{what}: {text}")


def _pickled(item: Any) -> Any:
    return pickle.loads(pickle.dumps(item))


def _fork(parts: tuple[Any, ...]) -> Any:
    rig, *others = parts
    return rig.fork(*others)


_COPIES: Final[dict[str, Callable[[Any], Any]]] = {
    "copy.deepcopy": copy.deepcopy,
    "pickle": _pickled,
    "rig.fork": _fork,
}
