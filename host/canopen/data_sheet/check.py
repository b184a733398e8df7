"""All findings in an EDS file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Final

from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import RuleFinding, Severity
from tickrig.host.canopen.data_sheet.rules import (
    head_rules,
    list_rules,
    object_rules,
    pdo_rules,
    profile_rules,
    text_rules,
    truncation,
    value_rules,
)
from tickrig.host.text.values import counted

_CHECKS: Final[tuple[Callable[[Document], Iterator[RuleFinding]], ...]] = (
    value_rules.of_reader,
    value_rules.stray_lines,
    *(text_rules.encoding, text_rules.line_ends, text_rules.titles, text_rules.keywords),
    text_rules.comments,
    *(head_rules.sections, head_rules.file_info, head_rules.device_info, head_rules.counts),
    *(head_rules.features, head_rules.dummy_usage, head_rules.comment_lines),
    head_rules.commissioning,
    truncation.truncated,
    list_rules.lists,
    *(object_rules.names, object_rules.kinds, object_rules.sub_numbers, object_rules.sub_zeros),
    *(value_rules.numbers, value_rules.list_numbers, value_rules.limits),
    *(
        pdo_rules.compact,
        pdo_rules.cob_ids,
        pdo_rules.halves,
        pdo_rules.reserved,
        pdo_rules.mappings,
    ),
    *(profile_rules.mandatory, profile_rules.communication, profile_rules.profile),
)
_OF_TEXT: Final = frozenset(
    (
        *(value_rules.stray_lines, value_rules.list_numbers, truncation.truncated),
        *(text_rules.line_ends, text_rules.titles, text_rules.keywords, text_rules.comments),
        *(head_rules.sections, head_rules.file_info, head_rules.comment_lines),
        *(list_rules.lists, object_rules.kinds, pdo_rules.compact),
    )
)
"""Rules for the form of a text file, which an XML file does not have."""
_UNREADABLE: Final = frozenset({"xml", "no-objects"})
"""Rules that hide missing parts. If one of them is broken, missing parts are not reported."""


def check(document: Document) -> list[RuleFinding]:
    """Return all findings in a file, by line."""
    if document.findings is None:  # `fix` and its caller call this again: a quarter of their time
        document.findings = _check(document)
    return list(document.findings)


def _check(document: Document) -> list[RuleFinding]:
    rules = [rule for rule in _CHECKS if not (document.file.is_xml and rule in _OF_TEXT)]
    found = list(dict.fromkeys(one for rule in rules for one in rule(document)))
    if document.file.is_xml and any(one.rule.name in _UNREADABLE for one in found):
        found = [one for one in found if one.rule.name in _UNREADABLE]
    return sorted(found, key=lambda one: one.line)


def severities(findings: Iterable[RuleFinding]) -> str:
    """Return the number of findings by severity, as `2 errors, 1 warning, 0 notes`."""
    counts = Counter(one.rule.severity for one in findings)
    return ", ".join(counted(counts[each], each.value) for each in Severity)


def failing(findings: Iterable[RuleFinding], *, strict: bool = False) -> list[RuleFinding]:
    """Return the findings that make `canmon eds check` fail.

    These are the errors, and with `strict` also the warnings.
    """
    count = (Severity.ERROR, Severity.WARNING) if strict else (Severity.ERROR,)
    return [one for one in findings if one.rule.severity in count]
