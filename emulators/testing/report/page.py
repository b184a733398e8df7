"""A report as one HTML page that needs nothing else; Jinja2 (extra `report`) fills its templates.

A template writes a value through `harmless` and escapes it; nothing is marked as safe but the
style sheet and the script, which are ours, and whose hashes are all that the page lets run.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tickrig.emulators.testing.report.bench_report import (
    BenchReport,
    JournalLine,
    Outcome,
    TestRecord,
)
from tickrig.emulators.testing.report.overview import (
    UNWELL,
    ReportedTest,
    by_file,
    counts,
    reported,
    requirement_rows,
    slowest,
)
from tickrig.emulators.testing.report.page_room import (
    JOURNAL_LINES,
    PAGE_BYTES,
    TEXT_BYTES,
    TRACE_BYTES,
    PageRoom,
    Part,
    cut,
)
from tickrig.emulators.testing.report.timeline import Timeline, timeline_of
from tickrig.host.text import page_text
from tickrig.host.text.values import counted, format_time

PACKAGE: Final = __package__
FOLDER: Final = "template"
MOST_OPEN: Final = 12
"""Up to so many failed tests are unfolded at once."""


@dataclass(frozen=True, slots=True)
class TestOnPage:
    """A test with what of it has room.

    Attributes:
        place: the test, its anchor and name.
        timeline: its time line, None if there is none, or no room.
        longrepr: what pytest told.
        journal: its last lines.
        journal_left_out: how many earlier lines there were.
        trace: its trace.
        left_out: what is not on the page, for people.
        opened: it is unfolded when the page opens.
    """

    place: ReportedTest
    timeline: Timeline | None
    longrepr: str
    journal: tuple[JournalLine, ...]
    journal_left_out: int
    trace: str
    left_out: tuple[str, ...]
    opened: bool


def html_page(report: BenchReport, room_bytes: int = PAGE_BYTES) -> str:
    """Return the page.

    Args:
        report: what is shown.
        room_bytes: how much tests may bring to the page; what has no room is named on it.
    """
    places = reported(report.tests)
    style, script = (_resource(name) for name in ("page.css", "page.js"))
    unwell = [place for place in places if place.record.outcome in UNWELL]
    template = _environment().get_template("page.html")
    return template.render(
        report=report,
        tests=places,
        shown={test.place.anchor: test for test in _on_page(places, room_bytes)},
        counts=counts(report.tests),
        unwell=sorted(unwell, key=lambda place: UNWELL.index(place.record.outcome)),
        requirements=requirement_rows(report, places),
        slowest=slowest(places),
        files=by_file(places),
        style=Markup(style),
        script=Markup(script),
        policy=_policy(style, script),
    )


@cache
def _environment() -> Environment:
    """Return what has the templates; they are compiled once."""
    environment = Environment(
        loader=PackageLoader(PACKAGE, FOLDER),
        autoescape=True,
        finalize=page_text.harmless,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "duration": page_text.duration,
        "size": page_text.size,
        "counted": counted,
        "time": format_time,
        "seconds": page_text.seconds,
    }
    environment.globals["Outcome"] = Outcome
    return environment


def _resource(name: str) -> str:
    return files(PACKAGE).joinpath(FOLDER, name).read_text("utf-8")


def _policy(style: str, script: str) -> str:
    """Return the content security policy: no network, and no style or script but ours."""
    hashes = (b64encode(sha256(text.encode()).digest()).decode() for text in (style, script))
    style_hash, script_hash = hashes
    return (
        f"default-src 'none'; style-src 'sha256-{style_hash}'; script-src 'sha256-{script_hash}';"
        " base-uri 'none'; form-action 'none'"
    )


def _on_page(places: Sequence[ReportedTest], room_bytes: int) -> Iterator[TestOnPage]:
    tests = [place.record for place in places]
    timelines = [timeline_of(test) for test in tests]
    admitted = PageRoom(tests, timelines, room_bytes).admitted
    unwell = sum(test.outcome in UNWELL for test in tests)
    for number, place in enumerate(places):
        parts = {part for part in Part if (number, part) in admitted}
        opened = place.record.outcome in UNWELL and unwell <= MOST_OPEN
        yield _test_on_page(place, timelines[number], parts, opened)


def _test_on_page(
    place: ReportedTest, timeline: Timeline | None, parts: set[Part], opened: bool
) -> TestOnPage:
    test = place.record
    lines = test.journal[-JOURNAL_LINES:]
    return TestOnPage(
        place,
        timeline if Part.TIMELINE in parts else None,
        cut(test.longrepr, TEXT_BYTES)[0] if Part.TEXT in parts else "",
        lines if Part.JOURNAL in parts else (),
        test.journal_left_out + len(test.journal) - len(lines),
        cut(test.trace, TRACE_BYTES)[0] if Part.TRACE in parts else "",
        tuple(_left_out(test, timeline, parts)),
        opened,
    )


def _left_out(test: TestRecord, timeline: Timeline | None, parts: set[Part]) -> Iterator[str]:
    """Yield what of a test is not on the page, for people."""
    texts = (
        (Part.TEXT, "the text", test.longrepr, TEXT_BYTES),
        (Part.TRACE, "the trace", test.trace, TRACE_BYTES),
    )
    for part, name, text, most in texts:
        if text and part not in parts:
            yield f"{name}, {page_text.size(len(text))}"
        elif missing := cut(text, most)[1]:
            yield f"the last {page_text.size(missing)} of {name}"
    if timeline and Part.TIMELINE not in parts:
        yield "the plots"
    if test.journal and Part.JOURNAL not in parts:
        yield counted(len(test.journal), "journal line")
