"""Words that come with a pause in them: a line means the same, whenever its second half comes."""

from __future__ import annotations

from typing import Any, Final

from tickrig.device.twin import twin
from tickrig.emulators.testing.properties.contract import must
from tickrig.emulators.testing.properties.device_bench import DeviceBench, outputs_of
from tickrig.emulators.testing.properties.difference import shorten
from tickrig.emulators.testing.properties.strategies import Session, Word

MOST_WORDS: Final = 2
"""So many words of a session are tried; there are many sessions."""

Answer = tuple[bytes, list[Any]]
"""What is sent, and the outputs then."""

TICKS: Final = 20
"""So many ticks an answer is waited for."""


def check_pauses(played: DeviceBench, session: Session) -> None:
    """Let words come in two ticks, each half in its own.

    The word counts when its end is there, so it must be answered as if all of it came with the
    end. What is before the first byte that is as the last one is its beginning: a word of several
    lines is cut in the first.

    Args:
        played: a bench with a device at work.
        session: what was done to it.

    Raises:
        AssertionError: it is answered otherwise.
    """
    words = list(dict.fromkeys(what for _, _, what in session if isinstance(what, Word)))
    for word in words[:MOST_WORDS]:
        inside = word.index(word[-1:])
        wanted = _answer(played, b"", word)
        for at in sorted({1, inside // 2, inside} - {0}):
            if at > inside:
                continue
            answer = _answer(played, word[:at], word[at:])
            same = sorted(answer[0]) == sorted(wanted[0]) and answer[1] == wanted[1]
            must(same, _message(word, at, wanted, answer))


def _answer(played: DeviceBench, first: bytes, rest: bytes) -> Answer:
    """Return what a copy of the device answers to two halves, and what is seen then."""
    device = twin(played.device)
    if hasattr(device, "horizon"):
        device.horizon = None
    now_us = played.rig.now_us - played.rig.now_us % device.tick_us
    sent = []
    for rx in [first, rest, *[b""] * TICKS]:
        now_us += device.tick_us
        sent.append(device.tick(now_us, rx))
    return b"".join(sent), outputs_of(device)


def _message(word: Word, at: int, wanted: Answer, got: Answer) -> str:
    what = f"{bytes(word[:at])!r}, and {bytes(word[at:])!r} in the next tick"
    told = f"a pause in a word makes a difference: after {what} it sends {shorten(got[0])}, "
    told += f"after {bytes(word)!r} at once {shorten(wanted[0])}"
    if got[1] != wanted[1]:
        told += f"; its outputs are {got[1]!r} and {wanted[1]!r}"
    return f"{told}. Where a pause ends what is sent, as in Modbus RTU: check_device(pauses=False)"
