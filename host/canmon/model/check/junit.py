"""Findings as a JUnit report, one test case for each rule."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Final, Protocol
from xml.sax.saxutils import escape, quoteattr

from tickrig.host.text.values import counted

CONTROLS: Final = {code: "�" for code in range(0x20) if chr(code) not in "\t\n\r"}
"""Characters that XML does not have."""


NONE_SKIPPED: Final[Mapping[str, str]] = MappingProxyType({})


class Judged(Protocol):
    """What a report needs of a finding, beside its text in one line."""

    @property
    def rule(self) -> str:
        """Name of the rule."""
        ...

    @property
    def text(self) -> str:
        """What is wrong, in words."""
        ...


def junit(
    suite: str,
    names: Sequence[str],
    findings: Iterable[Judged],
    unjudged: str = "",
    skipped: Mapping[str, str] = NONE_SKIPPED,
) -> str:
    """Return the report.

    Args:
        suite: what was checked.
        names: of all rules, also of those that hold.
        findings: in their order.
        unjudged: why rules without a finding cannot be said to hold; empty if they can.
        skipped: why some rules judged nothing, by their names.
    """
    by_rule: dict[str, list[Judged]] = {name: [] for name in names}
    for finding in findings:
        by_rule[finding.rule].append(finding)
    failures = sum(bool(found) for found in by_rule.values())
    errors = len(by_rule) - failures if unjudged else 0
    counts = f"tests='{len(names)}' failures='{failures}' errors='{errors}'"
    skips = {} if unjudged else skipped
    counts += f" skipped='{len(skips)}'" * bool(skips)
    head = f"<testsuite name={_attribute(suite)} {counts}>"
    cases = [
        _case(suite, name, found, unjudged, skips.get(name, "")) for name, found in by_rule.items()
    ]
    lines = ["<?xml version='1.0' encoding='utf-8'?>", "<testsuites>", head, *cases]
    return "\n".join([*lines, "</testsuite>", "</testsuites>", ""])


def _case(suite: str, name: str, found: Sequence[Judged], unjudged: str, skipped: str) -> str:
    head = f"<testcase classname={_attribute(suite)} name={_attribute(name)}"
    if not found:
        kind, why = ("error", unjudged) if unjudged else ("skipped", skipped)
        return head + (f"><{kind} message={_attribute(why)}/></testcase>" if why else "/>")
    message = f"{counted(len(found), 'finding')}, first: {found[0].text}"
    text = escape("\n".join(map(str, found)).translate(CONTROLS))
    return f"{head}><failure message={_attribute(message)}>{text}</failure></testcase>"


def _attribute(text: str) -> str:
    return quoteattr(text.translate(CONTROLS))
