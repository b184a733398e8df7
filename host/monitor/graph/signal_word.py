"""What people write to name a curve: `speed=3.velocity_actual_value@2`, `181[2:6]s*0.001`.

>>> parse_signal("speed=181[2:6]s*0.001@2").label
'speed'
>>> parse_signal("3.statusword.fault").source
ObjectName(node=3, name='statusword', bit=3)
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from tickrig.host.monitor.decode.decoded import Signal
from tickrig.host.monitor.decode.drive_state import BITS
from tickrig.host.monitor.graph.frame_slice import FrameSlice, parse_slice

_WORD: Final = re.compile(r"(?:([^=\[\]@]+)=)?([^=@]+)(?:@([1-9]))?")
_OBJECT: Final = re.compile(
    r"(?:([0-9]{1,3})\.)?([a-z_][a-z0-9_.]*|[0-9a-f]{4}h[0-9a-f:]*)", re.ASCII | re.IGNORECASE
)


@dataclass(frozen=True, slots=True)
class ObjectName:
    """An object of a node, or one bit of it.

    Attributes:
        node: node-ID, None for any: a signal of a DBC file has none.
        name: as the decoder names it, or how that begins; in lower case.
        bit: which bit, None for the whole value.
    """

    node: int | None
    name: str
    bit: int | None = None

    def value(self, signal: Signal) -> float | None:
        """Return the number of a signal, None where it is no number."""
        value = signal.value
        if not isinstance(value, int | float):
            return None
        if self.bit is None:
            return value
        return int(value) >> self.bit & 1


@dataclass(frozen=True, slots=True)
class SignalWord:
    """A curve that is asked for.

    Attributes:
        label: what it is called; empty where the text did not say.
        source: what it is taken from.
        axis: its vertical axis, from 1.
        text: the signal as it was written.
    """

    label: str
    source: FrameSlice | ObjectName
    axis: int
    text: str


def parse_signal(text: str) -> SignalWord:
    """Read `[LABEL=]SIGNAL[@AXIS]`: a slice as 181[2:6]s*0.001, or an object as 3.position.

    Raises:
        ValueError: not a signal.
    """
    match = _WORD.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not [LABEL=]SIGNAL[@AXIS], as speed=181[2:6]s*0.001@2")
    label, signal, axis = match.groups()
    source = parse_slice(signal) if "[" in signal else _object(signal)
    return SignalWord(label or "", source, int(axis or 1), signal)


def _object(text: str) -> ObjectName:
    match = _OBJECT.fullmatch(text)
    if match is None or not 1 <= int(match[1] or 1) <= 127:
        raise ValueError(f"{text!r} is neither an object, as 3.position, nor a slice, as 181[2:6]s")
    node, name = int(match[1]) if match[1] else None, match[2].lower()
    base, _, bit = name.rpartition(".")
    shift = BITS.get(base, {}).get(bit)
    return ObjectName(node, name) if shift is None else ObjectName(node, base, shift)
