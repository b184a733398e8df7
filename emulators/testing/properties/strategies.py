"""Hypothesis strategies for acts on a device: bytes, frames, waits, and changes of inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hypothesis import strategies as st

from tickrig.device.core import Device
from tickrig.device.physical import InputSignal, SignalType
from tickrig.wire.can import CanFrame, Frames

Act = tuple[int, str, Any]
"""An act: the wait before it in microseconds, the verb (`send`, `set`, `reset`), and the object."""

Session = Sequence[Act]


def chunks(lines: Sequence[bytes] = (), max_bytes: int = 40) -> st.SearchStrategy[bytes]:
    """Return a Hypothesis strategy for bytes that a host writes at once to a serial line.

    Args:
        lines: lines that the device understands. Half of the drawn bytes are such lines, the other
            half is noise.
        max_bytes: largest number of bytes of noise.
    """
    _check_words(lines)
    noise = st.binary(max_size=max_bytes)
    return st.sampled_from([Word(line) for line in lines]) | noise if lines else noise


class Word(bytes):
    """A word that a device understands, as passed to `chunks`."""

    __slots__ = ()


def _check_words(words: object) -> None:
    """Raise ValueError unless words are a list of bytes."""
    if isinstance(words, str | bytes):
        raise ValueError(f'a list of bytes, as [b"ON\\n"], got {words!r}')
    for word in words if isinstance(words, Sequence) else ():
        if not isinstance(word, bytes):
            raise ValueError(f"a word is bytes, got {word!r}")


def frames(
    known: Sequence[str] = (), can_ids: Sequence[int] = (), most: int = 4
) -> st.SearchStrategy[Frames]:
    """Return a Hypothesis strategy for CAN frames that a host sends at once.

    These are data and remote frames, also with 29-bit identifiers.

    Args:
        known: frames that the device understands, in candump's notation, such as `601#40...`.
        can_ids: identifiers that the device receives. Other identifiers are drawn, too.
        most: largest number of frames at once.
    """
    noise_ids = st.integers(0, 0x7FF)
    ids = st.sampled_from(can_ids) | noise_ids if can_ids else noise_ids
    noise = st.builds(_data, ids, st.binary(max_size=8)) | st.builds(
        _remote, ids, st.booleans(), st.integers(0, 8)
    )
    understood = [CanFrame.parse(text) for text in known]
    one = st.sampled_from(understood) | noise if understood else noise
    return st.lists(one, max_size=most).map(tuple)


def _data(can_id: int, data: bytes) -> CanFrame:
    return CanFrame(can_id, data)


def _remote(can_id: int, extended: bool, length: int) -> CanFrame:
    return CanFrame(can_id, remote=True, extended=extended, remote_length=length)


def waits(tick_us: int) -> st.SearchStrategy[int]:
    """Return a Hypothesis strategy for the duration of a wait in microseconds.

    Most durations are near a multiple of the tick. The longest duration is 1.5 s.

    Args:
        tick_us: period of the device in microseconds.
    """
    near = [0, 1, tick_us // 2, tick_us - 1, tick_us, tick_us + 1, 3 * tick_us, 10 * tick_us]
    return st.sampled_from([*near, 20_000, 100_000, 310_000, 1_500_000])


def values(item: InputSignal) -> st.SearchStrategy[float]:
    """Return a Hypothesis strategy for the values of a physical input.

    Four values are drawn more often than the others: the lower limit and the upper limit of the
    input, and, within these limits, 0 and 1.
    """
    low, high = item.low, item.high
    ends = [value for value in (low, high, 0, 1) if low <= value <= high]
    if item.real:
        return st.sampled_from(ends) | st.floats(low, high, allow_nan=False)
    return st.sampled_from([int(end) for end in ends]) | st.integers(int(low), int(high))


def input_changes(device: Device[Any]) -> st.SearchStrategy[tuple[str, float]]:
    """Draw changes of the inputs of a device; nothing can be drawn without inputs."""
    table = device.inputs.table.values() if hasattr(device, "inputs") else ()
    items = [item for item in table if item.type is not SignalType.TEXT]
    return st.one_of([st.tuples(st.just(item.name), values(item)) for item in items])


def sessions(
    device: Device[Any], traffic: st.SearchStrategy[Any], most: int = 15
) -> st.SearchStrategy[Session]:
    """Return a Hypothesis strategy for sessions of a device.

    A session has actions of a host and of the environment, one after the other.

    Args:
        device: device for which the sessions are made. The device is not changed.
        traffic: strategy for the traffic that a host sends at once; see `chunks` and `frames`.
        most: largest number of actions.
    """
    wait = waits(device.tick_us)
    sent = st.tuples(wait, st.just("send"), traffic)
    changed = st.tuples(wait, st.just("set"), input_changes(device))
    was_reset = st.tuples(wait, st.just("reset"), st.none())
    return st.lists(st.one_of(sent, sent, changed, was_reset), max_size=most)
