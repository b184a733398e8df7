"""Ticks long before and just before a device is due: they must change nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from tickrig.device.physical import InputSignal, SignalType
from tickrig.device.twin import twin
from tickrig.emulators.rig.station import next_tick_us
from tickrig.emulators.testing.properties.contract import must
from tickrig.emulators.testing.properties.device_bench import DeviceBench, Observation, outputs_of
from tickrig.emulators.testing.properties.difference import difference, due_text, in_ms
from tickrig.emulators.testing.properties.strategies import Session

DAY_US: Final = 86_400_000_000

AHEAD_US: Final = (0, 10_000, 100_000, 1_000_000, 10_000_000, 60_000_000, 600_000_000)
"""So long after now a tick is tried; and a last one, just before it is due, or after a day."""

MOST_WORDS: Final = 3
"""So many of the words of a session are said after it."""

MOST_INPUTS: Final = 8
"""So many inputs are tried at the end of a session."""

SETTLES: Final = 50
"""In so many ticks a device comes to rest after an input has changed, or is not looked at."""


def check_due_us(bench: Callable[..., DeviceBench], session: Session) -> None:
    """Tick copies of a device before it is due, at the end of each wait of a session.

    Timers of hours are found so, without ticks of hours. At the end of the session it is also
    done after a change of each input, alone.

    Args:
        bench: makes one.
        session: what is done.

    Raises:
        AssertionError: such a tick changes something.
    """
    played = bench()
    words = dict.fromkeys(what for _, verb, what in reversed(session) if verb == "send" and what)
    for act in played.with_end(session):
        played.rig.run_for(act[0])
        probe = _Probe(played.device, played.rig.now_us, played.nothing)
        probe.check()
        played.do(act)
    probe.check_answers([*words][:MOST_WORDS])
    for item in some_inputs(played.device, len(session)):
        _probe_after(played, item)


def some_inputs(device: Any, number: int) -> list[InputSignal]:
    """Return a part of the inputs, in each session another one."""
    table = device.inputs.table.values() if hasattr(device, "inputs") else ()
    items = [item for item in table if item.type is not SignalType.TEXT]
    parts = -(-len(items) // MOST_INPUTS) or 1
    return items[number % parts :: parts]


def changed_input(played: DeviceBench, item: InputSignal) -> tuple[Any, int]:
    """Change an input of a copy, and let it come to rest.

    Returns:
        The copy, and the time.
    """
    device, now_us = _copy(played.device), played.rig.now_us
    value = item.low if device.inputs[item.name] == item.high else item.high
    device.inputs.set(item.name, value if item.real else int(value))  # compiled, bounds are floats
    for _ in range(SETTLES):
        now_us = next_tick_us(now_us, 0, device.tick_us)
        device.tick(now_us, played.nothing)
        if device.due_us > now_us + device.tick_us:
            break
    return device, now_us


def _probe_after(played: DeviceBench, item: InputSignal) -> None:
    """Look whether a copy is due in time after a change of an input."""
    device, now_us = changed_input(played, item)
    try:
        _Probe(device, now_us, played.nothing).check()
    except AssertionError as error:
        raise AssertionError(f"{error} (when {item.name} was set)") from None


def _copy(device: Any) -> Any:
    copied = twin(device)
    if hasattr(copied, "horizon"):
        copied.horizon = None  # somebody looks after each tick
    return copied


class _Probe:
    """Ticks of copies of a device, from now on."""

    def __init__(self, device: Any, now_us: int, nothing: Any) -> None:
        self._device, self._nothing = device, nothing
        self._now_us, self._tick_us = now_us, device.tick_us
        self._due_us = device.due_us
        self._first_us = self._now_us - self._now_us % self._tick_us + self._tick_us
        last_us = min(self._due_us - 1, self._now_us + DAY_US)
        self._last_us = last_us - last_us % self._tick_us

    def check(self) -> None:
        """Raise AssertionError if a tick before it is due changes something."""
        if self._last_us < self._first_us:
            return
        copied = _copy(self._device)
        before = outputs_of(copied)
        for at_us in self._times():
            if self._changes(copied, at_us, before):
                self._refuse(at_us, before)

    def _times(self) -> list[int]:
        times = {self._first_us + ahead - ahead % self._tick_us for ahead in AHEAD_US}
        return sorted({*(each for each in times if each < self._last_us), self._last_us})

    def _changes(self, copied: Any, at_us: int, before: list[Any]) -> bool:
        sent = copied.tick(at_us, self._nothing)
        return bool(sent) or outputs_of(copied) != before

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
        now = (at_us, copied.tick(at_us, self._nothing), *outputs_of(copied))
        then: Observation = (at_us, self._nothing, *before)
        text = difference(copied, [now], [then], "after a tick there", "without it")
        said = f"{in_ms(self._now_us)} due_us said {due_text(self._due_us)}"
        raise AssertionError(
            f"a tick that is not due changes something: {text or 'it, after others'}; "
            f"at {said}, it must be at most {at_us}"
        )

    def check_answers(self, words: list[Any]) -> None:
        """Raise AssertionError if one that was ticked answers otherwise than one that was not."""
        if self._last_us < self._first_us:
            return
        for word in words:
            ticked, other = _copy(self._device), _copy(self._device)
            ticked.tick(self._last_us, self._nothing)
            at_us = self._last_us + self._tick_us
            one, two = (
                [(at_us, each.tick(at_us, word), *outputs_of(each))] for each in (ticked, other)
            )
            text = difference(other, one, two, "after a tick before", "without it")
            said = f"{in_ms(self._now_us)} due_us said {due_text(self._due_us)}"
            told = f"a tick that is not due changes what follows {word!r}: {text}; at {said}"
            must(not text, told)
