"""Survey of a log in blocks. Only frames that change the survey are decoded one by one.

The module needs numpy.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns.column_meanings import (
    Exchanges,
    block_nodes,
    exchanges,
    of_sdo,
    that_matter,
)
from tickrig.host.canmon.model.columns.column_traffic import column_bits
from tickrig.host.canmon.model.columns.columns import (
    Columns,
    Ints,
    by_channel,
    record_at,
    records,
    select,
)
from tickrig.host.canmon.model.decode.dbc_file import DbcFile
from tickrig.host.canmon.model.decode.decoder import BusDecoder, Decoder
from tickrig.host.canmon.model.decode.node_board import STATUSWORD_NAME
from tickrig.host.canmon.model.decode.node_memory import NodeMemory, drive_state
from tickrig.host.canmon.model.decode.pdos import Field, PdoDecoder
from tickrig.host.canmon.model.frames import ERROR, EXTENDED, Record
from tickrig.host.canmon.model.survey import SignalName, Survey, TimeBins
from tickrig.wire.can import EXTENDED_MAX, MAX_DATA_BYTES, STANDARD_MAX

# What a CAN-ID means can change in the middle of a block. `ColumnSurvey` notes the PDOs before
# it decodes the frames that can do this, and takes values up to the frame that did: they mean
# what was known when they came, as frame by frame. Behind it some frames are taken one by one,
# since changes come in groups, and the rest as a block again.

_SETTLED: Final = 256
_PIECE: Final = 1 << 10
_NO_ROW: Final = -1
_NODE: Final = 0x7F
_WRITTEN: Final = 0x60
"""Command byte of the answer to a download."""
_DRIVE_STATES: Final = tuple(drive_state(bits) or "?" for bits in range(0x80))
_Values = npt.NDArray[np.float64]


class ColumnSurvey:
    """Updates a survey from blocks of frames, with numpy, for `canmon report` and `canmon graph`.

    Args:
        decoder: decoder for single frames that the survey uses. Its attribute `first` is a list of
            decoders that are tried before all others. This list may contain only decoders of the
            type `DbcFile`.
        survey: survey to update. No other code may update it.
    """

    def __init__(self, decoder: Decoder, survey: Survey) -> None:
        self._decoder, self._survey = decoder, survey
        self._files = [one for one in decoder.first if isinstance(one, DbcFile)]
        self._named: dict[int, bool] = {}
        self._begun = False
        self._blocks: dict[str, npt.NDArray[np.bool_]] = {}

    def take(self, columns: Columns) -> None:
        """Process a block of frames."""
        if not len(columns):
            return
        survey = self._survey
        survey.begin(int(columns.at_us[0]))
        survey.last_us = max(survey.last_us, int(columns.at_us.max()))
        for channel, _, frames in by_channel(columns):
            self._count(channel, frames)
            rows = of_sdo(frames.ident)
            blocks = block_nodes(frames.ident[rows], frames.payload[rows])
            self._blocks[channel] = blocks | self._blocks.get(channel, False)
        if not self._begun:  # nodes with an EDS are on the bus of the very first frame
            self._begun = True
            self._each(records(select(columns, np.arange(1))))
            columns = select(columns, np.arange(1, len(columns)))
        for channel, _, frames in by_channel(self._unnamed(columns)) if len(columns) else ():
            self._take_bus(channel, self._decoder.bus(channel), frames)
        survey.now_us = max(survey.now_us, survey.last_us)

    def _since(self, frames: Columns) -> Ints:
        return np.maximum(frames.at_us - (self._survey.first_us or 0), 0)

    def _count(self, channel: str, frames: Columns) -> None:
        survey, since_us = self._survey, self._since(frames)
        survey.frames[channel] = survey.frames.get(channel, 0) + len(frames)
        survey.reach(int(since_us.max()))
        errors = frames.ident & np.uint32(ERROR) != 0
        _add(survey.errors, channel, since_us[errors], np.ones(int(errors.sum()), np.int64))
        if errors.any():
            rows = np.flatnonzero(~errors)
            frames, since_us = select(frames, rows), since_us[rows]
        bits = column_bits(frames.ident, frames.dlc, frames.payload)
        _add(survey.bits, channel, since_us, bits)
        places = since_us // survey.counts.width_us
        kinds = frames.ident.astype(np.uint64) << np.uint64(16) | places.astype(np.uint64)
        found, counts = np.unique(kinds, return_counts=True)
        for kind, count in zip(found.tolist(), counts.tolist(), strict=True):
            survey.counts.add_at((channel, kind >> 16), kind & 0xFFFF, count)

    def _unnamed(self, columns: Columns) -> Columns:
        """Process frames that DBC files name, frame by frame.

        Return the other frames except error frames.
        """
        plain = columns.ident & np.uint32(ERROR) == 0
        named = np.zeros(len(columns), np.bool_)
        for ident in np.unique(columns.ident[plain]).tolist() if self._files else ():
            if self._is_named(ident):
                named |= columns.ident == ident
        if named.any():
            self._each(records(select(columns, np.flatnonzero(named & plain))))
        left = plain & ~named & (columns.ident & np.uint32(EXTENDED) == 0)
        return columns if left.all() else select(columns, np.flatnonzero(left))

    def _is_named(self, ident: int) -> bool:
        if ident not in self._named:
            can_id, extended = ident & EXTENDED_MAX, bool(ident & EXTENDED)
            self._named[ident] = any(file.names(can_id, extended) for file in self._files)
        return self._named[ident]

    def _each(self, frames: Iterable[Record]) -> None:
        for record in frames:
            decoded = self._decoder.take(record)
            self._survey.take(record, decoded)
            self._survey.take_signals(record, decoded)

    def _take_bus(self, channel: str, bus: BusDecoder, frames: Columns) -> None:
        while len(frames):
            layouts, before, end = _layouts(bus, frames), bus.changes, len(frames)
            for row in self._matter(channel, bus, frames):
                if bus.changes != before:
                    end = row + 1
                    break
            self._take_values(channel, layouts, select(frames, np.arange(end)))
            each = np.arange(end, min(end + _SETTLED, len(frames)))
            self._each(records(select(frames, each)))
            frames = select(frames, np.arange(end + len(each), len(frames)))

    def _matter(self, channel: str, bus: BusDecoder, frames: Columns) -> Iterator[int]:
        """Process the frames that change anything. Yield the row of each such frame."""
        polls = self._polls(channel, bus, frames)
        asked, kept = np.full(len(frames), _NO_ROW), np.zeros(len(frames), np.bool_)
        quiet = np.concatenate((polls.requests, polls.answers))
        matter = that_matter(bus, frames, quiet)
        # A frame that changes what a CAN-ID means ends this pass: never inside an exchange.
        before, behind = (np.searchsorted(matter.settling, one) for one in polls[:2])
        alone = polls.inner & (before == behind)
        asked[polls.answers[alone]] = polls.requests[alone]
        kept[matter.rows] = kept[quiet] = True
        kept[polls.requests[alone]] = False
        rows, states = np.flatnonzero(kept), dict[tuple[int, int], bool]()
        for begin in range(0, len(rows), _PIECE):
            piece = rows[begin : begin + _PIECE]
            requests, idents, words = asked[piece], frames.ident[piece], frames.payload[piece]
            singles = iter(records(select(frames, piece[requests == _NO_ROW])))
            parts = (piece, requests, idents, words)
            for row, request, ident, word in zip(*(one.tolist() for one in parts), strict=True):
                if request == _NO_ROW:
                    self._survey.take(record := next(singles), self._decoder.take(record))
                elif not self._counts(channel, bus.memory(ident & _NODE), ident, word, states):
                    for place in (request, row):
                        record = record_at(frames, place)
                        self._survey.take(record, self._decoder.take(record))
                yield row

    def _polls(self, channel: str, bus: BusDecoder, frames: Columns) -> Exchanges:
        """Return the SDO exchanges that add no knowledge."""
        rows = of_sdo(frames.ident[: 0 if bus.sdo_moved else len(frames)])
        parts = frames.ident[rows], frames.dlc[rows], frames.payload[rows]
        found = exchanges(*parts, self._blocks[channel])
        return Exchanges(rows[found.requests], rows[found.answers], found.inner)

    def _counts(
        self,
        channel: str,
        memory: NodeMemory,
        ident: int,
        answer: int,
        states: dict[tuple[int, int], bool],
    ) -> bool:
        """Count an exchange by its answer.

        Return False if the exchange must be read frame by frame.

        `states` stores which objects are statuswords. The node board shows the state in them.
        """
        survey, node, entry = self._survey, ident & _NODE, answer >> 8 & 0xFF_FFFF
        is_state = states.get((node, entry))
        if is_state is None:
            text = memory.describe(entry & 0xFFFF, entry >> 16)
            is_state = states[node, entry] = text.name == STATUSWORD_NAME
        if is_state:
            row = survey.row(channel, node)
            written = answer & 0xFF == _WRITTEN
            if written or row is None or row.drive_state != drive_state(answer >> 32):
                return False
        return survey.lanes[channel, node].transfers.pass_over()

    def _take_values(
        self, channel: str, layouts: Mapping[int, PdoDecoder], frames: Columns
    ) -> None:
        since_us = self._since(frames)
        for can_id, layout in layouts.items():
            rows = np.flatnonzero((frames.ident == can_id) & (frames.dlc >= layout.size))
            if not len(rows):
                continue
            times_us, payloads = since_us[rows], frames.payload[rows]
            for one in layout.fields:
                name = SignalName(channel, layout.node, layout.kind, one.name)
                self._take_field(name, one, layout.source, times_us, payloads)

    def _take_field(
        self,
        name: SignalName,
        one: Field,
        source: str,
        times_us: Ints,
        payloads: npt.NDArray[np.uint64],
    ) -> None:
        if one.shift >= 8 * MAX_DATA_BYTES:
            return
        values = _values(one, payloads)
        if values is None or not len(values):
            return
        finite = np.isfinite(values)
        if not finite.all():
            values, times_us = values[finite], times_us[finite]
        track = self._survey.track(name, one.unit, source) if len(values) else None
        if track is None:
            return
        track.take(len(values), float(values.min()), float(values.max()))
        if track.states is not None:
            states = values.astype(np.int64) & 0x7F
            changes = np.flatnonzero(np.diff(states, prepend=-1))
            for at_us, state in zip(
                times_us[changes].tolist(), states[changes].tolist(), strict=True
            ):
                track.states.take(at_us, _DRIVE_STATES[state])
            return
        bins = self._survey.values
        places = times_us // bins.width_us
        begins = np.flatnonzero(np.diff(places, prepend=-1))
        lows, highs = (
            function.reduceat(values, begins).tolist() for function in (np.minimum, np.maximum)
        )
        for place, low, high in zip(places[begins].tolist(), lows, highs, strict=True):
            bins.spread_at(name, place, low, high)


def _layouts(bus: BusDecoder, frames: Columns) -> dict[int, PdoDecoder]:
    """Return the PDOs among the CAN-IDs of frames, with their current mapping."""
    can_ids = np.flatnonzero(np.bincount((frames.ident & np.uint32(STANDARD_MAX)).astype(np.int64)))
    layouts = ((can_id, bus.layout(can_id)) for can_id in can_ids.tolist())
    return {can_id: layout for can_id, layout in layouts if layout and layout.fields}


def _values(one: Field, payloads: npt.NDArray[np.uint64]) -> _Values | None:
    """Return the numbers of a field in many payloads, or None for texts."""
    raw = payloads >> np.uint64(one.shift) & np.uint64(one.mask & (1 << 64) - 1)
    if one.convert is None:
        if not one.sign:
            return raw.astype(np.float64)
        sign = np.uint64(one.sign)
        return ((raw ^ sign) - sign).view(np.int64).astype(np.float64)
    found, places = np.unique(raw, return_inverse=True)
    numbers: Sequence[Any] = [one.convert(number) for number in found.tolist()]
    if not all(isinstance(number, int | float) for number in numbers):
        return None
    values: _Values = np.array(numbers, np.float64)[places]
    return values


def _add(bins: TimeBins[str], key: str, since_us: Ints, amounts: Ints) -> None:
    """Add amounts to the spans that contain their times."""
    if not len(since_us):
        return
    places = since_us // bins.width_us
    first = int(places.min())
    sums = np.bincount(places - first, amounts)
    for place in np.flatnonzero(sums).tolist():
        bins.add_at(key, first + place, int(sums[place]))
