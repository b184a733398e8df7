"""What differs between two runs, and when: one line for people."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import zip_longest
from typing import Any, Final

from tickrig.emulators.rig.station import next_tick_us
from tickrig.emulators.testing.properties.device_bench import DeviceBench, Observation
from tickrig.emulators.testing.properties.strategies import Session
from tickrig.wire.instant import NEVER

SENDS: Final = "it sends"

LONGEST: Final = 100
"""More of a value is not shown."""

DENSE, SPARSE = "if every tick is run", "if those that due_us passes over are not"


class TicksDifferError(AssertionError):
    """Dense and sparse ticks differ."""


def in_ms(time_us: int) -> str:
    """Write a time for people.

    >>> in_ms(2_000), in_ms(86_400_000_000)
    ('2.000 ms', '86400.000000 s')
    """
    return f"{time_us / 1_000:.3f} ms" if time_us < 10_000_000 else f"{time_us / 1e6:.6f} s"


def due_text(due_us: int) -> str:
    """Write what `due_us` says.

    >>> due_text(NEVER), due_text(2_000)
    ('NEVER', '2000')
    """
    return "NEVER" if due_us >= NEVER else str(due_us)


def difference(
    device: Any, one: Sequence[Observation], other: Sequence[Observation], first: str, second: str
) -> str:
    """Return in what two runs differ first; empty if they do not.

    Args:
        device: whose outputs are seen.
        one: what was seen in one run.
        other: what was seen in the other one.
        first: which run is the one, behind its value.
        second: which is the other.
    """
    names = [SENDS, *getattr(device, "outputs", ())]
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
    by = "by" if name == SENDS else "at"
    shown, other_shown = shorten(value), shorten(another)
    return f"{by} {in_ms(at_us)} {name} {shown} {first}, {other_shown} {second}"


def shorten(value: Any) -> str:
    """Write a value, in the middle of a line.

    >>> shorten((2_000, b"ok")), shorten(None)
    ("b'ok' at 2.000 ms", 'nothing')
    """
    if value is None:
        return "nothing"
    if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], int):
        return f"{shorten(value[1])} at {in_ms(value[0])}"
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def explain_ticks(bench: Callable[..., DeviceBench], start: Session, session: Session) -> str:
    """Return at which tick dense and sparse ticks differ first, in what, and what was due.

    Args:
        bench: makes one.
        start: what is done before the session.
        session: one in which they differ.
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
