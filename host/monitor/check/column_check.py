"""Rules against a whole log at once: only frames that can break one are looked at; needs numpy."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import zip_longest

import numpy as np

from tickrig.host.monitor.check.checker import ended
from tickrig.host.monitor.check.finding import Finding
from tickrig.host.monitor.check.rules import Rules
from tickrig.host.monitor.check.sorted_log import SortedLog
from tickrig.host.monitor.columns.column_bits import column_bits
from tickrig.host.monitor.columns.column_traffic import windows_of
from tickrig.host.monitor.columns.columns import Columns
from tickrig.host.monitor.columns.runs import Ints
from tickrig.host.monitor.frames.ident import ERROR

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
