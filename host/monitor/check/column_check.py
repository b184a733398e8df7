"""Rules against a whole log at once: only frames that can break one are looked at; needs numpy."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import zip_longest

import numpy as np
import numpy.typing as npt

from tickrig.host.monitor.check.checker import ended
from tickrig.host.monitor.check.rule import NO_GAP_US, Finding, FrameSelection, Rule
from tickrig.host.monitor.check.rules import Rules
from tickrig.host.monitor.columns.column_bits import column_bits
from tickrig.host.monitor.columns.column_traffic import windows_of
from tickrig.host.monitor.columns.columns import Columns, Ints, Runs, records
from tickrig.host.monitor.frames.ident import ERROR


class SortedLog:
    """A log by bus and identifier, with the gap before each frame."""

    def __init__(self, columns: Columns) -> None:
        self._columns = columns
        errors = columns.ident & ERROR != 0
        self._errors = np.flatnonzero(errors)
        self._plain = np.flatnonzero(~errors)
        self._runs: Runs | None = None
        if len(self._plain):
            self._runs = Runs.of(_keys(columns, self._plain))
            self._gaps_us = self._runs.gaps_us(columns.at_us[self._plain])

    def latest_us(self) -> dict[int, int]:
        """Return when each identifier was heard last."""
        latest: dict[int, int] = {}
        for ident, _, end in self._idents():
            at_us = int(self._columns.at_us[self._row(end - 1)])
            latest[ident] = max(at_us, latest.get(ident, at_us))
        return latest

    def judged(self, rule: Rule) -> list[tuple[int, Finding]]:
        """Let a rule see what it suspects; return rows and findings."""
        rows, gaps_us = self._selection(rule)
        found = []
        for row, gap_us, record in zip(
            rows.tolist(), gaps_us.tolist(), records(self._columns, rows), strict=True
        ):
            text = rule.judge(record, None if gap_us == NO_GAP_US else gap_us)
            if text:
                found.append((row, Finding(record.at_us, rule.name, text, record)))
        return found

    def _selection(self, rule: Rule) -> tuple[Ints, Ints]:
        """Return rows and gaps in the order of the log."""
        errors = self._errors if rule.wants(ERROR) else self._errors[:0]
        rows, gaps_us = [errors], [np.full(len(errors), NO_GAP_US)]
        for ident, begin, end in self._idents():
            if rule.wants(ident):
                selected = self._selected(rule.selection(ident), begin, end)
                places = begin + np.flatnonzero(selected)
                rows.append(self._row(places))
                gaps_us.append(np.where(places == begin, NO_GAP_US, self._gaps_us[places]))
        every = np.concatenate(rows)
        order = np.argsort(every, kind="stable")
        return every[order], np.concatenate(gaps_us)[order]

    def _selected(self, selection: FrameSelection, begin: int, end: int) -> npt.NDArray[np.bool_]:
        below_us, above_us, first_bytes, firsts = selection
        if selection == FrameSelection():
            return np.ones(end - begin, np.bool_)
        gaps_us = self._gaps_us[begin:end]
        selected = np.zeros(end - begin, np.bool_)
        selected[0] = firsts
        if below_us is not None:
            selected |= gaps_us < below_us
        if above_us is not None:
            selected |= gaps_us > above_us
        if first_bytes:
            low = self._columns.payload[self._row(slice(begin, end))] & np.uint64(0xFF)
            selected |= np.isin(low, np.array(sorted(first_bytes), np.uint64))
        return selected

    def _idents(self) -> Iterable[tuple[int, int, int]]:
        """Give each identifier with begin and end of its run."""
        if self._runs is not None:
            idents = (self._runs.idents & 0xFFFF_FFFF).tolist()
            yield from zip(
                idents, self._runs.begins.tolist(), self._runs.ends.tolist(), strict=True
            )

    def _row(self, places: Ints | slice | int) -> Ints:
        """Return the rows at places of the runs."""
        assert self._runs is not None
        rows: Ints = self._plain[self._runs.order[places]]
        return rows


def _keys(columns: Columns, rows: Ints) -> npt.NDArray[np.uint32] | npt.NDArray[np.uint64]:
    """Return the identifiers of some rows, with the bus above them where there are several."""
    ident = columns.ident[rows]
    if len(columns.channels) == 1:
        return ident
    return columns.channel[rows].astype(np.uint64) << np.uint64(32) | ident


Placed = tuple[int, int, Finding]
"""A finding with its row, and its place among those of the row: the order of `Checker`."""


def check_columns(
    columns: Columns, rules: Rules, bit_rate: int | None = None, lost: Iterable[str] = ()
) -> list[Finding]:
    """Return all findings, as `Checker` finds them frame by frame.

    Args:
        columns: the log.
        rules: what must hold.
        bit_rate: bits a second, for the load.
        lost: what the source says was lost or is no frame.

    Raises:
        ValueError: a limit of the load without a bit rate.
    """
    made = rules.make()
    placed, at_end = _loads(columns, rules, bit_rate)
    if not len(columns):
        return ended(rules, made, {}, 0, lost)
    log = SortedLog(columns)
    for place, rule in enumerate(made, 1):
        placed += [(row, place, finding) for row, finding in log.judged(rule)]
    placed.sort(key=lambda one: one[:2])
    found = [finding for _, _, finding in placed] + at_end
    return found + ended(rules, made, log.latest_us(), int(columns.at_us[-1]), lost)


def _loads(
    columns: Columns, rules: Rules, bit_rate: int | None
) -> tuple[list[Placed], list[Finding]]:
    """Return what is wrong with seconds that a frame ended, and with those still open."""
    limit = rules.load(bit_rate)
    placed: list[Placed] = []
    at_end: list[Finding] = []
    if limit is None:
        return placed, at_end
    for channel, rows in _rows_by_channel(columns):
        first_us, plain = int(columns.at_us[rows[0]]), rows[columns.ident[rows] & ERROR == 0]
        bits = column_bits(columns.ident[plain], columns.dlc[plain], columns.payload[plain])
        windows = windows_of(first_us, columns.at_us[plain], bits)
        ends = [int(plain[begin]) for _, begin in windows[1:]]
        for (window, _), row in zip_longest(windows, ends):
            text = limit.judge(channel, window)
            if text and row is None:
                at_end.append(Finding(window.at_us, limit.name, text))
            elif text:
                placed.append((row, 0, Finding(window.at_us, limit.name, text)))
    return placed, at_end


def _rows_by_channel(columns: Columns) -> list[tuple[str, Ints]]:
    rows = [np.flatnonzero(columns.channel == place) for place in range(len(columns.channels))]
    return sorted(
        (columns.channels[place], found) for place, found in enumerate(rows) if len(found)
    )
