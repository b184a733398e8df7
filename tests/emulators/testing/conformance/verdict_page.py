"""docs/reference/canopen/conformance.md: what the tester says of our slaves and of others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.metadata import version
from typing import Final, NamedTuple

from tests.emulators.testing.conformance.stacks import judge_durand, judge_local_node, judge_ours
from tests.emulators.testing.conformance.verdict_table import compare, read_table
from tests.environment import ROOT
from tickrig import Bench
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report, Result
from tickrig.testing import conformance

PAGE: Final = ROOT / "docs" / "reference/canopen/conformance.md"
OBJECTS: Final = "OD"
SHOWN: Final = (
    CheckVerdict.PASS,
    CheckVerdict.FAIL,
    CheckVerdict.IMPLEMENTATION_DEFINED,
    CheckVerdict.INCONCLUSIVE,
    CheckVerdict.BLOCKED,
    CheckVerdict.NOT_APPLICABLE,
)
HEAD: Final = """# Verdicts on CANopen stacks

What [`canmon conform --intrusive`](conform.md) reports about our slaves and two foreign stacks, in
virtual time. `tools/conform-stacks` writes this page. The same versions give the same page.

A verdict is about a slave as it was built for this page. Its objects are the objects of the
reference dictionary R1 that the stack supports. The application moves inputs and raises errors as
far as the stack allows it, and does nothing else. A stack leaves some behaviour to the application,
such as the values after a reset. Such behaviour fails here, but it may pass for a device with the
same stack.

"""
BY_HAND: Final = """## CANopenNode and Lely

CANopenNode and Lely are written in C, and are not in a registry of Python packages. We compared
their verdicts [by hand](conformance-by-hand.md).
"""
MOST: Final = 160
"""Characters of what came: what else had been allowed is in a run of one's own."""


class Subject(NamedTuple):
    """Something to judge.

    Attributes:
        name: for people.
        judge: judges it.
    """

    name: str
    judge: Callable[[], Report]


FOREIGN: Final = (
    ("LocalNode", f"LocalNode of canopen {version('canopen')}", judge_local_node),
    ("durand", f"durand {version('durand')}", judge_durand),
)
MODELS: Final = ("f-palette", "motor-core-unit", "epos")


def page() -> str:
    """Return the page."""
    reports = {name: judge() for name, judge in _subjects()}
    foreign = {name: judge() for _, name, judge in FOREIGN}
    parts = [HEAD + "\n".join(_table({**reports, **foreign}))]
    for stack, name, _ in FOREIGN:
        parts += ["\n".join(_section(stack, name, foreign[name]))]
    return "\n\n".join([*parts, BY_HAND])


def _subjects() -> Iterator[Subject]:
    yield Subject("R1, the reference slave", judge_ours)
    for model in MODELS:
        yield Subject(model, lambda model=model: _judge_model(model))  # type: ignore[misc]


def _judge_model(model: str) -> Report:
    with Bench(model) as bench:
        return conformance(bench)


def _table(reports: dict[str, Report]) -> Iterator[str]:
    yield f"| | {' | '.join(map(str, SHOWN))} |"
    yield "|---|" + "---|" * len(SHOWN)
    for name, report in reports.items():
        counts = " | ".join(str(report.count(verdict)) for verdict in SHOWN)
        yield f"| {name} | {counts} |"


def _section(stack: str, name: str, report: Report) -> Iterator[str]:
    found = compare(report, read_table(stack))
    yield f"## {name}\n"
    yield (
        f"Another tester has verdicts for {len(read_table(stack)) - 1} of the checks."
        f" Both testers judged {found.both} checks; {found.same} of these verdicts are the same."
    )
    for one in found.differences:
        why = f" ({one.reason})" if one.reason else ""
        yield f"{one.check_id} differs: the other tester has {one.public}, we have {one.here}{why}."
    failed = [one for one in report.results if one.outcome.verdict is CheckVerdict.FAIL]
    yield "\n| check | clause | what came |\n|---|---|---|"
    for result in failed:
        if result.check.group != OBJECTS:
            yield _row(result)
    yield from _objects([one for one in failed if one.check.group == OBJECTS])


def _row(result: Result) -> str:
    check = result.check
    cells = (f"{check.id}: {check.title}", check.source, _short(result.outcome.reason))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _short(reason: str) -> str:
    return reason if len(reason) <= MOST else f"{reason[:MOST].rpartition(' ')[0]} ..."


def _objects(failed: list[Result]) -> Iterator[str]:
    """Tell of the checks of each object: one of a kind stands for all that failed alike."""
    kinds: dict[str, list[Result]] = {}
    for result in failed:
        kinds.setdefault(result.check.id.rsplit("-", 1)[1], []).append(result)
    if kinds:
        yield "\nFailed checks of objects, with one example of each kind:\n"
        yield "| kind | failed | example | what came |\n|---|---|---|---|"
    for kind, results in sorted(kinds.items()):
        example = results[0]
        title = example.check.title.replace("|", "\\|")
        yield f"| {kind} | {len(results)} | {title} | {_short(example.outcome.reason)} |"
