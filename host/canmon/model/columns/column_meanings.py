"""The meanings of frames in columns, as the same texts as frame by frame.

The module needs numpy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from struct import unpack
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns import cells
from tickrig.host.canmon.model.columns.column_sdo import ColumnSdo, teachers, teaches
from tickrig.host.canmon.model.columns.columns import Columns, Ints, by_channel, records, select
from tickrig.host.canmon.model.decode.dbc_file import DbcFile, signal_of
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.decoder import (
    BusDecoder,
    Decoder,
    Effect,
    Route,
    data_that_counts,
)
from tickrig.host.canmon.model.decode.node_board import NodeBoard
from tickrig.host.canmon.model.decode.pdos import Field, PdoDecoder
from tickrig.host.canmon.model.decode.sdo import SdoChannel
from tickrig.host.canmon.model.decode.services import decode_error_control
from tickrig.host.canmon.model.frames import ERROR, EXTENDED, REMOTE, Record, decoded_text
from tickrig.host.text.page_text import one_line
from tickrig.wire.can import EXTENDED_MAX, MAX_DATA_BYTES, STANDARD_MAX, CanFrame
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID

if TYPE_CHECKING:
    from cantools.database.can import Message as DbcMessage
    from cantools.database.can import Signal as SignalOfDbc


# Frames of one CAN-ID mean the same kind of thing, so a block is sorted by identifier and each
# group is written at once: the bits of a signal are picked out of all payloads by one numpy call,
# and its numbers become texts by one call of `map`. The text around them is a format string, made
# once per PDO or DBC message. Names from files are data in it: a percent sign in them is doubled,
# and no content of a file is executed.
#
# The meaning of a CAN-ID can change: a node gets another mapping, or it boots. Frames that can do
# this are found first (`_Lessons`), and decoded in order; the frames between two of them are sorted
# and written at once. It takes 1 us a frame, where a frame by itself takes 10 to 20.

_Payloads = npt.NDArray[np.uint64]
_Write = Callable[[cells.Texts, Ints, _Payloads, Ints], None]
"""Function that writes the meanings of frames, except remote frames.

The arguments of the function are texts, rows, payloads and lengths.
"""

_FEW: Final = 16
"""Frames that are decoded one by one sooner than at once."""
_SETTLED: Final = 128
"""Frames that are decoded one by one before the next try: there are fewer, or a meaning changed."""
_MOST_LAYOUTS: Final = 1 << 10
"""Number of PDOs whose format strings are kept."""


class ColumnMeanings:
    """Decoder that returns the meanings of whole blocks of frames, with numpy.

    The texts are the same as those of the decoder for single frames.

    Args:
        decoder: decoder for single frames, which contains what is known about the nodes. It may
            decode other frames between two blocks.
    """

    def __init__(self, decoder: Decoder) -> None:
        self._decoder = decoder
        self._files = [one for one in decoder.first if isinstance(one, DbcFile)]
        self._apart = len(self._files) == len(decoder.first)
        self._messages: dict[tuple[int, bool], _Write | None] = {}
        self._pdos: dict[int, tuple[PdoDecoder, _Write]] = {}
        self._sdo: dict[str, ColumnSdo] = {}

    def texts(self, columns: Columns) -> cells.Texts:
        """Return the meaning of each frame, empty if it is unknown."""
        texts, rows = cells.Texts(len(columns)), np.arange(len(columns))
        if not self._apart:
            self._one_by_one(columns, rows, texts)
            return texts
        left = self._take_messages(columns, texts)
        for channel, found, frames in by_channel(select(columns, left)) if len(left) else ():
            self._take_bus(self._decoder.bus(channel), frames, left[found], texts)
        return texts

    def _one_by_one(self, columns: Columns, rows: Ints, texts: cells.Texts) -> None:
        for row, record in zip(rows.tolist(), records(select(columns, rows)), strict=True):
            texts.put_one(row, _text(self._decoder, record))

    def _take_messages(self, columns: Columns, texts: cells.Texts) -> Ints:
        """Process error frames, extended frames and frames in DBC files.

        Return the remaining rows.
        """
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
                write(texts, near, columns.payload[near], lengths)
        return np.flatnonzero(left)

    def _message(self, can_id: int, extended: bool) -> _Write | None:
        """Return a function that writes the frames of a CAN-ID, if a DBC file names the CAN-ID."""
        ident = can_id, extended
        if ident not in self._messages:
            file = next((file for file in self._files if file.names(*ident)), None)
            self._messages[ident] = None if file is None else _message_writer(file, *ident)
        return self._messages[ident]

    def _take_bus(self, bus: BusDecoder, frames: Columns, places: Ints, texts: cells.Texts) -> None:
        """Decode data and remote frames with 11-bit identifiers, whose places are other rows."""
        begin, lessons = 0, _Lessons(bus, frames, 0)
        while begin < len(frames):
            if lessons.version != bus.version:
                lessons = _Lessons(bus, frames, begin)
            end = lessons.next(begin)
            if end - begin >= _SETTLED:
                rows = slice(begin, end)
                self._take_settled(bus, select(frames, rows), places[rows], texts)
                begin = end
            else:
                begin = self._take_unsettled(bus, frames, range(begin, end + 1), places, texts)

    def _take_unsettled(
        self, bus: BusDecoder, frames: Columns, rows: range, places: Ints, texts: cells.Texts
    ) -> int:
        """Decode frames in order, more of them if a meaning changes; return the row behind them."""
        row, end = rows.start, rows.stop
        while row < min(end, len(frames)):
            piece = select(frames, slice(row, min(end, len(frames))))
            for record in records(piece):
                before = bus.version
                texts.put_one(int(places[row]), _text(self._decoder, record))
                row += 1
                if bus.version != before:
                    end = row + _SETTLED
        return row

    def _take_settled(
        self, bus: BusDecoder, frames: Columns, places: Ints, texts: cells.Texts
    ) -> None:
        """Decode frames of which none changes what a CAN-ID or an object means."""
        each, speakers = list[Ints](), list[tuple[SdoChannel, bool, Ints]]()
        alike = list[_Alike]()
        for number, rows in _groups(frames.ident & np.uint32(STANDARD_MAX)):
            if speaker := bus.sdo(number):
                speakers.append((*speaker, rows))
            elif len(rows) < _FEW:
                each.append(rows)
            elif route := bus.lasting(number):
                layout = bus.layout(number)
                remote = frames.ident[rows] & np.uint32(REMOTE) != 0
                if layout and not remote.any():
                    lengths = frames.dlc[rows].astype(np.int64)
                    write = self._pdo(layout)
                    write(texts, places[rows], frames.payload[rows], lengths)
                else:
                    alike.append(_Alike(rows, route))
            elif (node := bus.error_control(number)) is not None:
                alike += _error_control(bus, node, frames, rows, each)
            else:
                each.append(rows)
        if speakers:
            name = frames.channels[int(frames.channel[0])]
            sdo = self._sdo[name] = self._sdo.get(name) or ColumnSdo(bus)
            sdo.take(frames, speakers, places, texts)
        if alike:
            _take_alike(alike, frames, places, texts)
        if each:
            rows = np.sort(np.concatenate(each))
            for row, record in one_by_one(frames, rows):
                texts.put_one(int(places[row]), _text(self._decoder, record))

    def _pdo(self, layout: PdoDecoder) -> _Write:
        """Return what writes the frames of a PDO."""
        made = self._pdos.get(id(layout))
        if made is None or made[0] is not layout:
            if len(self._pdos) >= _MOST_LAYOUTS:
                self._pdos.clear()
            made = self._pdos[id(layout)] = layout, _pdo_writer(layout)
        return made[1]


class _Alike(NamedTuple):
    """Frames of one CAN-ID whose text depends on nothing but the frame.

    Attributes:
        rows: their rows.
        route: decodes one of them.
    """

    rows: Ints
    route: Route


def _error_control(
    bus: BusDecoder, node: int, frames: Columns, rows: Ints, each: list[Ints]
) -> list[_Alike]:
    """Return the frames of error control of a node; boot-ups go to `each`."""
    remote = frames.ident[rows] & np.uint32(REMOTE) != 0
    boots = (frames.payload[rows] == 0) & (frames.dlc[rows] == 1) & ~remote
    requested = bool(remote[-1])
    if node not in bus.guarded and not remote.any():
        each.append(rows[boots])
        return [_Alike(rows[~boots], partial(_error_control_state, node, False))]
    guarded = np.empty(len(rows), np.bool_)
    guarded[0], guarded[1:] = node in bus.guarded, remote[:-1]
    guarded &= bus.answers_guarding(node)
    if (boots & ~guarded).any():
        each.append(rows)
        return []
    bus.guard(node, requested=requested)
    return [
        _Alike(rows[guarded == one], partial(_error_control_state, node, one))
        for one in (False, True)
    ]


def _error_control_state(node: int, guarded: bool, at_us: int, frame: CanFrame) -> Decoded:
    return decode_error_control(node, frame, guarded=guarded)


_LONG: Final = 1 << 40
"""Data from here on is numbered, because it does not fit into a key."""


def _take_alike(
    groups: Sequence[_Alike], frames: Columns, places: Ints, texts: cells.Texts
) -> None:
    """Write frames of which those with the same data have one text."""
    rows = np.concatenate([one.rows for one in groups])
    kinds = np.repeat(np.arange(len(groups)), [len(one.rows) for one in groups]) << 5
    masks = np.array([data_that_counts(one.route) for one in groups], np.uint64)[kinds >> 5]
    remote = frames.ident[rows] & np.uint32(REMOTE) != 0
    kinds |= remote.astype(np.int64) << 4 | np.where(masks != 0, frames.dlc[rows], 0)
    payload = frames.payload[rows] & masks
    short, long = payload < 1 << 8, payload >= _LONG
    for chosen in map(np.flatnonzero, (short, ~short & ~long, long)):
        if not len(chosen):
            continue
        data, kind = payload[chosen].astype(np.int64), kinds[chosen]
        if long[chosen[0]]:
            data = np.unique(payload[chosen], return_inverse=True)[1]
        numbers = np.cumsum(np.bincount(kind) != 0) - 1
        keys = data * int(numbers[-1] + 1) + numbers[kind]
        if int(keys.max()) < 1 << 16:
            keys = keys.astype(np.uint16)  # sorted in a fraction of the time
        order = np.argsort(keys, kind="stable")
        cuts = np.append(0, np.flatnonzero(np.diff(keys[order])) + 1)
        firsts = chosen[order[cuts]]
        routes = [groups[number].route for number in (kinds[firsts] >> 5).tolist()]
        said = [
            one_line(decoded_text(route(one.at_us, one.frame)))
            for route, one in zip(routes, records(select(frames, rows[firsts])), strict=True)
        ]
        which = np.repeat(np.arange(len(cuts)), np.diff(cuts, append=len(order)))
        told = np.array([*map(bool, said)])[which]
        if told.any():
            found = slice(None) if told.all() else told
            written = cells.of_texts(said)[which[found]]
            texts.put(places[rows[chosen[order[found]]]], written)


class _Lessons:
    """The frames of a bus that can change what a CAN-ID or an object means.

    Args:
        bus: decodes the frames.
        frames: frames of the bus.
        begin: the row from which on they are wanted.

    Attributes:
        version: that of the bus then.
    """

    def __init__(self, bus: BusDecoder, frames: Columns, begin: int) -> None:
        self.version = bus.version
        self._bus, self._idents = bus, frames.ident & np.uint32(STANDARD_MAX)
        self._speakers: dict[int, SdoChannel] = {}
        answers, boots = list[Ints](), list[Ints]()
        for number, found in _groups(self._idents[begin:]):
            rows = found + begin
            if speaker := bus.sdo(number):
                channel, asks = self._speakers[number], _ = speaker
                if not asks:
                    answers.append(teachers(frames, rows, bus.memory(channel.node)))
            elif (node := bus.error_control(number)) is not None:
                boot = (frames.payload[rows] == 0) & (frames.dlc[rows] == 1)
                boot &= frames.ident[rows] & np.uint32(REMOTE) == 0
                boots.append(rows[boot] << 7 | node)
        self._answers = np.sort(np.concatenate(answers)) if answers else np.empty(0, np.int64)
        self._boots = np.sort(np.concatenate(boots)) if boots else np.empty(0, np.int64)

    def next(self, begin: int) -> int:
        """Return the next row whose frame can change the meaning of a CAN-ID or an object.

        If there is no such row, return the number of frames.

        Args:
            begin: row at which the search starts.
        """
        end = len(self._idents)
        found = np.searchsorted(self._answers, begin)
        if found < len(self._answers):
            end = int(self._answers[found])
        for boot in self._boots[np.searchsorted(self._boots, begin << 7) :].tolist():
            if boot >> 7 >= end:
                break
            if self._bus.memory(boot & 0x7F).boots_otherwise:
                end = boot >> 7
        running = [number for number, channel in self._speakers.items() if self._learns(channel)]
        if running:
            rows = np.flatnonzero(np.isin(self._idents[begin:end], running))
            if len(rows):
                end = begin + int(rows[0])
        return end

    def _learns(self, channel: SdoChannel) -> bool:
        entry, memory = channel.runs(), self._bus.memory(channel.node)
        return entry is not None and teaches(entry, memory)


def _alike(numbers: Ints) -> list[Ints]:
    """Return the rows of each value of some small numbers."""
    present = np.flatnonzero(np.bincount(numbers)).tolist()
    if len(present) == 1:
        return [np.arange(len(numbers))]
    return [np.flatnonzero(numbers == number) for number in present]


def _text(decoder: Decoder, record: Record) -> str:
    return one_line(decoded_text(decoder.take(record)))


def _groups(numbers: npt.NDArray[np.uint32]) -> list[tuple[int, Ints]]:
    """Return each number, and the rows that have it."""
    if not len(numbers):
        return []
    if numbers.max() < 1 << 16:
        keys = numbers.astype(np.uint16)  # sorted in a fraction of the time
        order = np.argsort(keys, kind="stable")
        cuts = np.flatnonzero(np.diff(keys[order])) + 1
        found = numbers[order[np.append(0, cuts)]]
    else:
        found, places = np.unique(numbers, return_inverse=True)
        small = places.astype(np.uint16) if len(found) < 1 << 16 else places
        order = np.argsort(small, kind="stable")
        cuts = np.searchsorted(places[order], np.arange(1, len(found)))
    return list(zip(found.tolist(), np.split(order, cuts), strict=True))


class _Column(NamedTuple):
    """A signal of many frames.

    Attributes:
        head: name of the signal, and other text before the value.
        write: function that returns the text of the value in each payload.
        unit: unit of the signal, written after the value.
    """

    head: str
    write: Callable[[_Payloads], Sequence[cells.Part]]
    unit: str = ""


def _writer(begin: str, columns: Sequence[_Column], end: str = "") -> _Write:
    """Return a function that writes the signals of frames of one length."""

    def write(texts: cells.Texts, rows: Ints, payloads: _Payloads, lengths: Ints) -> None:
        parts, constant = list[cells.Part](), begin
        for one in columns:
            parts.append(cells.encoded(f"{constant} {one.head}"))
            parts += one.write(payloads)
            constant = one.unit
        if not columns:
            constant = f"{begin} {end}".rstrip()
        elif end:
            constant = f"{constant} {end}"
        texts.put(rows, cells.together(len(rows), [*parts, cells.encoded(constant)]))

    return write


def _blank_end(text: str) -> bool:
    """Return whether a text ends in blanks, which are omitted at the end of a line."""
    return text != text.rstrip()


def _by_length(make: Callable[[int], _Write]) -> _Write:
    """Return a function that writes frames of any length.

    `make` returns a function for one length.
    """
    made: dict[int, _Write] = {}

    def write(texts: cells.Texts, rows: Ints, payloads: _Payloads, lengths: Ints) -> None:
        for found in _alike(lengths):
            length = int(lengths[found[0]])
            write_one = made[length] = made.get(length) or make(length)
            write_one(texts, rows[found], payloads[found], lengths[found])

    return write


class _Bits(NamedTuple):
    """The position of a signal in the payload.

    Attributes:
        shift: number of the lowest bit of the signal.
        length: number of bits of the signal.
        sign: sign bit of the signal, or 0 if the signal has no sign.
        swapped: whether the signal is big-endian.
    """

    shift: int
    length: int
    sign: int = 0
    swapped: bool = False

    def of(self, payloads: _Payloads) -> _Payloads:
        """Return the bits of the signal in each payload."""
        if self.swapped:
            payloads = payloads.byteswap()
        return payloads >> np.uint64(self.shift) & np.uint64((1 << self.length) - 1)

    def signed(self, bits: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """Return the bits as signed numbers. Bits of 2^63 and more become negative numbers."""
        numbers, sign = bits.view(np.int64), self.sign
        return (numbers ^ sign) - sign if 0 < sign < 1 << 63 else numbers

    def number(self, bits: int) -> int:
        """Return the number that the bits of a value represent."""
        return (bits ^ self.sign) - self.sign


def _each_column(head: str, bits: _Bits, write: Callable[[int], str], unit: str = "") -> _Column:
    """Return a signal whose numbers are written one by one.

    Numbers of few bits are written once.
    """

    def text(raw: int) -> str:
        return write(bits.number(raw))

    if bits.length <= _SHORT:
        table = cells.TextTable(bits.length, text)
        return _Column(head, lambda payloads: [table.cells(bits.of(payloads).view(np.int64))], unit)
    return _Column(head, lambda payloads: [cells.of_few(bits.of(payloads), text)], unit)


def _whole_column(
    head: str, bits: _Bits, scale: tuple[int, int], write: Callable[[int], str], unit: str = ""
) -> _Column:
    """Return a signal that is a whole number multiplied by a factor, plus an offset.

    Args:
        head: text before the value, as for a column.
        bits: position of the signal.
        scale: factor and offset.
        write: function that writes one number as text.
        unit: unit of the signal, as for a column.
    """
    times, more = scale
    limit = (cells.WHOLE - abs(more)) // max(1, abs(times))

    def column(payloads: _Payloads) -> Sequence[cells.Part]:
        raw = bits.of(payloads)
        numbers = bits.signed(raw)
        right = _within(numbers, raw, bits, limit)
        if right is None:
            return cells.whole(numbers * times + more if scale != (1, 0) else numbers)
        parts = cells.whole(np.where(right, numbers, 0) * times + more)
        return [_corrected(parts, right, raw, lambda found: write(bits.number(found)))]

    if limit <= 0 or max(abs(times), abs(more)) >= cells.WHOLE:
        return _each_column(head, bits, write, unit)
    return _Column(head, column, unit)


def _scaled_column(
    head: str, bits: _Bits, scale: tuple[float, float], write: Callable[[int], str], unit: str = ""
) -> _Column:
    """Return a signal that is a number with decimals. The arguments are as for a whole number."""
    exact = cells.Scale.of(*scale)
    if exact is None:
        return _each_column(head, bits, write, unit)

    def column(payloads: _Payloads) -> Sequence[cells.Part]:
        raw = bits.of(payloads)
        numbers = bits.signed(raw)
        parts, right = cells.scaled(numbers, exact)
        within = _within(numbers, raw, bits, cells.WHOLE)
        if within is not None:
            right &= within
        if right.all():
            return parts
        return [_corrected(parts, right, raw, lambda found: write(bits.number(found)))]

    return _Column(head, column, unit)


def _within(
    numbers: npt.NDArray[np.int64], raw: _Payloads, bits: _Bits, limit: int
) -> cells.Mask | None:
    """Return which numbers are at most `limit`, or None if all numbers are."""
    if 1 << bits.length <= limit:
        return None
    right = (numbers <= limit) & (numbers >= -limit)
    if not bits.sign:
        right &= raw <= np.uint64(limit)
    return None if right.all() else right


def _corrected(
    parts: Sequence[cells.Part], right: cells.Mask, raw: _Payloads, write: Callable[[int], str]
) -> cells.Cells:
    """Return a text in which incorrect cells are written again."""
    wrong = np.flatnonzero(~right)
    texts = cells.of_texts(map(write, raw[wrong].tolist()))
    rows = cells.widened(cells.together(len(raw), parts), texts.shape[1])
    rows[wrong] = cells.widened(texts, rows.shape[1])
    return rows


# PDOs.


def _pdo_writer(layout: PdoDecoder) -> _Write:
    """Return a function that writes the frames of a PDO."""

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
    """Return a function that writes a signal of a PDO, or None for texts."""
    name, shift, mask, sign, convert, unit, text = field
    if shift >= 8 * MAX_DATA_BYTES or not isinstance(convert(0) if convert else 0, int | float):
        return None

    def write(raw: int) -> str:
        return (text(raw) if text else "") or str(convert(raw) if convert else raw)

    head, unit = one_line(f"{name}="), one_line(unit)
    bits = _Bits(shift, mask.bit_length(), 0 if convert or text else sign)
    if convert or text or bits.length <= _SHORT:
        return _each_column(head, bits, write, unit)
    return _whole_column(head, bits, (1, 0), str, unit)


# Messages of DBC files.

_FLOATS: Final = {16: "<e", 32: "<f", 64: "<d"}
_SAMPLES: Final = 64
_SHORT: Final = 16
"""Numbers of at most this many bits repeat, so each text is cached."""


def _message_writer(file: DbcFile, can_id: int, extended: bool) -> _Write:
    """Return a function that writes the frames of a message.

    The function first writes some random payloads. The function is used only if it writes these
    payloads as cantools does, which supports more kinds of overlapping and odd signals.
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
        rows, both = np.arange(len(samples)), (cells.Texts(len(samples)), cells.Texts(len(samples)))
        for put, texts in zip((write, single), both, strict=True):
            put(texts, rows, samples, np.full(len(samples), length))
        ours, theirs = (texts.lines(slice(None)) for texts in both)
        return write if ours == theirs else single

    return _by_length(make)


def _message_columns(message: DbcMessage, length: int) -> list[_Column] | None:
    """Return the signals in data of this length, or None if cantools must find them."""
    if message.is_multiplexed() or message.is_container or message.length > MAX_DATA_BYTES:
        return None
    columns = []
    for signal in message.signals:
        swapped = signal.byte_order == "big_endian"
        start = signal.start ^ 7 if swapped else signal.start  # from the first bit on the bus
        if start + signal.length > 8 * min(length, message.length):
            continue
        found = _signal_column(signal, start, swapped)
        if found is None:
            return None
        columns.append(found)
    return columns


def _signal_column(signal: SignalOfDbc, start: int, swapped: bool) -> _Column | None:
    """Return a function that writes a signal, or None if cantools must write it."""
    choices: Mapping[int, object] = signal.choices or {}
    unit, floats = signal.unit or "", signal.is_float
    blank = any(map(_blank_end, (unit, *map(str, choices.values()))))
    if blank or (floats and (choices or signal.length not in _FLOATS)):
        return None
    shift = 8 * MAX_DATA_BYTES - start - signal.length if swapped else start
    sign = 1 << signal.length - 1 if signal.is_signed and not floats else 0
    bits, head = _Bits(shift, signal.length, sign, swapped), one_line(f"{signal.name}=")
    if choices or floats or signal.length <= _SHORT:
        return _each_column(head, bits, partial(_scaled, signal))
    conversion, unit = signal.conversion, one_line(unit)
    scale = conversion.scale, conversion.offset

    def write(raw: int) -> str:
        return str(conversion.raw_to_scaled(raw))

    if all(map(float.is_integer, map(float, scale))):
        return _whole_column(head, bits, (int(scale[0]), int(scale[1])), write, unit)
    return _scaled_column(head, bits, scale, write, unit)


def _scaled(signal: SignalOfDbc, raw: int) -> str:
    """Write a signal with its unit, scaled as cantools scales it."""
    number: int | float = raw
    if signal.is_float:
        (number,) = unpack(_FLOATS[signal.length], raw.to_bytes(signal.length // 8, "little"))
    value = signal.conversion.raw_to_scaled(number)
    found = signal_of(signal.name, value, signal.unit or "")
    return one_line(f"{found.text or str(found.value)}{found.unit}")


_MASKS: Final = np.array([(1 << 8 * count) - 1 for count in range(9)], np.uint64)
"""Masks for the first bytes of a word."""


def _single(decode: Callable[[bytes], Decoded], length: int) -> _Write:
    """Return a function that decodes frames of one length one by one."""

    def write(texts: cells.Texts, rows: Ints, payloads: _Payloads, lengths: Ints) -> None:
        for row, payload in zip(rows.tolist(), payloads.tolist(), strict=True):
            data = payload.to_bytes(MAX_DATA_BYTES, "little")[:length]
            texts.put_one(row, one_line(decoded_text(decode(data))))

    return write


# The meanings of frames in columns, the same as frame by frame; needs numpy.


# The node board of a log in blocks: only frames that can change it are decoded; needs numpy.

_PIECE: Final = 1 << 10
"""Number of frames that are handled in Python at once."""


class ColumnNodes:
    """Updates a node board from blocks of frames, with numpy, for `canmon nodes`.

    After the last block, the board has the same state as if the frames had been processed one by
    one. The only exception is `NodeStatus.pdos`, which `canmon nodes` does not show: some PDOs are
    missing there.

    Args:
        decoder: decoder for single frames. Its attribute `standard` must be True.
        board: node board to update. No other code may update it.
    """

    def __init__(self, decoder: Decoder, board: NodeBoard) -> None:
        self._decoder, self._board, self._begun = decoder, board, False

    def take(self, columns: Columns) -> None:
        """Process a block of frames."""
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
        for row, record in one_by_one(frames, that_matter(bus, frames).rows):
            self._board.take(record, self._decoder.take(record))
            if bus.changes != before:
                self._feed(frames, np.arange(row + 1, len(frames)))
                return

    def _feed(self, frames: Columns, rows: Ints) -> None:
        """Process frames regardless of their meaning."""
        for _, record in one_by_one(frames, rows):
            self._board.take(record, self._decoder.take(record))


def one_by_one(frames: Columns, rows: Ints) -> Iterator[tuple[int, Record]]:
    """Yield the frames of some rows as records, each with its row."""
    for begin in range(0, len(rows), _PIECE):
        piece = rows[begin : begin + _PIECE]
        yield from zip(piece.tolist(), records(select(frames, piece)), strict=True)


class Exchanges(NamedTuple):
    """Pairs of an expedited SDO request and its answer. They add no knowledge about the node.

    Such pairs occur, for example, when a master polls one object repeatedly. Successive pairs with
    one node form a series. Only the first and the last pair of a series must be decoded.

    Attributes:
        requests: rows of the requests.
        answers: rows of the answers, in the same order.
        inner: mask with one value for each pair. The value is True if the pair is neither the first
            nor the last of its series. Such a pair need not be decoded.
    """

    requests: Ints
    answers: Ints
    inner: npt.NDArray[np.bool_]


_UPLOADS: Final = 1
_DOWNLOADS: Final = 2


def _commands(*commands: tuple[int, Iterable[int]]) -> npt.NDArray[np.uint8]:
    table = np.zeros(256, np.uint8)
    for kind, codes in commands:
        table[list(codes)] = kind
    return table


_SIZES: Final = (0x02, 0x03, 0x07, 0x0B, 0x0F)
"""Low bits of an expedited initiate, for no size, or for 4 to 1 bytes."""
_REQUESTS: Final = _commands((_UPLOADS, [0x40]), (_DOWNLOADS, [0x20 | one for one in _SIZES]))
_ANSWERS: Final = _commands((_UPLOADS, [0x40 | one for one in _SIZES]), (_DOWNLOADS, [0x60]))
_BLOCK_COMMANDS: Final = (0xA0, 0xC0)
_SPECIFIER: Final = 0xE0
_WHOLE: Final = 8
_COMMUNICATION: Final = 0x1
"""First digit of the index of objects from which the decoder learns."""
_STATUSWORD: Final = 0x6041
"""Index and sub-index, in the order of the frame."""


def exchanges(
    ident: npt.NDArray[Any],
    dlc: npt.NDArray[np.uint8],
    payload: npt.NDArray[np.uint64],
    blocks: npt.NDArray[np.bool_],
) -> Exchanges:
    """Find the pairs of an SDO request and its answer that can be counted instead of decoded.

    Most SDO frames of a log come from a client that polls a node. In a series of such pairs, only
    the first and the last must be decoded.

    Some pairs are never left out: reads of the objects 1000h to 1FFFh, a statusword that differs
    from the previous one, and all pairs of a node with block transfers, because the segments of a
    block may contain any data.

    Args:
        ident: CAN-IDs with flags. All frames must be SDO frames of the pre-defined connection set.
        dlc: number of data bytes of each frame.
        payload: data of each frame as a little-endian number.
        blocks: whether a node uses block transfers, indexed by node-ID, as `block_nodes` returns
            it.
    """
    nodes = (ident & 0x7F).astype(np.uint8)
    order = np.argsort(nodes, kind="stable")
    nodes, words = nodes[order], payload[order]
    commands, entries = (words & np.uint64(0xFF)).astype(np.uint8), words >> np.uint64(8)
    entries = (entries & np.uint64(0xFF_FFFF)).astype(np.uint32)
    whole = (dlc[order] == _WHOLE) & (ident[order] & REMOTE == 0)
    asks = ident[order] & 0x780 == REQUEST_COB_ID
    asked = np.where(whole & asks & ~blocks[nodes], _REQUESTS[commands], 0)
    answered = np.where(whole & ~asks, _ANSWERS[commands], 0)
    begins = np.flatnonzero(
        (asked[:-1] != 0)
        & (asked[:-1] == answered[1:])
        & (nodes[:-1] == nodes[1:])
        & (entries[:-1] == entries[1:])
    )
    follows = np.diff(begins, prepend=-2) == 2
    follows[1:] &= nodes[begins[1:]] == nodes[begins[:-1]]
    follows[:1] = False
    inner = follows & np.append(follows[1:], False)
    told = entries[begins] & np.uint32(0xF000) != _COMMUNICATION << 12
    states = np.flatnonzero(entries[begins] == _STATUSWORD)
    runs, rows = np.cumsum(~follows)[states], begins[states]
    told[states] = False
    told[states[1:]] = (
        (runs[1:] == runs[:-1])
        & (words[rows[1:]] == words[rows[:-1]])
        & (words[rows[1:] + 1] == words[rows[:-1] + 1])
    )
    begins = begins[told]
    return Exchanges(order[begins], order[begins + 1], inner[told])


def block_nodes(ident: npt.NDArray[Any], payload: npt.NDArray[np.uint64]) -> npt.NDArray[np.bool_]:
    """Return for each node-ID whether the SDO frames request a block transfer."""
    blocks = np.zeros(0x80, np.bool_)
    asks = np.isin(payload & np.uint64(_SPECIFIER), _BLOCK_COMMANDS)
    blocks[ident[asks & (ident & 0x780 == REQUEST_COB_ID)] & 0x7F] = True
    return blocks


def of_sdo(ident: npt.NDArray[Any]) -> Ints:
    """Return the rows of SDO frames of the pre-defined connection set, with 11-bit identifiers."""
    low = ident ^ ident & REMOTE
    return np.flatnonzero(((low > 0x580) & (low < 0x600)) | ((low > 0x600) & (low < 0x680)))


class Matter(NamedTuple):
    """Rows of the frames in a block that must be decoded one by one.

    A block consists of many frames. Each frame is a row of the block.

    Attributes:
        rows: rows of the frames that can change what is known about nodes or CAN-IDs.
        settling: rows of those frames that can change the meaning of a CAN-ID, such as SDO frames
            and boot-ups. All these rows are also in `rows`.
    """

    rows: Ints
    settling: Ints


def that_matter(bus: BusDecoder, frames: Columns, but: Ints | None = None) -> Matter:
    """Find the frames of a block that can change what is known about nodes or CAN-IDs.

    Only these frames must be decoded one by one. All others can be processed together.

    Args:
        bus: decoder for single frames of this bus, which contains what is known so far.
        frames: block of frames of one bus.
        but: rows to leave out, because the caller knows that their frames add no knowledge. None
            leaves out no rows.
    """
    can_ids = (frames.ident & STANDARD_MAX).astype(np.int64)
    can_ids[frames.ident & (EXTENDED | ERROR) != 0] = STANDARD_MAX + 1
    effects = np.zeros(STANDARD_MAX + 2, np.uint8)
    for can_id in np.flatnonzero(np.bincount(can_ids)[: STANDARD_MAX + 1]).tolist():
        effects[can_id] = bus.effect(can_id)
    found = effects[can_ids]
    if but is not None:
        found[but] = Effect.NONE
    each = np.flatnonzero(found >= Effect.ALONE)
    latest = np.flatnonzero(found == Effect.LATEST)
    low = frames.payload[each] & np.uint64(0xFF)
    settling = each[(found[each] == Effect.EACH) | (low == 0)]
    if not len(latest):
        return Matter(each, settling)
    between = np.searchsorted(settling, latest)
    kinds = can_ids[latest] << 5 | (frames.ident[latest] & REMOTE != 0) << 4 | frames.dlc[latest]
    _, last = np.unique((between << 16 | kinds)[::-1], return_index=True)
    return Matter(np.sort(np.concatenate((each, latest[::-1][last]))), settling)
