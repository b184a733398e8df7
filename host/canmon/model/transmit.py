"""Frames that a user of a panel sends, one by one or cyclically, while the panel is armed.

>>> words = parse_row_text("123#00 --every 10ms --counter 0:0..14 --name alive")
>>> words.every, words.counters, words.name, str(words)
('10ms', ('0:0..14',), 'alive', '123#00 --every 10ms --counter 0:0..14 --name alive')

The module also implements fields of a cyclic frame that change each time, which are a counter and a
checksum.

>>> counter, checksum = parse_counter("0:0..3"), parse_checksum("3:xor")
>>> [checksum.put(counter.put(bytes(4), n)).hex() for n in range(5)]
['00000000', '01000001', '02000002', '03000003', '00000000']
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from operator import xor
from typing import Final, NamedTuple

import crcmod

from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, NodeMemory, ObjectText
from tickrig.host.canmon.model.decode.pdos import PDOS, NodePdo, can_id_of
from tickrig.host.text.values import Setting, parse_setting, parse_time_with_unit_us
from tickrig.wire.can import CanFrame, FdFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS, MappedObject, pack_bits
from tickrig.wire.errors import FieldError
from tickrig.wire.instant import NEVER

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
"""Checksums by name.

`neg8` makes the sum of all bytes 0. The CRCs are SAE J1850, AUTOSAR 8H2F and SMBus. The first two
have the initial value 0xFF, because crcmod requires this value after the final xor.
"""


@dataclass(frozen=True, slots=True)
class _Counter:
    """Bits of one byte that count up, and start again after their last value.

    Attributes:
        byte: number of the byte in the data.
        shift: number of the lowest bit in that byte.
        bits: number of bits.
        low: first value of the counter.
        high: last value of the counter.
    """

    byte: int
    shift: int
    bits: int
    low: int
    high: int

    def put(self, data: bytes, number: int) -> bytes:
        """Return the data with new field values for transmission `number`, from 0."""
        value = self.low + number % (self.high - self.low + 1)
        mask = (1 << self.bits) - 1 << self.shift
        byte = data[self.byte] & ~mask | value << self.shift
        return data[: self.byte] + bytes([byte]) + data[self.byte + 1 :]


@dataclass(frozen=True, slots=True)
class _ChecksumField:
    """One byte that is computed from other bytes.

    Attributes:
        byte: number of the byte in the data.
        algorithm: name of the algorithm, from `ALGORITHMS`.
        first: first byte that the checksum covers.
        last: last byte that the checksum covers, or None for the last byte of the frame. The
            checksum never covers `byte` itself.
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
    """The data fields of a cyclic frame that change with each transmission: counters and checksums.

    Counters are set first, so that the checksums cover them.
    """

    counters: tuple[_Counter, ...] = ()
    checksums: tuple[_ChecksumField, ...] = ()

    def check(self, size: int) -> None:
        """Raise ValueError if a field lies outside of data of this length."""
        places = [counter.byte for counter in self.counters]
        for checksum in self.checksums:
            places += checksum.byte, checksum.last or 0
        if places and max(places) >= size:
            raise ValueError(
                f"no byte {max(places)} for a counter or checksum: {size} bytes are sent"
            )

    def put(self, data: bytes, number: int) -> bytes:
        """Return the data with new field values for transmission `number`, from 0."""
        for counter in self.counters:
            data = counter.put(data, number)
        for checksum in self.checksums:
            data = checksum.put(data)
        return data


def parse_counter(text: str) -> _Counter:
    """Parse the description of a counter in the data of a frame that is sent repeatedly.

    With `0:0..255`, byte 0 counts from 0 to 255. With `0.4+4:0..14`, a field of byte 0 counts from
    0 to 14. This field has 4 bits and begins at bit 4.

    Raises:
        ValueError: the text is not a counter, or the values do not fit the bits.
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
    return _Counter(byte, shift, bits, low, high)


def parse_checksum(text: str) -> _ChecksumField:
    """Parse the description of a checksum in the data of a frame.

    The description has the form `BYTE:ALGORITHM` or `BYTE:ALGORITHM:FIRST..LAST`, such as `7:crc8`
    or `7:crc8:1..6`. `BYTE` is the number of the byte with the checksum, from 0. `ALGORITHM` is one
    of `ALGORITHMS`. The checksum covers the bytes `FIRST` to `LAST`, by default all other bytes.

    Raises:
        ValueError: the text is not a checksum.
    """
    match = _CHECKSUM.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not BYTE:ALGORITHM, as 7:xor, or over bytes 7:crc8:1..6")
    byte, algorithm, first, last = match.groups()
    if algorithm not in ALGORITHMS:
        raise ValueError(f"no checksum {algorithm!r}; known: {', '.join(ALGORITHMS)}")
    if last is not None and int(first) > int(last):
        raise ValueError(f"{text!r} covers bytes {first} to {last}")
    return _ChecksumField(
        int(byte), algorithm, int(first or 0), None if last is None else int(last)
    )


# Frames of PDOs by the names of their objects: `5.rpdo1 target_velocity=100`.

_PDO: Final = re.compile(r"([0-9]{1,3})\.([rt])pdo([0-9]{1,3})", re.IGNORECASE | re.ASCII)


class _Place(NamedTuple):
    name: str
    mapped: MappedObject
    text: ObjectText
    power_on: int


class PdoFrames:
    """Encoder of PDOs from names, such as `5.rpdo1 target_velocity=100`.

    An object that the text does not name gets its last sent value, otherwise its power-on value,
    otherwise 0. Values are raw values without scaling.

    Args:
        eds: content of EDS files by node-ID.
    """

    def __init__(self, eds: Mapping[int, EdsObjects]) -> None:
        self._eds = eds  # to which files of a folder may be added
        self._remembered: dict[str, dict[str, int]] = {}

    def remember(self, text: str) -> None:
        """Store the values that a sent PDO gave to its objects.

        If the text of a later frame of the same PDO does not give a value for one of these objects,
        the object gets the stored value.
        """
        pdo, (_, fields) = text.split(maxsplit=1)[0].lower(), self._fields(text)
        self._remembered[pdo] = {place.name: value for place, value in fields}

    def frame(self, text: str) -> CanFrame:
        """Encode a PDO that is written as `NODE.rpdoN NAME=VALUE ...`, and return its frame.

        Raises:
            ValueError: a node, PDO, object or value is unknown. The message lists the known ones.
        """
        can_id, fields = self._fields(text)
        return CanFrame(can_id, pack_bits([(value, place.mapped.bits) for place, value in fields]))

    def _fields(self, text: str) -> tuple[int, list[tuple[_Place, int]]]:
        """Return the CAN-ID, and the value of each object. Raise ValueError as `frame` does."""
        pdo, *settings = text.split()
        match = _PDO.fullmatch(pdo)
        if match is None:
            raise ValueError(f"{pdo!r} is neither a frame as 123#DEADBEEF nor a PDO as 5.rpdo1")
        node, number = int(match[1]), int(match[3])
        if node not in self._eds:
            raise ValueError(f"{pdo}: no description of node {node}; give --eds {node}=FILE")
        memory = NodeMemory(self._eds[node])
        if not 1 <= number <= PDOS:
            raise ValueError(f"{pdo}: PDOs are numbered 1 to {PDOS}")
        sent = NodePdo(match[2].lower() == "r", node, number)
        places = _places(memory, sent.mapping, pdo)
        values = _values(places, settings, pdo, self._remembered.get(pdo.lower(), {}))
        can_id = can_id_of(sent, memory)
        if can_id is None:
            entry = write_entry((sent.parameter, 1))
            raise ValueError(f"{pdo}: it has no CAN-ID ({entry} is not valid)")
        return can_id, [(place, values[place]) for place in places]


def _places(memory: NodeMemory, index: int, pdo: str) -> list[_Place]:
    count = memory.number(index, 0) or 0
    if not 1 <= count <= MAX_MAPPED_OBJECTS:
        raise ValueError(f"{pdo}: nothing is mapped to it ({write_entry((index, 0))} is {count})")
    found = (memory.number(index, sub) or 0 for sub in range(1, count + 1))
    return [_place(memory, MappedObject.parse(entry)) for entry in found]


def _place(memory: NodeMemory, mapped: MappedObject) -> _Place:
    text = memory.describe(mapped.index, mapped.sub)
    name = text.name or write_entry((mapped.index, mapped.sub))
    return _Place(name, mapped, text, memory.number(mapped.index, mapped.sub) or 0)


def _values(
    places: list[_Place], settings: list[str], pdo: str, remembered: Mapping[str, int]
) -> dict[_Place, int]:
    values = {place: remembered.get(place.name, place.power_on) for place in places}
    for setting in settings:
        name, equals, word = setting.partition("=")
        if not equals:
            raise ValueError(f"{pdo}: {setting!r} is not NAME=VALUE")
        place = _named(places, name, pdo)
        try:
            values[place] = _number(place, parse_setting(word))
        except FieldError:
            kind = place.text.kind
            written = kind.name if kind is not None else f"a number of {place.mapped.bits} bits"
            raise ValueError(f"{pdo}: {place.name} is {written}, {word} is not") from None
    return values


def _named(places: list[_Place], name: str, pdo: str) -> _Place:
    """Return the object with this name, or the only object whose name begins with it."""
    found = [place for place in places if place.name == name.lower()]
    found = found or [place for place in places if place.name.startswith(name.lower())]
    if len(found) != 1:
        known = ", ".join(place.name for place in places)
        raise ValueError(
            f"{pdo}: {'no' if not found else 'more than one'} {name!r}; it has {known}"
        )
    return found[0]


def _number(place: _Place, value: Setting) -> int:
    """Return the bits of a value. Raise FieldError if it does not fit the type of the object."""
    kind, bits = place.text.kind, place.mapped.bits
    if kind is None or kind.bits != bits:
        kind = None
    if kind in (DataType.REAL32, DataType.REAL64) and not isinstance(value, str):
        return int.from_bytes(kind.encode(float(value)), "little")
    if kind is not None and kind is not DataType.BOOLEAN:
        return int.from_bytes(kind.encode(value), "little")
    if not isinstance(value, int) or not 0 <= value < 1 << bits:
        raise FieldError(f"{value!r} does not fit {bits} bits")
    return value


AnyFrames = tuple[CanFrame | FdFrame, ...]

_ONCE: Final = 0
"""Value in place of a period, for a row that is sent on request."""


@dataclass(slots=True)
class TransmitRow:
    """A frame that is sent by hand, or cyclically without drift. Its deadlines are absolute.

    A completely missed period is only counted. The frame of that period is not sent later.

    Args:
        name: name of the row.
        frame: frame to send.
        period_us: period of a cyclic row, or `_ONCE` for a row that is sent by hand.
        fields: fields that change each time.
        due_us: time of the next transmission, or `NEVER` while the row is not enabled.
        count: number of transmissions, or 0 for no limit.

    Attributes:
        sent: number of past transmissions.
        missed: number of periods without a transmission.

    Raises:
        ValueError: the period is below 0, or a field is not in the frame.
    """

    name: str
    frame: CanFrame | FdFrame
    period_us: int = _ONCE
    fields: FrameFields = field(default_factory=FrameFields)
    due_us: int = NEVER
    count: int = 0
    sent: int = field(default=0, init=False)
    missed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Check the arguments."""
        if self.period_us < 0:
            raise ValueError(f"{self.name}: a period of {self.period_us} us; 0 is none")
        self.fields.check(len(self.frame.data))

    @property
    def enabled(self) -> bool:
        """Whether the row is sent cyclically."""
        return self.due_us < NEVER

    def enable(self, now_us: int) -> None:
        """Start to send the row cyclically. Counters continue at their last value.

        Raises:
            ValueError: the row has no period.
        """
        if self.period_us == _ONCE:
            raise ValueError(f"{self.name} has no period")
        if not self.enabled:
            self.due_us = now_us

    def disable(self) -> None:
        """Stop sending the row."""
        self.due_us = NEVER

    def once(self) -> AnyFrames:
        """Return the frame to send now."""
        data = self.fields.put(self.frame.data, self.sent)
        self.sent += 1
        return (self.frame._replace(data=data),)

    def tick(self, now_us: int) -> AnyFrames:
        """Return the frame if it is due."""
        if now_us < self.due_us:
            return ()
        late = (now_us - self.due_us) // self.period_us
        self.missed += late
        self.due_us += (late + 1) * self.period_us
        out = self.once()
        if self.sent == self.count:
            self.disable()
        return out


@dataclass(slots=True)
class TransmitList:
    """List of frames that the user can send, once or cyclically, in the monitor.

    Nothing is sent until the list is armed. `stop` disarms the list and disables all rows, so that
    arming it again does not send anything by itself.

    Args:
        rows: rows of the list.

    Attributes:
        armed: whether the list is armed, so that rows may be sent.
    """

    rows: list[TransmitRow] = field(default_factory=list)
    armed: bool = field(default=False, init=False)

    @property
    def due_us(self) -> int:
        """Time of the next transmission of a row."""
        return min((row.due_us for row in self.rows), default=NEVER)

    def stop(self) -> None:
        """Stop sending all rows."""
        self.armed = False
        for row in self.rows:
            row.disable()

    def enable(self, number: int, now_us: int) -> None:
        """Start to send a row cyclically, in its period.

        Args:
            number: number of the row in the list, from 0.
            now_us: present time in microseconds.

        Raises:
            ValueError: the list is not armed, or the row has no period.
        """
        self._check_armed()
        self.rows[number].enable(now_us)

    def once(self, number: int) -> AnyFrames:
        """Return the frame of a row of the transmit list. The caller sends it once.

        Args:
            number: number of the row in the list, from 0.

        Raises:
            ValueError: the list is not armed.
        """
        self._check_armed()
        return self.rows[number].once()

    def tick(self, now_us: int) -> AnyFrames:
        """Return the due frames in the order of the rows."""
        return tuple(frame for row in self.rows for frame in row.tick(now_us))

    def _check_armed(self) -> None:
        if not self.armed:
            raise ValueError("not armed: nothing is sent")


_HEAD: Final = f"{'SENDS':<6} {'FRAME':<26} {'EVERY':>9} {'SENT':>8} {'MISSED':>7}  NAME"
ON, OFF, BY_HAND = "[x]", "[ ]", " - "


def render_transmit(rows: Sequence[TransmitRow]) -> list[str]:
    """Return lines of text: a header, and a line for each row."""
    return [_HEAD, *map(_line, rows)]


def _line(row: TransmitRow) -> str:
    mark = BY_HAND if row.period_us == _ONCE else ON if row.enabled else OFF
    every = "" if row.period_us == _ONCE else f"{row.period_us / 1_000:g} ms"
    frame = str(row.frame) + "*" * (row.fields.counters + row.fields.checksums != ())
    name = "" if row.name == str(row.frame) else row.name
    line = f"{mark:<6} {frame:<26} {every:>9} {row.sent:>8} {row.missed:>7}  {name}"
    return line.rstrip()


_OPTIONS: Final = ("every", "counter", "checksum", "name")


@dataclass(frozen=True, slots=True)
class RowText:
    """A row of the transmit list as text that the user can edit, divided into its parts.

    Attributes:
        frame: a frame such as `123#DEADBEEF`, or a PDO such as `5.rpdo1 target_velocity=100`.
        every: period of a row that is sent cyclically, such as `10ms`, or empty for a row that is
            sent by hand.
        counters: descriptions of counters in the data, such as `0:0..255`.
        checksums: descriptions of checksums in the data, such as `7:crc8`.
        name: displayed name of the row, or empty to show the frame.
    """

    frame: str
    every: str = ""
    counters: tuple[str, ...] = ()
    checksums: tuple[str, ...] = ()
    name: str = ""

    def __str__(self) -> str:
        """Return the text of the row as one line."""
        words = [self.frame]
        words += ["--every", self.every] if self.every else []
        words += [word for counter in self.counters for word in ("--counter", counter)]
        words += [word for checksum in self.checksums for word in ("--checksum", checksum)]
        words += ["--name", shlex.quote(self.name)] if self.name else []
        return " ".join(words)

    def row(self, pdos: PdoFrames) -> TransmitRow:
        """Parse the parts of the text, and return the row of the transmit list that they describe.

        Raises:
            ValueError: the frame, the period, a counter or a checksum is invalid.
        """
        is_frame = "#" in self.frame
        frame = CanFrame.parse(self.frame) if is_frame else pdos.frame(self.frame)
        period_us = parse_time_with_unit_us(self.every) if self.every else _ONCE
        if self.every and period_us == _ONCE:
            raise ValueError("--every takes a time above 0, as 10ms")
        fields = FrameFields(
            tuple(map(parse_counter, self.counters)), tuple(map(parse_checksum, self.checksums))
        )
        return TransmitRow(self.name or self.frame, frame, period_us, fields)


def parse_row_text(text: str) -> RowText:
    """Divide the text of a row of the transmit list into its parts.

    The contents of the parts are checked later by `RowText.row`.

    Raises:
        ValueError: the text is not a row.
    """
    try:
        words = iter(shlex.split(text))
    except ValueError as error:
        raise ValueError(f"{text!r}: {str(error).lower()}") from None
    frame: list[str] = []
    found: Mapping[str, list[str]] = {name: [] for name in _OPTIONS}
    for word in words:
        name = word.removeprefix("--")
        if name == word:
            frame.append(word)
        elif name in found:
            if (value := next(words, None)) is None:
                raise ValueError(f"{word} says nothing")
            found[name].append(value)
        else:
            raise ValueError(f"no {word!r} here; known: --{', --'.join(_OPTIONS)}")
    if not frame:
        raise ValueError("a row needs a frame as 123#DEADBEEF, or a PDO as 5.rpdo1 target=1")
    if len(frame) > 1 and "#" in frame[0]:
        raise ValueError(f"{frame[1]!r} behind a frame: a row has one frame")
    return RowText(
        " ".join(frame),
        _one("every", found["every"]),
        tuple(found["counter"]),
        tuple(found["checksum"]),
        _one("name", found["name"]),
    )


def _one(name: str, words: list[str]) -> str:
    if len(words) > 1:
        raise ValueError(f"--{name} is given {len(words)} times")
    return "".join(words)
