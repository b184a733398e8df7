"""Fields of a cyclic frame that change each time: a counter and a checksum.

>>> counter, checksum = parse_counter("0:0..3"), parse_checksum("3:xor")
>>> [checksum.put(counter.put(bytes(4), n)).hex() for n in range(5)]
['00000000', '01000001', '02000002', '03000003', '00000000']
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import xor
from typing import Final

import crcmod

_COUNTER: Final = re.compile(
    r"([0-9]{1,2})(?:\.([0-7])\+([1-8]))?:([0-9]{1,3})\.\.([0-9]{1,3})", re.ASCII
)
_CHECKSUM: Final = re.compile(
    r"([0-9]{1,2}):([a-z0-9-]+)(?::([0-9]{1,2})\.\.([0-9]{1,2}))?", re.ASCII
)

ALGORITHMS: Final[Mapping[str, Callable[[bytes], int]]] = {
    "xor": lambda data: reduce(xor, data, 0),
    "sum8": lambda data: sum(data) & 0xFF,
    "neg8": lambda data: -sum(data) & 0xFF,
    "crc8": crcmod.mkCrcFun(0x11D, initCrc=0x00, rev=False, xorOut=0xFF),
    "crc8-2f": crcmod.mkCrcFun(0x12F, initCrc=0x00, rev=False, xorOut=0xFF),
    "crc8-07": crcmod.mkCrcFun(0x107, initCrc=0x00, rev=False, xorOut=0x00),
}
"""By name. `neg8` makes the sum of all bytes 0. The CRCs are SAE J1850, AUTOSAR 8H2F and SMBus;
the first two begin with 0xFF, which crcmod wants as it is after the final xor.
"""


@dataclass(frozen=True, slots=True)
class Counter:
    """Bits of one byte that count up and begin again.

    Attributes:
        byte: which byte.
        shift: its lowest bit there.
        bits: how many.
        low: what it begins with.
        high: what it ends with.
    """

    byte: int
    shift: int
    bits: int
    low: int
    high: int

    def put(self, data: bytes, number: int) -> bytes:
        """Return the data of the frame with this number, counted from 0."""
        value = self.low + number % (self.high - self.low + 1)
        mask = (1 << self.bits) - 1 << self.shift
        byte = data[self.byte] & ~mask | value << self.shift
        return data[: self.byte] + bytes([byte]) + data[self.byte + 1 :]


@dataclass(frozen=True, slots=True)
class Checksum:
    """One byte that is computed from others.

    Attributes:
        byte: which byte.
        algorithm: a name of `ALGORITHMS`.
        first: first byte that is covered.
        last: last byte that is covered, None for that of the frame; `byte` itself never is.
    """

    byte: int
    algorithm: str
    first: int = 0
    last: int | None = None

    def put(self, data: bytes) -> bytes:
        """Return the data with its checksum."""
        end = len(data) if self.last is None else self.last + 1
        covered = bytes(data[at] for at in range(self.first, end) if at != self.byte)
        value = ALGORITHMS[self.algorithm](covered)
        return data[: self.byte] + bytes([value]) + data[self.byte + 1 :]


@dataclass(frozen=True, slots=True)
class FrameFields:
    """The changing fields of a frame; checksums come after counters, in their order."""

    counters: tuple[Counter, ...] = ()
    checksums: tuple[Checksum, ...] = ()

    def check(self, size: int) -> None:
        """Raise ValueError where a field is not in data of so many bytes."""
        places = [counter.byte for counter in self.counters]
        for checksum in self.checksums:
            places += checksum.byte, checksum.last or 0
        if places and max(places) >= size:
            raise ValueError(
                f"no byte {max(places)} for a counter or checksum: {size} bytes are sent"
            )

    def put(self, data: bytes, number: int) -> bytes:
        """Return the data of the frame with this number, counted from 0."""
        for counter in self.counters:
            data = counter.put(data, number)
        for checksum in self.checksums:
            data = checksum.put(data)
        return data


def parse_counter(text: str) -> Counter:
    """Read `BYTE:LOW..HIGH`, as `0:0..255`, or of some bits `0.4+4:0..14`.

    Raises:
        ValueError: not a counter, or one that its bits do not hold.
    """
    match = _COUNTER.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not BYTE:LOW..HIGH, as 0:0..255, or of bits 0.4+4:0..14")
    byte, shift, bits, low, high = (int(group or 0) for group in match.groups())
    bits = bits or 8
    if shift + bits > 8:
        raise ValueError(f"{text!r} has {bits} bits from bit {shift} of a byte")
    if not low < high < 1 << bits:
        raise ValueError(
            f"{text!r} counts from {low} to {high}; {bits} bits hold {(1 << bits) - 1}"
        )
    return Counter(byte, shift, bits, low, high)


def parse_checksum(text: str) -> Checksum:
    """Read `BYTE:ALGORITHM`, as `7:crc8`, or over some bytes `7:crc8:1..6`.

    Raises:
        ValueError: not a checksum.
    """
    match = _CHECKSUM.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not BYTE:ALGORITHM, as 7:xor, or over bytes 7:crc8:1..6")
    byte, algorithm, first, last = match.groups()
    if algorithm not in ALGORITHMS:
        raise ValueError(f"no checksum {algorithm!r}; known: {', '.join(ALGORITHMS)}")
    if last is not None and int(first) > int(last):
        raise ValueError(f"{text!r} covers bytes {first} to {last}")
    return Checksum(int(byte), algorithm, int(first or 0), None if last is None else int(last))
