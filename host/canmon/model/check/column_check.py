"""Check of rules against a log in blocks. Only frames that can break a rule are examined.

The module needs numpy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import starmap
from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.check.checker import RuleCheck, Unjudged
from tickrig.host.canmon.model.check.rule import (
    NO_GAP_US,
    FrameSelection,
    Rule,
    Seen,
    TrafficFinding,
)
from tickrig.host.canmon.model.check.rules import NO_EDS, EdsHeartbeats, Rules
from tickrig.host.canmon.model.columns.column_traffic import column_bits
from tickrig.host.canmon.model.columns.columns import (
    ColumnLoad,
    Columns,
    Identifiers,
    Ints,
    Runs,
    by_channel,
    grown,
    records,
    select,
)
from tickrig.host.canmon.model.frames import ERROR

_Flags = npt.NDArray[np.bool_]

_NEVER_US: Final = np.iinfo(np.int64).max

_Placed = tuple[int, int, TrafficFinding]
"""A finding with its row, and its place among findings of the row, in the order of `Checker`."""


class ColumnChecker(RuleCheck):
    """Checker that judges frames by rules, one block of frames at a time, with numpy.

    It returns the same findings as `Checker`, which judges frames one by one, but is faster. The
    memory that it needs grows with the number of CAN-IDs, not with the number of frames.

    Args:
        rules: rules to check. Rules that are expressions are not supported.
        bit_rate: bit rate in bits per second, from which the bus load is calculated. If it is None,
            the bit rate in `rules` is used.
        eds_heartbeats: producer heartbeat times (1017h) from EDS files, in ms, by node-ID.

    Raises:
        ValueError: the rules limit the bus load, but the bit rate is unknown.
    """

    def __init__(
        self, rules: Rules, bit_rate: int | None = None, eds_heartbeats: EdsHeartbeats = NO_EDS
    ) -> None:
        super().__init__(rules, bit_rate, eds_heartbeats)
        self._wanting: dict[int, list[tuple[int, Rule]]] = {}
        self._selections: dict[str, _BusSelection] = {}
        self._loads: dict[str, ColumnLoad] = {}
        self._last_us = 0

    def take(self, columns: Columns) -> list[TrafficFinding]:
        """Check a block of frames, and the seconds that it completed. Return the violations."""
        if len(columns) and not self._begun:
            self._begin(int(columns.at_us[0]))
        placed: list[_Placed] = []
        found, gaps_us = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
        for channel, rows, frames in by_channel(columns):
            if self._load is not None:
                placed += self._too_busy(channel, rows, frames)
            selection = self._selections.setdefault(channel, _BusSelection(self._made))
            places, gaps = selection.take(frames)
            found.append(rows[places])
            gaps_us.append(gaps)
            self._last_us = int(columns.at_us[-1])
        placed += self._judged(columns, np.concatenate(found), np.concatenate(gaps_us))
        # Row, then place among the rules (0 is the load): the order in which `Checker`
        # finds them.
        placed.sort(key=lambda one: one[:2])
        return [finding for _, _, finding in placed]

    def end(self, lost: Iterable[str] = (), errors: Iterable[str] = ()) -> list[TrafficFinding]:
        """Return the findings that are known only at the end, such as frames that never arrived.

        Args:
            lost: messages of the source about lost frames, and about lines of a log that are not
                frames.
            errors: messages of the source about bus errors that it did not report as error frames.
        """
        loads = {channel: seconds.load for channel, seconds in self._loads.items()}
        return self._ended(loads, self._last_us, lost, errors)

    def unjudged(self, without_errors: str = "") -> Unjudged:
        """Return the rules that were not judged; see `Checker.unjudged`."""
        return self._unjudged(self._last_us, without_errors)

    def _evidence(self) -> Mapping[tuple[str, int], Seen]:
        return {
            (channel, ident): one
            for channel, selection in self._selections.items()
            for ident, one in selection.seen()
        }

    def _too_busy(self, channel: str, rows: Ints, frames: Columns) -> Iterable[_Placed]:
        if channel not in self._loads:
            self._loads[channel] = ColumnLoad(int(frames.at_us[0]))
        plain = np.flatnonzero(frames.ident & ERROR == 0)
        bits = column_bits(frames.ident[plain], frames.dlc[plain], frames.payload[plain])
        for window, row in self._loads[channel].take(frames.at_us[plain], bits):
            for finding in self.judge_window(channel, window):
                yield int(rows[plain[row]]), 0, finding

    def _judged(self, columns: Columns, rows: Ints, gaps_us: Ints) -> Iterable[_Placed]:
        """Apply the rules to selected frames, in the order of the log."""
        order = np.argsort(rows, kind="stable")
        rows, selected = rows[order], select(columns, rows[order])
        idents = np.where(selected.ident & ERROR, ERROR, selected.ident)
        seen = zip(
            rows.tolist(), idents.tolist(), gaps_us[order].tolist(), records(selected), strict=True
        )
        for row, ident, gap_us, record in seen:
            wanting = self._wanting.get(ident)
            if wanting is None:
                made = enumerate(self._made, 1)
                wanting = [(place, rule) for place, rule in made if rule.wants(ident)]
                self._wanting[ident] = wanting
            for place, rule in wanting:
                text = rule.judge(record, None if gap_us == NO_GAP_US else gap_us)
                if text:
                    yield row, place, TrafficFinding(record.at_us, rule.name, text, record)


class _BusSelection:
    """Selection of the frames of a bus that rules must see, by gaps, first bytes and positions.

    Args:
        rules: rules that see the frames. Frames that are not selected cannot change their findings.
    """

    def __init__(self, rules: Sequence[Rule]) -> None:
        self._rules, self._errors = rules, any(rule.wants(ERROR) for rule in rules)
        self._idents = Identifiers()
        self._below_us, self._above_us = np.empty(0, np.int64), np.empty(0, np.int64)
        self._all, self._firsts = np.empty(0, np.bool_), np.empty(0, np.bool_)
        self._bytes = np.empty((0, 256), np.bool_)
        self._frames = np.empty(0, np.int64)

    def take(self, frames: Columns) -> tuple[Ints, Ints]:
        """Return the rows of the frames that must be judged, and the time gap before each of them.

        The caller must judge these frames. All other frames can neither violate a rule nor change
        the state of a rule, so this method only counts them.

        Args:
            frames: block of frames of one bus.
        """
        errors = frames.ident & ERROR != 0
        plain = np.flatnonzero(~errors)
        found = np.flatnonzero(errors) if self._errors else plain[:0]
        if not len(plain):
            return found, np.full(len(found), NO_GAP_US)
        runs = self._idents.take(frames.ident[plain], frames.at_us[plain])
        self._extend(len(self._idents))
        self._frames[runs.numbers] += runs.lengths
        places = np.flatnonzero(self._selected(runs, frames.payload[plain]))
        gaps_us = runs.gaps_us
        gaps_us[runs.begins[runs.fresh]] = NO_GAP_US
        rows = np.concatenate((found, plain[runs.order[places]]))
        return rows, np.concatenate((np.full(len(found), NO_GAP_US), gaps_us[places]))

    def seen(self) -> Iterable[tuple[int, Seen]]:
        """Return the identifiers with the first and last time of their frames."""
        idents = self._idents
        values = zip(
            idents.first_us.tolist(), idents.last_us.tolist(), self._frames.tolist(), strict=True
        )
        return zip(idents.idents.tolist(), starmap(Seen, values), strict=True)

    def _extend(self, count: int) -> None:
        """Ask the rules for their selections of new identifiers.

        `count` is the new number of identifiers.
        """
        before = len(self._all)
        self._below_us, self._above_us = grown(self._below_us, count), grown(self._above_us, count)
        self._all, self._firsts = grown(self._all, count), grown(self._firsts, count)
        self._bytes, self._frames = grown(self._bytes, count), grown(self._frames, count)
        self._above_us[before:] = _NEVER_US
        for number in range(before, count):
            ident = int(self._idents.idents[number])
            for rule in self._rules:
                if rule.wants(ident):
                    self._add(number, rule.selection(ident))

    def _add(self, number: int, selection: FrameSelection) -> None:
        below_us, above_us, first_bytes, firsts = selection
        # A selection without attributes selects all frames.
        self._all[number] |= selection == FrameSelection()
        self._firsts[number] |= firsts
        self._bytes[number, sorted(first_bytes)] = True
        if below_us is not None:
            # The union of the selections of several rules. Each rule still judges by itself.
            self._below_us[number] = max(self._below_us[number], below_us)
        if above_us is not None:
            self._above_us[number] = min(self._above_us[number], above_us)

    def _selected(self, runs: Runs, payload: npt.NDArray[np.uint64]) -> _Flags:
        """Return which frames are selected, in the order of the runs."""
        numbers, lengths = runs.numbers, runs.lengths
        selected = np.repeat(self._all[numbers], lengths)
        selected |= runs.gaps_us < np.repeat(self._below_us[numbers], lengths)
        selected |= runs.gaps_us > np.repeat(self._above_us[numbers], lengths)
        selected[runs.begins[runs.fresh & self._firsts[numbers]]] = True
        if self._bytes[numbers].any():
            low = (payload[runs.order] & np.uint64(0xFF)).astype(np.int64)
            selected |= self._bytes[np.repeat(numbers, lengths), low]
        return selected
