"""A report as JSON, for programs (docs/reference/canopen/conform.md defines the fields)."""

from __future__ import annotations

import json
from typing import Final

from tickrig.host.canopen.conform.notation import step_words
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.overview import by_group, repair_commands
from tickrig.host.canopen.conform.suite import group_titles
from tickrig.host.canopen.conform.verdict import CheckOutcome, CheckVerdict, Report, Result

_VERSION: Final = 1
"""Version of the format, which changes when a field changes its meaning or disappears."""

_Object = dict[str, object]


def report_json(report: Report, baseline: Baseline = NONE_KNOWN) -> str:
    """Return a conformance report as JSON for programs. Equal reports give equal bytes.

    Args:
        report: report of the run.
        baseline: failures that are known.
    """
    said: _Object = {
        "v": _VERSION,
        "source": report.source,
        "node": report.node_id,
        "level": report.level.word,
        "exit_status": baseline.ends_with(report),
        "aborted": report.aborted,
        "doubt": report.doubt,
        "duration_us": report.duration_us,
        "counts": {str(verdict): report.count(verdict) for verdict in CheckVerdict},
        "groups": {row.name: group_titles().get(row.name, "") for row in by_group(report)},
        "device": dict(report.node),
        "settings": dict(report.settings),
        "findings": list(report.findings),
        "unrestored": list(report.unrestored),
        "repairs": list(repair_commands(report)),
        "checks": [_check(result, baseline) for result in report.results],
    }
    return json.dumps(said, indent=1) + "\n"


def _check(result: Result, baseline: Baseline) -> _Object:
    check = result.check
    return {
        "id": check.id,
        "group": check.group,
        "title": check.title,
        "clause": check.source,
        "level": check.level.word,
        "needs": sorted(check.needs),
        "choice": check.choice,
        "steps": list(map(step_words, check.steps)),
        "known": baseline.knows(result),
        **_outcome(result.outcome),
        "first": None if result.first is None else _outcome(result.first),
    }


def _outcome(outcome: CheckOutcome) -> _Object:
    return {
        "verdict": str(outcome.verdict),
        "reason": outcome.reason,
        "start_us": outcome.start_us,
        "end_us": outcome.end_us,
        "frames": [[line.at_us, str(line.direction), line.text] for line in outcome.evidence],
    }
