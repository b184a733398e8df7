"""JUnit reports for CI systems: suites of test cases.

>>> print(junit_text([JunitSuite("check", [JunitCase("check", "no-emcy")])]))
<?xml version='1.0' encoding='utf-8'?>
<testsuites>
 <testsuite name="check" tests="1" failures="0" errors="0" skipped="0">
  <testcase classname="check" name="no-emcy" />
 </testsuite>
</testsuites>
<BLANKLINE>
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from tickrig.host.text.page_text import harmless

FAILURE: Final = "failure"
ERROR: Final = "error"
SKIPPED: Final = "skipped"
OUTPUT: Final = "system-out"


@dataclass(frozen=True, slots=True)
class JunitCase:
    """A test case.

    Attributes:
        group: group of the case, which is its `classname`.
        name: name of the case.
        tag: tag of the case: `FAILURE`, `ERROR`, `SKIPPED` or `OUTPUT`, or empty if the case
            passed.
        message: reason in one line, empty for an `OUTPUT`.
        text: details of the case.
        duration_us: duration of the case, or None if unknown.
    """

    group: str
    name: str
    tag: str = ""
    message: str = ""
    text: str = ""
    duration_us: int | None = None


@dataclass(frozen=True, slots=True)
class JunitSuite:
    """A suite of test cases.

    Attributes:
        name: name of the suite.
        cases: cases in the order of the report.
        properties: properties of the tested object, and settings, by name.
    """

    name: str
    cases: Sequence[JunitCase]
    properties: Mapping[str, str] = field(default_factory=dict)


def junit_text(suites: Iterable[JunitSuite], name: str = "") -> str:
    """Return the report as JUnit XML.

    Args:
        suites: suites in their order.
        name: name of the whole report, empty for none.
    """
    root = Element("testsuites", {"name": harmless(name)} if name else {})
    for suite in suites:
        _add_suite(root, suite)
    indent(root, " ")
    return "<?xml version='1.0' encoding='utf-8'?>\n" + tostring(root, "unicode") + "\n"


def _add_suite(root: Element, suite: JunitSuite) -> None:
    element = SubElement(root, "testsuite", name=harmless(suite.name), tests=str(len(suite.cases)))
    for name, tag in (("failures", FAILURE), ("errors", ERROR), ("skipped", SKIPPED)):
        element.set(name, str(sum(case.tag == tag for case in suite.cases)))
    durations = [case.duration_us for case in suite.cases if case.duration_us is not None]
    if durations:
        element.set("time", _seconds(sum(durations)))
    if suite.properties:
        properties = SubElement(element, "properties")
        for name, value in suite.properties.items():
            SubElement(properties, "property", name=harmless(name), value=harmless(value))
    for case in suite.cases:
        _add_case(element, case)


def _add_case(suite: Element, case: JunitCase) -> None:
    element = SubElement(
        suite, "testcase", classname=harmless(case.group), name=harmless(case.name)
    )
    if case.duration_us is not None:
        element.set("time", _seconds(case.duration_us))
    if case.tag:
        message = {} if case.tag == OUTPUT else {"message": harmless(case.message)}
        SubElement(element, case.tag, message).text = harmless(case.text) or None


def _seconds(us: int) -> str:
    return f"{us / 1e6:.6f}"
