"""A report for a terminal: one line per group, and the failures with their frames."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Final

from tickrig.host.canopen.conform.report import overview
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.suite import group_titles
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report, Result
from tickrig.host.text.page_text import duration, one_line
from tickrig.host.text.values import counted

_MOST_SHOWN: Final = 20
"""Number of failures that are shown with their frames."""
_ELSEWHERE: Final = "more, without their frames; --html FILE and --json have them:"
_MOST_LINES: Final = 40
"""Number of lines that are shown of one failure."""
_MOST_REASONS: Final = 12


def text_report(
    report: Report,
    baseline: Baseline = NONE_KNOWN,
    show: overview.ShowFrames = overview.plain_frames,
    again: str = "",
) -> str:
    """Return a conformance report as text for the terminal.

    Args:
        report: report of the run.
        baseline: failures that are known. Only their names are shown.
        show: function that formats the recorded frames as lines.
        again: beginning of a command line that runs a single check again. The report appends the id
            of the check. If the text is empty, no command is shown.
    """
    parts = [_head(report), _groups(report), _not_applicable(report)]
    found = [result for result in overview.unwell(report) if not baseline.knows(result)]
    begun = overview.causes(result for result in found if _was_begun(result))
    parts += [_failure(alike, show, again) for alike in begun[:_MOST_SHOWN]]
    if more := begun[_MOST_SHOWN:]:
        parts += [[f"{len(more)} {_ELSEWHERE}"], *(_failure(alike, None, again) for alike in more)]
    parts.append(_never_begun([result for result in found if not _was_begun(result)]))
    parts += [_list("findings", report.findings), _list("not restored", report.unrestored)]
    parts.append(_list("to restore it, in this order", overview.repair_commands(report)))
    parts.append(list(_ending(report, baseline)))
    return "\n\n".join("\n".join(part) for part in parts if part) + "\n"


def _head(report: Report) -> list[str]:
    what = counted(len(report.results), "check")
    head = f"node {report.node_id} on {one_line(report.source)}, {report.level.word}: {what}"
    told = {**report.node, **report.settings}
    wide = max(map(len, told), default=0)
    rows = [f"  {one_line(name):<{wide}}  {one_line(value)}" for name, value in told.items()]
    doubt = [one_line(report.doubt)] if report.doubt else []
    return [*doubt, f"{head} in {duration(report.duration_us)}", *rows]


def _groups(report: Report) -> list[str]:
    rows = overview.by_group(report)
    titles = group_titles()
    names = [f"{one_line(row.name):<4} {titles.get(row.name, '')}" for row in rows]
    wide = max(map(len, names), default=0)
    return [
        f"{name:<{wide}}  {len(row.results):5}: {overview.counts_text(row.counts)}"
        for name, row in zip(names, rows, strict=True)
    ]


def _not_applicable(report: Report) -> list[str]:
    """Return why checks were not applicable. The most frequent reason is first."""
    reasons = Counter(
        one_line(result.outcome.reason)
        for result in report.with_verdict(CheckVerdict.NOT_APPLICABLE)
    )
    if not reasons:
        return []
    ranked = sorted(reasons.items(), key=lambda each: (-each[1], each[0]))
    rows = [f"{number:5}  {reason}" for reason, number in ranked[:_MOST_REASONS]]
    more = len(ranked) - _MOST_REASONS
    return ["not applicable:", *rows, *([f"       and {more} more reasons"] if more > 0 else [])]


def _was_begun(result: Result) -> bool:
    """Return whether a check has details of its own to show."""
    return result.outcome.verdict is CheckVerdict.FAIL or bool(result.outcome.evidence)


def _never_begun(results: list[Result]) -> list[str]:
    """Count checks without any frame on the bus, with their common reason."""
    counts = Counter((each.outcome.verdict, one_line(each.outcome.reason)) for each in results)
    return [
        f"{str(verdict).upper()} {counted(number, 'check')}: {reason}"
        for (verdict, reason), number in counts.items()
    ]


def _failure(alike: list[Result], show: overview.ShowFrames | None, again: str) -> list[str]:
    """Return the text of a failure and of similar failures. Hints are given only with frames."""
    result = alike[0]
    clause = f"  {one_line(result.check.source)}"
    reason = [f"  {one_line(result.outcome.reason)}"] if result.outcome.reason else []
    frames, next_to = list[str](), list[str]()
    if show is not None:
        frames = overview.cut(overview.all_goes(result.outcome, result.first, show), _MOST_LINES)
        next_to = [f"  look at {text}"] if (text := overview.hint(result)) else []
    alone = [f"  alone: {again} --only {result.check.id}"] if again else []
    return [_title(result), clause, *reason, *frames, *next_to, *alone, *_like(alike[1:])]


def _like(results: list[Result]) -> list[str]:
    """Name the checks that failed in the same way."""
    if not results:
        return []
    names = [one_line(result.check.id) for result in results[:_MOST_REASONS]]
    more = [f"and {len(results) - _MOST_REASONS} more"] if results[_MOST_REASONS:] else []
    return [f"  the same in {counted(len(results), 'other')}: {', '.join([*names, *more])}"]


def _title(result: Result) -> str:
    check, verdict = result.check, str(result.outcome.verdict).upper()
    return f"{verdict} {one_line(check.id)}: {one_line(check.title)}"


def _list(what: str, lines: tuple[str, ...]) -> list[str]:
    return [f"{what}:", *(f"  {one_line(line)}" for line in lines)] if lines else []


def _ending(report: Report, baseline: Baseline) -> Iterator[str]:
    if report.findings:
        yield f"{counted(len(report.findings), 'finding')}, above"
    counts = overview.counts_text(overview.verdict_counts(report.results))
    yield f"{counted(len(report.results), 'check')}: {counts}"
    if baseline.known:
        known, new = sum(map(baseline.knows, report.results)), len(baseline.new(report))
        yield f"{counted(known, 'failure')} known, {new} new"
    if mended := baseline.mended(report):
        yield f"known to fail, and passed: {', '.join(mended)}"
    if report.doubt:
        yield one_line(report.doubt)
    if report.aborted:
        yield f"the run is incomplete: {one_line(report.aborted)}"
