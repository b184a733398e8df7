"""Failures as a Markdown page that you can file with the maintainer of a stack.

The page contains clause, frames and a script for each failure. A script is a sequence for `canmon
seq`. It sends what the tester sent in the check, at the same times and after the same answers. At
the end, it expects the frame that the standard requires.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from tickrig.host.canopen.conform import verdict
from tickrig.host.canopen.conform.notation import step_words
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.overview import ShowFrames, plain_frames
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import counted
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID

_LEAST_WAIT_US: Final = 2_000
"""Shortest pause between frames. Frames with a shorter pause are sent without a pause."""
_MULTIPLEXER_END: Final = len("585#60171000")
"""End of the compared part of an SDO response, which is command, index and sub-index."""
_UNEXPECTED: Final = re.compile(r"unexpected (\S+),")
_CLASS: Final = re.compile(r"\[[0-9A-F]+\]")
_GROUP: Final = re.compile(r"\(.*\)")


def issue_text(
    report: verdict.Report, baseline: Baseline = NONE_KNOWN, show: ShowFrames = plain_frames
) -> str:
    """Return the failures of a run as a Markdown page, for an issue to the maintainer of a stack.

    For each failure, the page contains the requirement, the answer of the node, the frames, and a
    script that reproduces the failure.

    Args:
        report: report of the run.
        baseline: failures that are known. The page omits them.
        show: function that formats the recorded frames as lines.
    """
    failed = baseline.new(report)
    parts = ["\n".join(_head(report, len(failed)))]
    parts += ["\n".join(_failure(report, result, show)) for result in failed]
    return "\n\n".join(parts) + "\n"


def _head(report: verdict.Report, failures: int) -> Iterator[str]:
    yield f"# {counted(failures, 'failure')} of CANopen conformance, node {report.node_id}"
    yield ""
    told = {**report.node, **report.settings}
    yield from (f"- {one_line(name)}: {one_line(value)}" for name, value in told.items())


def _failure(report: verdict.Report, result: verdict.Result, show: ShowFrames) -> Iterator[str]:
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


def _sequence(outcome: verdict.CheckOutcome, node_id: int) -> list[str]:
    """Return the lines of a sequence that repeats a check up to its failure.

    Args:
        outcome: outcome of the check.
        node_id: node-ID of the node.
    """
    request, response = REQUEST_COB_ID + node_id, f"{RESPONSE_COB_ID + node_id:03X}#"
    boot_up = f"{ERROR_CONTROL_COB_ID + node_id:03X}#00"
    lines = _step("send", f"000#80{node_id:02X}") + _step("wait", "20ms")
    evidence = list(outcome.evidence)
    if evidence and outcome.wanted and evidence[-1].direction is verdict.Direction.RECEIVED:
        del evidence[-1]  # received in place of the frame expected below
    last_us, asked = evidence[0].at_us if evidence else 0, False
    for line in evidence:
        match line.direction:
            case verdict.Direction.SENT:
                if line.at_us - last_us >= _LEAST_WAIT_US:
                    lines += _step("wait", f"{(line.at_us - last_us + 500) // 1_000}ms")
                lines += _step("send", line.text)
                last_us, asked = line.at_us, line.text.startswith(f"{request:03X}#")
            case verdict.Direction.RECEIVED if asked and line.text.startswith(response):
                lines += _step("expect", f"{line.text[:_MULTIPLEXER_END]}*", within="1s")
                last_us, asked = line.at_us, False
            case verdict.Direction.RECEIVED if line.text == boot_up:
                lines += _step("expect", boot_up, within="5s")
                last_us = line.at_us
            case verdict.Direction.REMARK:
                lines.append(f"# {one_line(line.text)}")
            case _:
                pass
    return lines + _end(outcome)


def _end(outcome: verdict.CheckOutcome) -> list[str]:
    """Return the step that shows whether the failure still exists."""
    if outcome.wanted:
        return _step("expect", _merged(outcome.wanted), within="1s")
    reason = one_line(outcome.reason)
    if match := _UNEXPECTED.search(outcome.reason):
        return [f"# The failure is there if this frame comes: {match[1]}"]
    return [f"# The frames that follow show the failure: {reason}"]


def _merged(patterns: Sequence[str]) -> str:
    """Return one `canmon seq` pattern for several patterns of a check.

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
