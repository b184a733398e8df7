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
    """One test case of a JUnit report.

    Attributes:
        group: name of the case's group, its `classname` in JUnit.
        name: name of the case.
        tag: outcome of the case: `FAILURE`, `ERROR`, `SKIPPED` or `OUTPUT`, or empty if it passed
            without output.
        message: reason for the outcome in one line, empty for `OUTPUT`.
        text: details of the outcome.
        duration_us: duration of the case in microseconds, or None if it is unknown.
    """

    group: str
    name: str
    tag: str = ""
    message: str = ""
    text: str = ""
    duration_us: int | None = None


@dataclass(frozen=True, slots=True)
class JunitSuite:
    """One suite of test cases in a JUnit report.

    Attributes:
        name: name of the suite.
        cases: cases in the order of the report.
        properties: texts about the tested object and the settings, by name.
    """

    name: str
    cases: Sequence[JunitCase]
    properties: Mapping[str, str] = field(default_factory=dict)


def junit_text(suites: Iterable[JunitSuite], name: str = "") -> str:
    """Return test suites as a JUnit report in XML.

    Args:
        suites: suites in the order of the report.
        name: name of the whole report, or empty for none.
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
