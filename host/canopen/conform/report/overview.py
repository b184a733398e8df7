"""A report by groups and by clauses, and the order in which a report lists checks.

The module also formats the frames of a check as `canmon dump` shows them.

>>> from tickrig.host.canopen.conform.verdict import Direction
>>> lines = FrameLine(1_250, Direction.SENT, "605#40"), FrameLine(2_000, Direction.REMARK, "?")
>>> plain_frames(lines)
[' (000.001250)  >  605   [1]  40', ' (000.002000)  #  ?']
"""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.verdict import (
    CheckOutcome,
    CheckVerdict,
    Direction,
    FrameLine,
    Report,
    Result,
)
from tickrig.host.text.page_text import one_line
from tickrig.wire.can import CanFrame
from tickrig.wire.errors import WireError

# Hints for failed checks: the part of a firmware that has such faults.

_HINTS: Final[Mapping[str, str]] = {
    "NMT": "the table of NMT states: which command leads where, and what it resets",
    "HB": "objects 1016h and 1017h, and the timers behind them",
    "NG": "objects 100Ch and 100Dh, the toggle bit, and the answer to the remote frame",
    "UE": "the upload of the SDO server: its abort codes, and the size that it indicates",
    "DE": "the download of the SDO server: access, size and limits before a value is taken",
    "US": "the segments of an upload: toggle bit, last segment, and when a transfer ends",
    "DS": "the segments of a download: toggle bit, indicated and sent size, immediate refusal",
    "BD": "the block download: sequence numbers, what is acknowledged, CRC, padding",
    "BU": "the block upload: block size, what is sent again, CRC, end of transfer",
    "SG": "what the SDO server does with unknown requests, and while it is busy",
    "PC": "the order of the mapping procedure: PDO off, number 0, entries, number, PDO on",
    "PR": "when a PDO is sent or applied: transmission type, inhibit time, event timer",
    "SY": "object 1005h, and what a SYNC counter does",
    "EM": "objects 1001h, 1003h, 1014h and 1015h, and when an error counts as cleared",
    "EB": "object 1029h, and the state in which an error leaves the node",
    "ST": "objects 1010h and 1011h: their signatures, and what is kept over power-off",
    "LS": "the LSS states, and the identity (1018h) that is compared",
    "IO": "the objects of CiA 401: polarity, filter, interrupts",
    "D4": "the state machine of CiA 402: controlword, statusword, modes",
    "OD": "this object in the EDS, and its row in the object dictionary of the firmware",
}
"""Hints for failures by group."""


def hint(result: Result) -> str:
    """Return a hint that helps to find the cause of a failure.

    If there is no hint for the failure, the result is empty. A hint has no full stop at its end.
    """
    match result.outcome.verdict:
        case CheckVerdict.BLOCKED:
            return "the node: it no longer answers; switch it off and on, then run the check alone"
        case CheckVerdict.INCONCLUSIVE:
            return "this host and the bus: load, adapter, other nodes; then run the check alone"
        case _:
            return _HINTS.get(result.check.group, "")


ShowFrames = Callable[[Sequence[FrameLine]], list[str]]
"""Function that formats the lines of a check."""


_DATA_WIDTH: Final = len("[8]  00 11 22 33 44 55 66 77")


def plain_frames(lines: Sequence[FrameLine]) -> list[str]:
    """Format lines of the evidence, without the meanings of the frames."""
    return [plain_frame(line) for line in lines]


def plain_frame(line: FrameLine, meaning: str = "") -> str:
    """Format one line of the recorded evidence, with its time and direction.

    Args:
        line: frame or remark to format.
        meaning: decoded meaning, appended to a frame. It is empty if the meaning is unknown.
    """
    seconds, micros = divmod(line.at_us, 1_000_000)
    head = f" ({seconds:03}.{micros:06})  {line.direction}  "
    if line.direction is Direction.REMARK or (frame := frame_of(line)) is None:
        return head + one_line(line.text)
    ident = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
    data = f" {frame.data.hex(' ').upper()}" if frame.data else ""
    text = " remote request" if frame.remote else data
    shown = f"[{frame.remote_length if frame.remote else len(frame.data)}] {text}".rstrip()
    behind = f"{shown:<{_DATA_WIDTH}}   {one_line(meaning)}" if meaning else shown
    return f"{head}{ident}   {behind}"


def frame_of(line: FrameLine) -> CanFrame | None:
    """Return the frame of a line, or None for a remark."""
    try:
        return CanFrame.parse(line.text)
    except (ValueError, WireError):
        return None


def cut(lines: list[str], most: int) -> list[str]:
    """Shorten a text to `most` lines: its beginning, the number of omitted lines, and its end.

    >>> cut(["a", "b", "c", "d", "e"], 3)
    ['a', '... 3 more lines ...', 'e']
    """
    if len(lines) <= most:
        return lines
    head, tail = most // 2, most - most // 2 - 1
    left_out = f"... {len(lines) - head - tail} more lines ..."
    return [*lines[:head], left_out, *lines[len(lines) - tail :]]


def all_goes(outcome: CheckOutcome, first: CheckOutcome | None, show: ShowFrames) -> list[str]:
    """Return the evidence of all attempts at a check, as lines of text.

    If a check was repeated and both attempts have the same frames, the frames are shown once.
    """
    if first is None:
        return show(outcome.evidence)
    if same_go(first, outcome):
        return [SAME, *show(outcome.evidence)]
    again = f"first: {first.verdict}" + (f": {one_line(first.reason)}" if first.reason else "")
    return [again, *show(first.evidence), "and again:", *show(outcome.evidence)]


SAME: Final = "first: the same"


def same_go(first: CheckOutcome, again: CheckOutcome) -> bool:
    """Return whether two attempts differ only in their times."""
    one, other = ([line[1:] for line in each.evidence] for each in (first, again))
    return (first.verdict, first.reason, one) == (again.verdict, again.reason, other)


UNWELL: Final = (CheckVerdict.FAIL, CheckVerdict.BLOCKED, CheckVerdict.INCONCLUSIVE)
"""Verdicts that need attention. The worst verdict is first."""


class _GroupRow(NamedTuple):
    """Results of checks that belong together.

    Attributes:
        name: name of the group, or the clause.
        results: results in the order in which the checks were judged.
    """

    name: str
    results: tuple[Result, ...]

    @property
    def counts(self) -> dict[CheckVerdict, int]:
        """Number of results by verdict, without verdicts that do not occur."""
        return verdict_counts(self.results)


def verdict_counts(results: Iterable[Result]) -> dict[CheckVerdict, int]:
    """Count verdicts in the order of `CheckVerdict`, without verdicts that do not occur."""
    counts = Counter(result.outcome.verdict for result in results)
    return {verdict: counts[verdict] for verdict in CheckVerdict if counts[verdict]}


def counts_text(counts: dict[CheckVerdict, int]) -> str:
    """Return counts as text.

    >>> counts_text({CheckVerdict.PASS: 3, CheckVerdict.FAIL: 1})
    '3 pass, 1 fail'
    """
    return ", ".join(f"{number} {verdict}" for verdict, number in counts.items()) or "none"


def by_group(report: Report) -> list[_GroupRow]:
    """Return one table row per group of checks, with its results, in the order of the run."""
    return _rows(report, lambda result: result.check.group)


def by_clause(report: Report) -> list[_GroupRow]:
    """Return the clauses, by document and number."""
    rows = _rows(report, lambda result: result.check.source)
    return sorted(rows, key=lambda row: [_number(part) for part in re.split(r"(\d+)", row.name)])


def unwell(report: Report) -> list[Result]:
    """Return the results that need attention. The worst results are first."""
    found = report.with_verdict(*UNWELL)
    return sorted(found, key=lambda result: UNWELL.index(result.outcome.verdict))


def causes(results: Iterable[Result]) -> list[list[Result]]:
    """Group check results that probably have the same cause, so that a report shows it only once.

    Object checks of the same kind that fail for the same reason are one group. Each of the other
    check results is a group of its own.
    """
    found: dict[tuple[str, ...], list[Result]] = {}
    for number, each in enumerate(results):
        kind = _OF_OBJECT.fullmatch(each.check.id)
        reason = _PLACE.sub("", each.outcome.reason)
        key = (each.outcome.verdict, kind[1], reason) if kind else (str(number),)
        found.setdefault(key, []).append(each)
    return list(found.values())


_OF_OBJECT: Final = re.compile(r"OD-.*-(\w+)")
_PLACE: Final = re.compile(r"step \d+|\b[0-9A-F]{4}h?:[0-9A-F]{2}\b|\b\d+ bytes")
"""Pattern for parts of a reason that differ between objects that fail in the same way."""


def repair_commands(report: Report) -> tuple[str, ...]:
    """Return the commands that restore the remaining objects, in the order of execution."""
    head = f"canmon net {shlex.quote(report.source)} write {report.node_id}"
    return tuple(f"{head} {shlex.quote(words)} --yes" for words in report.repairs)


def _rows(report: Report, name_of: Callable[[Result], str]) -> list[_GroupRow]:
    rows: dict[str, list[Result]] = {}
    for result in report.results:
        rows.setdefault(name_of(result), []).append(result)
    return [_GroupRow(name, tuple(results)) for name, results in rows.items()]


def _number(part: str) -> tuple[int, str]:
    return (int(part), "") if part.isdecimal() and len(part) < 9 else (0, part)
