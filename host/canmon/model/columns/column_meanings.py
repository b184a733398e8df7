"""What frames in columns mean, as a text for each, the same as frame by frame; needs numpy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from struct import unpack
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns.columns import Columns, Ints, by_channel, records, select
from tickrig.host.canmon.model.decode.dbc_file import DbcFile, signal_of
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.decoder import BusDecoder, Decoder, Effect, Route
from tickrig.host.canmon.model.decode.node_board import NodeBoard
from tickrig.host.canmon.model.decode.pdos import Field, PdoDecoder
from tickrig.host.canmon.model.frames import ERROR, EXTENDED, REMOTE, Record, decoded_text
from tickrig.host.text.page_text import one_line
from tickrig.wire.can import EXTENDED_MAX, MAX_DATA_BYTES, STANDARD_MAX, CanFrame

if TYPE_CHECKING:
    from cantools.database.can import Message as DbcMessage
    from cantools.database.can import Signal as SignalOfDbc


# Frames of one CAN-ID mean the same kind of thing, so a block is sorted by identifier and each
# group is written at once: the bits of a signal are picked out of all payloads by one numpy call,
# and its numbers become texts by one call of `map`. What stands around them is a format string,
# made once for a PDO or a message of a DBC file. Names of files are data in it: a percent sign
# among them is doubled, and nothing of a file is ever run.
#
# What a CAN-ID means can change: a node is told another mapping, or it boots. Frames that can do
# this are decoded in their order. When one did, what came before it is written as it was, and what
# comes behind is sorted anew. It takes 2 us a frame, where a frame by itself takes 10 to 20.

_Payloads = npt.NDArray[np.uint64]
_Write = Callable[[_Payloads, Ints], Iterable[str]]
"""Writes what some frames mean, by their payloads and lengths; remote frames are not among them."""

_FEW: Final = 16
"""Frames that are decoded one by one sooner than at once."""
_SETTLED: Final = 256
"""So many frames are decoded one by one where what a CAN-ID means has changed."""
_MOST_LAYOUTS: Final = 1 << 10
"""Of PDOs whose format strings are kept."""
_MOST_TEXTS: Final = 1 << 16
"""Texts that are kept of a signal."""


class ColumnMeanings:
    """Decodes blocks of frames.

    Args:
        decoder: it may be fed by others in between.
    """

    def __init__(self, decoder: Decoder) -> None:
        self._decoder = decoder
        self._files = [one for one in decoder.first if isinstance(one, DbcFile)]
        self._apart = len(self._files) == len(decoder.first)
        self._messages: dict[tuple[int, bool], _Write | None] = {}
        self._pdos: dict[int, tuple[PdoDecoder, _Write]] = {}

    def texts(self, columns: Columns) -> Sequence[str]:
        """Return what each frame means, empty where nothing is known."""
        texts = np.full(len(columns), "", object)
        if not self._apart:
            self._one_by_one(columns, np.arange(len(columns)), texts)
            return _list(texts)
        left = self._take_messages(columns, texts)
        for channel, rows, frames in by_channel(select(columns, left)) if len(left) else ():
            found = texts[left[rows]]
            self._take_bus(self._decoder.bus(channel), frames, found)
            texts[left[rows]] = found
        return _list(texts)

    def _one_by_one(self, columns: Columns, rows: Ints, texts: npt.NDArray[np.object_]) -> None:
        for row, record in zip(rows.tolist(), records(select(columns, rows)), strict=True):
            texts[row] = _text(self._decoder, record)

    def _take_messages(self, columns: Columns, texts: npt.NDArray[np.object_]) -> Ints:
        """Take error frames, extended ones and those of DBC files; return which rows are left."""
        ident = columns.ident
        plain = ident & np.uint32(ERROR) == 0
        self._one_by_one(columns, np.flatnonzero(~plain), texts)
        left = plain & (ident & np.uint32(EXTENDED) == 0)
        if not self._files:
            return np.flatnonzero(left)
        for number, rows in _groups(np.where(plain, ident & ~np.uint32(REMOTE), np.uint32(ERROR))):
            if number & ERROR:
                continue
            write = self._message(number & EXTENDED_MAX, bool(number & EXTENDED))
            if write is None:
                continue
            left[rows] = False
            far = ident[rows] & np.uint32(REMOTE) != 0
            self._one_by_one(columns, rows[far], texts)
            near = rows[~far]
            if len(near):
                lengths = columns.dlc[near].astype(np.int64)
                texts[near] = _objects(write(columns.payload[near], lengths))
        return np.flatnonzero(left)

    def _message(self, can_id: int, extended: bool) -> _Write | None:
        """Return what writes the frames of a CAN-ID, where a DBC file names it."""
        ident = can_id, extended
        if ident not in self._messages:
            file = next((file for file in self._files if file.names(*ident)), None)
            self._messages[ident] = None if file is None else _message_writer(file, *ident)
        return self._messages[ident]

    def _take_bus(self, bus: BusDecoder, frames: Columns, texts: npt.NDArray[np.object_]) -> None:
        """Decode data and remote frames with 11-bit identifiers."""
        begin = 0
        while begin < len(frames):
            begin = self._take_settled(bus, frames, begin, texts)
            end = min(begin + _SETTLED, len(frames))
            rows = np.arange(begin, end)
            for row, record in zip(rows.tolist(), records(select(frames, rows)), strict=True):
                before = bus.changes
                texts[row] = _text(self._decoder, record)
                begin = row + 1
                if bus.changes != before and len(frames) - begin > _SETTLED:
                    break

    def _take_settled(
        self, bus: BusDecoder, frames: Columns, begin: int, texts: npt.NDArray[np.object_]
    ) -> int:
        """Decode frames until what a CAN-ID means changes; return the row behind that."""
        ident = frames.ident[begin:]
        groups = [
            (rows + begin, bus.lasting(number & STANDARD_MAX))
            for number, rows in _groups(ident & np.uint32(STANDARD_MAX))
        ]
        each = [rows for rows, route in groups if route is None or len(rows) < _FEW]
        order = np.sort(np.concatenate(each)) if each else np.empty(0, np.int64)
        end = len(frames)
        for first in range(0, len(order), _SETTLED):
            rows = order[first : first + _SETTLED]
            for row, record in zip(rows.tolist(), records(select(frames, rows)), strict=True):
                before = bus.changes
                texts[row] = _text(self._decoder, record)
                if bus.changes != before:
                    end = row + 1
                    break
            if end < len(frames):
                break
        for found, route in groups:
            if route is not None and len(found) >= _FEW:
                rows = found[: np.searchsorted(found, end)]
                texts[rows] = _objects(self._settled(route, select(frames, rows)))
        return end

    def _settled(self, route: Route, frames: Columns) -> Iterable[str]:
        """Write frames of one CAN-ID whose meaning lasts."""
        layout = getattr(route, "__self__", None)
        plain = not (frames.ident & np.uint32(REMOTE)).any()
        if isinstance(layout, PdoDecoder) and plain:
            made = self._pdos.get(id(layout))
            if made is None or made[0] is not layout:
                if len(self._pdos) >= _MOST_LAYOUTS:
                    self._pdos.clear()
                made = self._pdos[id(layout)] = layout, _pdo_writer(layout)
            return made[1](frames.payload, frames.dlc.astype(np.int64))
        parts = frames.ident, frames.payload, frames.dlc
        keys = list(zip(*(part.tolist() for part in parts), strict=True))
        firsts = dict(zip(reversed(keys), range(len(keys) - 1, -1, -1), strict=True))
        found = records(select(frames, np.fromiter(firsts.values(), np.int64, len(firsts))))
        said = [one_line(decoded_text(route(one.at_us, one.frame))) for one in found]  # type: ignore[arg-type]
        return map(dict(zip(firsts, said, strict=True)).__getitem__, keys)


def _text(decoder: Decoder, record: Record) -> str:
    return one_line(decoded_text(decoder.take(record)))


def _list(texts: npt.NDArray[np.object_]) -> Sequence[str]:
    found: Sequence[str] = texts.tolist()
    return found


def _objects(texts: Iterable[str]) -> npt.NDArray[np.object_]:
    found = list(texts)
    objects = np.empty(len(found), object)
    objects[:] = found
    return objects


def _groups(numbers: npt.NDArray[np.uint32]) -> list[tuple[int, Ints]]:
    """Return each number, and the rows that have it."""
    found, places = np.unique(numbers, return_inverse=True)
    order = np.argsort(places.astype(np.uint16) if len(found) < 1 << 16 else places, kind="stable")
    cuts = np.searchsorted(places[order], np.arange(1, len(found)))
    return list(zip(found.tolist(), np.split(order, cuts), strict=True))


class _Column(NamedTuple):
    """A signal of many frames.

    Attributes:
        head: its name, and what stands before its value.
        numbers: returns it as a number, of each payload.
        text: writes a number; None where the number is the text.
        unit: stands behind it.
    """

    head: str
    numbers: Callable[[_Payloads], Sequence[float]]
    text: Callable[[Any], str] | None
    unit: str = ""


def _writer(begin: str, columns: Sequence[_Column], end: str = "") -> _Write:
    """Return what writes the signals of frames of one length."""
    slots = [f"{_escaped(one.head)}%s{_escaped(one.unit)}" for one in columns]
    form = " ".join([_escaped(begin), *slots, *([_escaped(end)] if end else [])])
    if not columns:
        text = (form % ()).rstrip()
        return lambda payloads, _: [text] * len(payloads)
    kept: list[dict[float, str]] = [{} for _ in columns]

    def write(payloads: _Payloads, lengths: Ints) -> Iterable[str]:
        values = [
            _written(one, one.numbers(payloads), texts)
            for one, texts in zip(columns, kept, strict=True)
        ]
        return map(form.__mod__, zip(*values, strict=True))

    return write


def _written(
    column: _Column, numbers: Sequence[float], texts: dict[float, str]
) -> Iterable[object]:
    """Return numbers as they are written; those that come again and again are written once."""
    if column.text is None:
        return numbers
    different = set(numbers)
    new = different - texts.keys()
    if len(texts) + len(new) > _MOST_TEXTS:
        if len(new) * 2 > len(numbers):
            return map(column.text, numbers)
        texts.clear()
        new = different
    for number in new:
        texts[number] = column.text(number)
    return map(texts.__getitem__, numbers)


def _blank_end(text: str) -> bool:
    """Say whether a text ends in blanks, which are left out at the end of a line."""
    return text != text.rstrip()


def _escaped(text: str) -> str:
    return text.replace("%", "%%")


def _by_length(make: Callable[[int], _Write]) -> _Write:
    """Return what writes frames of any length, by what `make` returns for one."""
    made: dict[int, _Write] = {}

    def write(payloads: _Payloads, lengths: Ints) -> Iterable[str]:
        present = np.flatnonzero(np.bincount(lengths)).tolist()
        for length in present:
            made[length] = made.get(length) or make(length)
        if len(present) == 1:
            return made[present[0]](payloads, lengths)
        texts = np.empty(len(payloads), object)
        for length in present:
            rows = np.flatnonzero(lengths == length)
            texts[rows] = _objects(made[length](payloads[rows], lengths[rows]))
        return _list(texts)

    return write


def _bits(payloads: _Payloads, shift: int, mask: int, sign: int = 0) -> npt.NDArray[Any]:
    """Return the numbers that some bits are."""
    raw = payloads >> np.uint64(shift) & np.uint64(mask)
    return ((raw ^ np.uint64(sign)) - np.uint64(sign)).view(np.int64) if sign else raw


def _numbers(bits: Callable[[_Payloads], npt.NDArray[Any]], payloads: _Payloads) -> Sequence[float]:
    numbers: Sequence[float] = bits(payloads).tolist()
    return numbers


# PDOs.


def _pdo_writer(layout: PdoDecoder) -> _Write:
    """Return what writes the frames of a PDO."""

    def decode(data: bytes) -> Decoded:
        return layout.decode(0, CanFrame(0, data))

    def make(length: int) -> _Write:
        columns = [_field_column(field) for field in layout.fields]
        ends = [field.unit for field in layout.fields[-1:]] + [layout.note]
        if length < layout.size or None in columns or any(map(_blank_end, ends)):
            return _single(decode, length)
        begin = one_line(f"{layout.node} {layout.kind}")
        return _writer(begin, [one for one in columns if one], one_line(layout.note))

    return _by_length(make)


def _field_column(field: Field) -> _Column | None:
    """Return how a signal of a PDO is written; None for texts."""
    name, shift, mask, sign, convert, unit, text = field
    if shift >= 8 * MAX_DATA_BYTES or not isinstance(convert(0) if convert else 0, int | float):
        return None
    bits = partial(_bits, shift=shift, mask=mask, sign=0 if convert else sign)
    numbers = partial(_numbers, bits)

    def write(raw: int) -> str:
        return (text(raw) if text else "") or str(convert(raw) if convert else raw)

    return _Column(
        one_line(f"{name}="), numbers, write if convert or text else None, one_line(unit)
    )


# Messages of DBC files.

_FLOATS: Final = {16: "<e", 32: "<f", 64: "<d"}
_SAMPLES: Final = 64
_SHORT: Final = 16
"""Numbers of at most so many bits come again, and each has its text once."""


def _message_writer(file: DbcFile, can_id: int, extended: bool) -> _Write:
    """Return what writes the frames of a message.

    What is made of a message writes some payloads by chance first: it must write them as cantools
    does, which knows more of overlapping and odd signals.
    """

    def decode(data: bytes) -> Decoded:
        found = file.decode(Record(0, "", CanFrame(can_id, data, False, extended)))
        assert found is not None, "the file names it"
        return found

    def make(length: int) -> _Write:
        single = _single(decode, length)
        message = file.message(can_id, extended)
        columns = _message_columns(message, length)
        if columns is None:
            return single
        write = _writer(one_line(f"dbc {message.name}"), columns)
        chance = np.random.default_rng(1).integers(0, 1 << 64, _SAMPLES, np.uint64, False)
        samples = np.append(chance, np.array([0, (1 << 64) - 1], np.uint64)) & _MASKS[length]
        lengths = np.full(len(samples), length)
        alike = list(write(samples, lengths)) == list(single(samples, lengths))
        return write if alike else single

    return _by_length(make)


def _message_columns(message: DbcMessage, length: int) -> list[_Column] | None:
    """Return the signals in so many bytes; None where cantools must find them."""
    if message.is_multiplexed() or message.is_container or message.length > MAX_DATA_BYTES:
        return None
    columns = []
    for signal in message.signals:
        swapped = signal.byte_order == "big_endian"
        start = signal.start ^ 7 if swapped else signal.start  # from the first bit on the bus
        if start + signal.length > 8 * min(length, message.length):
            continue
        shift = 8 * MAX_DATA_BYTES - start - signal.length if swapped else start
        sign = 1 << signal.length - 1 if signal.is_signed and not signal.is_float else 0
        if signal.is_float and signal.length not in _FLOATS:
            return None
        bits = partial(_bits, shift=shift, mask=(1 << signal.length) - 1, sign=sign)
        choices: Mapping[int, object] = signal.choices or {}
        unit = signal.unit or ""
        if any(map(_blank_end, (unit, *map(str, choices.values())))):
            return None
        if swapped:
            bits = partial(_swapped, bits)
        head = one_line(f"{signal.name}=")
        if choices or signal.is_float or signal.length <= _SHORT:
            columns.append(_Column(head, partial(_numbers, bits), partial(_scaled, signal)))
        else:
            columns.append(_Column(head, _scaler(signal, bits), None, one_line(unit)))
    return columns


def _scaler(
    signal: SignalOfDbc, bits: Callable[[_Payloads], npt.NDArray[Any]]
) -> Callable[[_Payloads], Sequence[float]]:
    """Return what picks a number out of payloads and scales it, as cantools does."""
    conversion = signal.conversion
    scale, offset = conversion.scale, conversion.offset
    whole = type(scale) is int
    if scale == 1 and offset == 0 and whole:
        return partial(_numbers, bits)
    if not whole:
        return partial(_numbers, lambda payloads: bits(payloads).astype(float) * scale + offset)
    return lambda payloads: [raw * scale + offset for raw in bits(payloads).tolist()]


def _scaled(signal: SignalOfDbc, raw: int) -> str:
    """Write a signal as cantools scales it, with its unit."""
    number: int | float = raw
    if signal.is_float:
        (number,) = unpack(_FLOATS[signal.length], raw.to_bytes(signal.length // 8, "little"))
    value = signal.conversion.raw_to_scaled(number)
    found = signal_of(signal.name, value, signal.unit or "")
    return one_line(f"{found.text or str(found.value)}{found.unit}")


def _swapped(
    bits: Callable[[_Payloads], npt.NDArray[Any]], payloads: _Payloads
) -> npt.NDArray[Any]:
    return bits(payloads.byteswap())


_MASKS: Final = np.array([(1 << 8 * count) - 1 for count in range(9)], np.uint64)
"""Words of which the first bytes are wanted."""


def _single(decode: Callable[[bytes], Decoded], length: int) -> _Write:
    """Return what decodes frames of a length one by one."""

    def write(payloads: _Payloads, lengths: Ints) -> Iterable[str]:
        for payload in payloads.tolist():
            yield one_line(
                decoded_text(decode(payload.to_bytes(MAX_DATA_BYTES, "little")[:length]))
            )

    return write


# What frames in columns mean, as frame by frame; needs numpy.


# The node board of a log in blocks: only frames that can change it are decoded; needs numpy.

_PIECE: Final = 1 << 10
"""Frames in Python at once."""


class ColumnNodes:
    """Feeds a node board with blocks; what it shows at their end is as frame by frame.

    Of `NodeStatus.pdos`, which the verb does not show, only those that matter to it are there.

    Args:
        decoder: it must be `standard`.
        board: fed by nobody else.
    """

    def __init__(self, decoder: Decoder, board: NodeBoard) -> None:
        self._decoder, self._board, self._begun = decoder, board, False

    def take(self, columns: Columns) -> None:
        """Take a block of frames."""
        if not len(columns):
            return
        if not self._begun:  # nodes with an EDS are on the bus of the very first frame
            self._feed(columns, np.arange(1))
            columns, self._begun = select(columns, np.arange(1, len(columns))), True
        for channel, _, frames in by_channel(columns):
            self._take_bus(self._decoder.bus(channel), frames)
            self._board.now_us = max(self._board.now_us, int(frames.at_us.max()))

    def _take_bus(self, bus: BusDecoder, frames: Columns) -> None:
        before = bus.changes
        for row, record in one_by_one(frames, that_matter(bus, frames)):
            self._board.take(record, self._decoder.take(record))
            if bus.changes != before:
                self._feed(frames, np.arange(row + 1, len(frames)))
                return

    def _feed(self, frames: Columns, rows: Ints) -> None:
        """Take frames whatever they mean."""
        for _, record in one_by_one(frames, rows):
            self._board.take(record, self._decoder.take(record))


def one_by_one(frames: Columns, rows: Ints) -> Iterator[tuple[int, Record]]:
    """Yield some frames as records, each with its row."""
    for begin in range(0, len(rows), _PIECE):
        piece = rows[begin : begin + _PIECE]
        yield from zip(piece.tolist(), records(select(frames, piece)), strict=True)


def that_matter(bus: BusDecoder, frames: Columns) -> Ints:
    """Return the rows of frames that can change what is known of nodes."""
    can_ids = (frames.ident & STANDARD_MAX).astype(np.int64)
    can_ids[frames.ident & (EXTENDED | ERROR) != 0] = STANDARD_MAX + 1
    effects = np.zeros(STANDARD_MAX + 2, np.uint8)
    for can_id in np.flatnonzero(np.bincount(can_ids)[: STANDARD_MAX + 1]).tolist():
        effects[can_id] = bus.effect(can_id)
    found = effects[can_ids]
    each = np.flatnonzero(found >= Effect.ALONE)
    latest = np.flatnonzero(found == Effect.LATEST)
    if not len(latest):
        return each
    low = frames.payload[each] & np.uint64(0xFF)
    between = np.searchsorted(each[(found[each] == Effect.EACH) | (low == 0)], latest)
    kinds = can_ids[latest] << 5 | (frames.ident[latest] & REMOTE != 0) << 4 | frames.dlc[latest]
    _, last = np.unique((between << 16 | kinds)[::-1], return_index=True)
    return np.sort(np.concatenate((each, latest[::-1][last])))
