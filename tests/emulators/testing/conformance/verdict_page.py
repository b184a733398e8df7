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

This page lists the results of [`canmon conform --intrusive`](conform.md) for our slaves and for two
stacks of other projects, in virtual time. `tools/conform-stacks` writes the page. With the same
versions of all programs, the page is always the same.

A verdict is about one program that uses a stack, and not about the stack alone. Each program on
this page has those objects of our reference slave R1 that its stack supports. The program moves
inputs and raises errors as far as the stack allows it, and does nothing else. For example, a stack
may leave it to the application which values an object has after a reset. The check of these values
then fails on this page, but a device with the same stack may pass it.

"""
BY_HAND: Final = """## CANopenNode and Lely

CANopenNode and Lely are not on this page, because they are written in C and cannot be installed
from a registry of Python packages. [Another page](conformance-by-hand.md) has their results.
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
        f"The file `tests/golden/canopen/foreign_verdicts.txt` has the results of another tester,"
        f" with {len(read_table(stack)) - 1} checks. For {found.both} of these checks, our tester"
        f" has a verdict, too. In {found.same} of these {found.both} checks the two verdicts are"
        " the same."
    )
    if found.differences:
        yield "\nThe two testers differ in these checks:\n"
    for one in found.differences:
        yield f"- {one.check_id}: the other tester reports {one.public}, our tester {one.here}."
        if one.reason:
            yield f"  The reason: {one.reason}."
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
