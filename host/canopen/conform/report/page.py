"""A report as one HTML page that needs nothing else; Jinja2 (extra `report`) fills its template.

A template writes a value through `harmless` and escapes it; nothing is marked as safe but the
style sheet, which is ours, and whose hash is all that the page lets in. There is no script.
"""

from __future__ import annotations

from base64 import b64encode
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tickrig.host.canopen.conform.notation import step_words
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.overview import (
    SAME,
    UNWELL,
    ShowFrames,
    by_clause,
    by_group,
    counts_text,
    cut,
    hint,
    plain_frames,
    repair_commands,
    same_go,
    unwell,
    verdict_counts,
)
from tickrig.host.canopen.conform.suite import group_titles
from tickrig.host.canopen.conform.verdict import CheckOutcome, CheckVerdict, Report
from tickrig.host.text import page_text
from tickrig.host.text.values import counted

_PACKAGE: Final = __package__
_FOLDER: Final = "template"
_MOST_LINES: Final = 200
"""Of frames of one go at a check."""
_MOST_OPEN: Final = 12
"""Up to so many failures are unfolded at once."""


def html_page(
    report: Report, baseline: Baseline = NONE_KNOWN, show: ShowFrames = plain_frames
) -> str:
    """Return the page; the same run gives the same bytes.

    Args:
        report: the run.
        baseline: failures that are known.
        show: writes frames.
    """
    style = files(_PACKAGE).joinpath(_FOLDER, "page.css").read_text("utf-8")

    def frames(outcome: CheckOutcome) -> str:
        return "\n".join(cut(show(outcome.evidence), _MOST_LINES))

    found = unwell(report)
    template: Any = _environment().get_template("page.html")
    page: str = template.render(
        repairs=repair_commands(report),
        report=report,
        baseline=baseline,
        mended=baseline.mended(report),
        counts=verdict_counts(report.results),
        groups=by_group(report),
        titles=group_titles(),
        clauses=by_clause(report),
        unwell=found,
        opened=len(found) <= _MOST_OPEN,
        frames=frames,
        style=Markup(style),
        policy=_policy(style),
    )
    return page


@cache
def _environment() -> Environment:
    """Return what has the template; it is compiled once."""
    environment = Environment(
        loader=PackageLoader(_PACKAGE, _FOLDER),
        autoescape=True,
        finalize=page_text.harmless,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "duration": page_text.duration,
        "counted": counted,
        "counts": counts_text,
        "slug": _slug,
        "hint": hint,
        "words": step_words,
    }
    environment.globals |= {
        "Verdict": CheckVerdict,
        "UNWELL": UNWELL,
        "same_go": same_go,
        "SAME": SAME,
    }
    return environment


def _slug(verdict: CheckVerdict) -> str:
    return verdict.name.lower()


def _policy(style: str) -> str:
    """Return the content security policy: no network, no script, and no style but ours."""
    style_hash = b64encode(sha256(style.encode()).digest()).decode()
    return (
        f"default-src 'none'; style-src 'sha256-{style_hash}'; base-uri 'none'; form-action 'none'"
    )
