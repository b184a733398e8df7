"""What bytes mean as acts: lines or frames, noise, changed inputs, pauses, power cuts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

from tickrig.device.physical import InputSignal, SignalType
from tickrig.wire.can import CanFrame

SENDS: Final = 160
SPOILS: Final = 200
NOISES: Final = 224
SETS: Final = 252
"""The first byte of an act: a word below the first, a spoilt one below the second, noise, an
input; a reset from the last on."""

MOST_NOISE: Final = 24
MOST_ACTS: Final = 40


class FuzzAct(NamedTuple):
    """One thing that is done.

    Attributes:
        verb: `send`, `set` or `reset`.
        what: bytes or a frame; the name of an input and its value; None.
        wait_us: how long nothing is done afterwards.
    """

    verb: str
    what: Any
    wait_us: int

    def __str__(self) -> str:
        """Write it as people read it.

        >>> str(FuzzAct("send", b"on", 500)), str(FuzzAct("set", ("stick", 3), 0))
        ('send on, wait 500 us', 'set stick 3, wait 0 us')
        """
        what = self.what
        if isinstance(what, tuple):
            what = " ".join(map(str, what))
        text = repr(what)[2:-1] if isinstance(what, bytes) else "" if what is None else str(what)
        return f"{self.verb} {text}".rstrip() + f", wait {self.wait_us} us"


class InputReader:
    """Reads bytes as acts, any bytes: what fuzzers change in them is small in the acts too.

    Args:
        words: what the device understands: bytes, or frames.
        inputs: what the world can do to it.
        tick_us: its period.
        on_can: whether words are frames.
    """

    def __init__(
        self,
        words: Sequence[bytes | CanFrame],
        inputs: Sequence[InputSignal],
        tick_us: int,
        on_can: bool,
    ) -> None:
        self._words, self._on_can = words, on_can
        self._inputs = [item for item in inputs if item.type is not SignalType.TEXT]
        self._waits = (0, tick_us // 2, tick_us, tick_us, 2 * tick_us, 5 * tick_us, 20_000, 100_000)

    def acts(self, data: bytes) -> Iterator[FuzzAct]:
        """Give the acts; what is left over at the end means nothing."""
        rest = iter(data)
        try:
            for _ in range(MOST_ACTS):
                yield self._act(next(rest), next(rest), rest)
        except StopIteration:
            return

    def _act(self, op: int, timing: int, rest: Iterator[int]) -> FuzzAct:
        wait_us = self._waits[timing & 7]
        if op < SENDS and self._words:
            return FuzzAct("send", self._word(op, timing, rest), wait_us)
        if op < SPOILS and self._words:
            return FuzzAct("send", self._spoilt(self._word(op, timing, rest), rest), wait_us)
        if op < NOISES or (op < SETS and not self._inputs):
            return FuzzAct("send", self._noise(op, rest), wait_us)
        if op < SETS:
            return FuzzAct("set", self._change(rest), wait_us)
        return FuzzAct("reset", None, wait_us)

    def _word(self, op: int, timing: int, rest: Iterator[int]) -> bytes | CanFrame:
        number = next(rest) | (timing >> 3) << 8
        return self._words[number % len(self._words)]

    def _spoilt(self, word: bytes | CanFrame, rest: Iterator[int]) -> bytes | CanFrame:
        if isinstance(word, CanFrame):
            data = _spoilt_bytes(word.data, rest)[:8]
            return CanFrame(word.can_id, data, word.remote, word.extended, word.remote_length)
        return _spoilt_bytes(word, rest)

    def _noise(self, op: int, rest: Iterator[int]) -> bytes | CanFrame:
        length = next(rest) % MOST_NOISE
        if not self._on_can:
            return bytes([next(rest) for _ in range(length + 1)])
        can_id = next(rest) | (op & 7) << 8
        return CanFrame(can_id, bytes([next(rest) for _ in range(length % 9)]))

    def _change(self, rest: Iterator[int]) -> tuple[str, float]:
        item = self._inputs[next(rest) % len(self._inputs)]
        share = next(rest)
        if item.high - item.low <= 1 and not item.real:
            return item.name, item.low + share % (round(item.high - item.low) + 1)
        value = item.low + (item.high - item.low) * share / 255
        return item.name, value if item.real else round(value)


def _spoilt_bytes(word: bytes, rest: Iterator[int]) -> bytes:
    """Return bytes of which one is another, one more, one less, or that end early."""
    at, value, how = next(rest) % (len(word) + 1), next(rest), next(rest) % 4
    if how == 0:
        return word[:at] + bytes([value]) + word[at + 1 :]
    if how == 1:
        return word[:at] + bytes([value]) + word[at:]
    return word[:at] + (word[at + 1 :] if how == 2 else b"")
