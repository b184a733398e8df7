"""A report for a terminal: a line a group, and the failures with their frames."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

from tickrig.host.canopen.conform import check
from tickrig.host.canopen.conform.check import CheckVerdict, Report, Result
from tickrig.host.canopen.conform.notation import step_words
from tickrig.host.canopen.conform.report import overview
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.overview import ShowFrames, plain_frames
from tickrig.host.canopen.conform.suite import group_titles
from tickrig.host.text.page_text import duration, one_line
from tickrig.host.text.values import counted
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID

_MOST_SHOWN: Final = 20
"""So many failures are shown with their frames; the others without."""
_ELSEWHERE: Final = "more, without their frames, which --html FILE and --json have:"
_MOST_LINES: Final = 40
"""Of frames of one failure."""
_MOST_REASONS: Final = 12


def text_report(
    report: Report,
    baseline: Baseline = NONE_KNOWN,
    show: overview.ShowFrames = overview.plain_frames,
    again: str = "",
) -> str:
    """Return the text.

    Args:
        report: the run.
        baseline: failures that are known; they are named and not shown.
        show: writes frames.
        again: the command that judges one check alone, without its id; empty if there is none.
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
    """Say why checks were not applicable, the most frequent reason first."""
    reasons = Counter(
        one_line(result.outcome.reason)
        for result in report.results
        if result.outcome.verdict is CheckVerdict.NOT_APPLICABLE
    )
    if not reasons:
        return []
    ranked = sorted(reasons.items(), key=lambda each: (-each[1], each[0]))
    rows = [f"{number:5}  {reason}" for reason, number in ranked[:_MOST_REASONS]]
    more = len(ranked) - _MOST_REASONS
    return ["not applicable:", *rows, *([f"       and {more} reasons more"] if more > 0 else [])]


def _was_begun(result: Result) -> bool:
    """Say whether a check has something of its own to tell."""
    return result.outcome.verdict is CheckVerdict.FAIL or bool(result.outcome.evidence)


def _never_begun(results: list[Result]) -> list[str]:
    """Count checks of which nothing was seen on the bus, with the reason that they share."""
    counts = Counter((each.outcome.verdict, one_line(each.outcome.reason)) for each in results)
    return [
        f"{str(verdict).upper()} {counted(number, 'check')}: {reason}"
        for (verdict, reason), number in counts.items()
    ]


def _failure(alike: list[Result], show: overview.ShowFrames | None, again: str) -> list[str]:
    """Tell a failure, and which are like it; without frames, without where to look too."""
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
    """Name what failed likewise."""
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
        yield f"not all was judged: {one_line(report.aborted)}"


# Failures as a page in Markdown that the maintainer of a stack can file: clause, frames, script.

_LEAST_WAIT_US: Final = 2_000
"""Frames that were sent with less between them follow each other at once."""
_MULTIPLEXER_END: Final = len("585#60171000")
"""Up to here an answer to an SDO request is compared: command, index and sub-index."""
_UNEXPECTED: Final = re.compile(r"unexpected (\S+),")
_CLASS: Final = re.compile(r"\[[0-9A-F]+\]")
_GROUP: Final = re.compile(r"\(.*\)")


def issue_text(
    report: check.Report, baseline: Baseline = NONE_KNOWN, show: ShowFrames = plain_frames
) -> str:
    """Return the page: of each failure what the text says, what came, its frames and a script.

    Args:
        report: the run.
        baseline: failures that are known; they are left out.
        show: writes frames.
    """
    failed = [
        result
        for result in report.results
        if result.outcome.verdict is check.CheckVerdict.FAIL and not baseline.knows(result)
    ]
    parts = ["\n".join(_issue_head(report, len(failed)))]
    parts += ["\n".join(_issue_failure(report, result, show)) for result in failed]
    return "\n\n".join(parts) + "\n"


def _issue_head(report: check.Report, failures: int) -> Iterator[str]:
    yield f"# {counted(failures, 'failure')} of CANopen conformance, node {report.node_id}"
    yield ""
    told = {**report.node, **report.settings}
    yield from (f"- {one_line(name)}: {one_line(value)}" for name, value in told.items())


def _issue_failure(report: check.Report, result: check.Result, show: ShowFrames) -> Iterator[str]:
    check, outcome = result.check, result.outcome
    yield f"## {one_line(check.id)}: {one_line(check.title)}"
    yield ""
    yield f"- Clause: {one_line(check.source)}"
    yield f"- The text says: {one_line(check.title)}"
    yield f"- What came: {one_line(outcome.reason)}"
    if check.steps:
        yield f"- Steps: {'; '.join(one_line(step_words(step)) for step in check.steps)}"
    yield from ("", "```text", *map(one_line, show(outcome.evidence)), "```", "")
    yield f"`canmon seq BUS {check.id}.toml`; exit status 1 shows the failure:"
    yield from ("", "```toml", *_sequence(outcome, report.node_id), "```")


def _sequence(outcome: check.CheckOutcome, node_id: int) -> list[str]:
    """Return the lines of a sequence that does what a check did up to where it failed.

    Args:
        outcome: of the check.
        node_id: of the node.
    """
    request, response = REQUEST_COB_ID + node_id, f"{RESPONSE_COB_ID + node_id:03X}#"
    boot_up = f"{ERROR_CONTROL_COB_ID + node_id:03X}#00"
    lines = _step("send", f"000#80{node_id:02X}") + _step("wait", "20ms")
    evidence = list(outcome.evidence)
    if evidence and outcome.wanted and evidence[-1].direction is check.Direction.RECEIVED:
        del evidence[-1]  # what came in place of what is expected below
    last_us, asked = evidence[0].at_us if evidence else 0, False
    for line in evidence:
        match line.direction:
            case check.Direction.SENT:
                if line.at_us - last_us >= _LEAST_WAIT_US:
                    lines += _step("wait", f"{(line.at_us - last_us + 500) // 1_000}ms")
                lines += _step("send", line.text)
                last_us, asked = line.at_us, line.text.startswith(f"{request:03X}#")
            case check.Direction.RECEIVED if asked and line.text.startswith(response):
                lines += _step("expect", f"{line.text[:_MULTIPLEXER_END]}*", within="1s")
                last_us, asked = line.at_us, False
            case check.Direction.RECEIVED if line.text == boot_up:
                lines += _step("expect", boot_up, within="5s")
                last_us = line.at_us
            case check.Direction.REMARK:
                lines.append(f"# {one_line(line.text)}")
            case _:
                pass
    return lines + _end(outcome)


def _end(outcome: check.CheckOutcome) -> list[str]:
    """Return the step that tells whether the failure is there."""
    if outcome.wanted:
        return _step("expect", _merged(outcome.wanted), within="1s")
    reason = one_line(outcome.reason)
    if match := _UNEXPECTED.search(outcome.reason):
        return [f"# The failure is there if this frame comes: {match[1]}"]
    return [f"# The frames that follow show the failure: {reason}"]


def _merged(patterns: Sequence[str]) -> str:
    """Return one pattern of `canmon seq` for several of a check.

    >>> _merged(["585#80......01000405", "585#80......00000008"])
    '585#80??????0?000?0?'
    """
    plain = [_GROUP.sub("..", _CLASS.sub(".", pattern)).replace(".", "?") for pattern in patterns]
    if len({len(each) for each in plain}) > 1 or any("*" in each for each in plain):
        return f"{plain[0].partition('#')[0]}#*" if plain[1:] else plain[0]
    return "".join(one[0] if len(set(one)) == 1 else "?" for one in zip(*plain, strict=True))


def _step(what: str, text: str, within: str = "") -> list[str]:
    more = [f'within = "{within}"'] if within else []
    return ["[[step]]", f'{what} = "{text}"', *more]
