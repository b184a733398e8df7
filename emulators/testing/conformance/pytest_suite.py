"""The conformance tester as a pytest suite: one test per check."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from traceback import format_exception_only
from typing import Any, Final, cast

import pytest

from tickrig.device.canopen.slave import CanopenSlave
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.errors import BenchBlocked
from tickrig.emulators.testing.conformance.bench_source import describe_slave
from tickrig.emulators.testing.conformance.conformance import (
    Node,
    conformance,
    known_failures,
    level_of,
    names_of,
    node_id_of,
)
from tickrig.emulators.testing.conformance.slave import is_step
from tickrig.host.canmon.conform.conformance import decoded_frames
from tickrig.host.canopen.conform.check import Check, ConformancePlan
from tickrig.host.canopen.conform.object_checks import object_checks
from tickrig.host.canopen.conform.report.baseline import Baseline
from tickrig.host.canopen.conform.report.overview import cut, hint
from tickrig.host.canopen.conform.suite import OBJECTS, chosen_checks
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report, Result
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import read_device

_MOST_LINES: Final = 60
_ANY_NODE_ID: Final = 1
"""Node-ID for the names of checks; the names do not depend on the node-ID."""

Test = Callable[..., None]


def conformance_tests(
    node: str | Callable[[], Node],
    *,
    eds: Path | str | None = None,
    level: str = "intrusive",
    only: str | Iterable[str] = (),
    baseline: Path | str | None = None,
    **options: Any,
) -> Test:
    """Return a test function for pytest, which has a parameter for each check.

    When the first check of a function is executed, all checks of this function that pytest has
    selected run together. A check that is not applicable is skipped. A check without a verdict is
    blocked, which is not a failure of the device.

    Args:
        node: a callable or a name. A callable makes the slave for `conformance`, or is the callable
            that `conformance` calls at each power-on. A name is the name of a device of the fixture
            `bench`, and each check then runs on a new bench.
        eds: EDS, DCF or XDD of the slave. Each object in the file has its own tests.
        level: level of the test: `read-only`, `communication` or `intrusive`, as for `conformance`.
        only: groups or ids of checks, with * and ?, as `"NMT,HB"` or as a sequence. By default all
            checks run.
        baseline: path of a file with known failures, one id per line. These checks are expected to
            fail. Ids that are not checks cause a warning.
        options: further arguments of `conformance`.

    Raises:
        ValueError: the level is unknown, a word of `only` matches no check, or there is no node-ID.
        OSError: the EDS or the baseline cannot be read.

    >>> from tickrig.device import make_epos
    >>> test_drive = conformance_tests(lambda: make_epos(5), only="NMT")
    """
    __tracebackhide__ = True
    plan = ConformancePlan(level_of(level), names_of(only))
    known = read_device(open_eds(Path(eds))) if eds is not None else None
    given = options.get("node_id")
    if not isinstance(node, str) and (known is None or given is None):
        made = _judged_of(node)
        node_id_of(made, given)
        known = known or (describe_slave(made).device if isinstance(made, CanopenSlave) else None)
    options |= {"eds": eds, "level": level}
    objects: tuple[Check, ...] = ()
    if known is not None and plan.may_choose(OBJECTS):
        objects = object_checks(known, _ANY_NODE_ID, may_choose=plan.may_choose)
    known_to_fail = known_failures(baseline)
    names = [check.id for check in (*chosen_checks(plan), *filter(plan.chooses, objects))]
    parametrised = pytest.mark.parametrize("check_id", names)
    if isinstance(node, str):
        return parametrised(_test_on_bench(node, options, known_to_fail))
    return parametrised(_Run(node, options, known_to_fail).test())


def _judged_of(make: Callable[[], Node]) -> Node:
    """Return the argument of `conformance`: the object made by `make`, or a factory."""
    made = make()
    return cast("Node", make) if is_step(made) else made


def _test_on_bench(name: str, options: dict[str, Any], baseline: Baseline) -> Test:
    def test(bench: Bench, check_id: str) -> None:
        __tracebackhide__ = True
        report = conformance(bench[name], only=check_id, **options)
        _judge(report, check_id, baseline)

    return test


@dataclass
class _Unmade:
    """A failed run. Its exception is raised only once, because each raise extends the traceback."""

    error: Exception
    raised: bool = False


class _Run:
    """The run of the selected checks, started by the first selected check."""

    def __init__(
        self, make: Callable[[], Node], options: dict[str, Any], baseline: Baseline
    ) -> None:
        self._make, self._options, self._baseline = make, options, baseline
        self._reports: dict[frozenset[str], Report | _Unmade] = {}

    def test(self) -> Test:
        """Return the test function."""

        def test(request: pytest.FixtureRequest, check_id: str) -> None:
            __tracebackhide__ = True
            _judge(self._report(request.node, check_id), check_id, self._baseline)

        return test

    def _report(self, item: pytest.Function, check_id: str) -> Report:
        wanted = frozenset(_selected(item)) or frozenset({check_id})
        if wanted not in self._reports:
            self._reports[wanted] = self._judged(wanted)
        report = self._reports[wanted]
        if not isinstance(report, Report):
            if report.raised:
                text = format_exception_only(report.error)[-1].strip()
                pytest.fail(f"as before: {text}", pytrace=False)
            report.raised = True
            raise report.error
        return report

    def _judged(self, wanted: Iterable[str]) -> Report | _Unmade:
        """Run the checks once; a failed run is not repeated for each test."""
        try:
            return conformance(_judged_of(self._make), only=sorted(wanted), **self._options)
        except Exception as error:
            return _Unmade(error)


def _selected(item: pytest.Function) -> Iterable[str]:
    """Yield the checks of this function that pytest has selected."""
    for each in item.session.items:
        if isinstance(each, pytest.Function) and each.function is item.function:
            yield str(each.callspec.params["check_id"])


def _judge(report: Report, check_id: str, baseline: Baseline) -> None:
    """Report the verdict of a check: passed, failed, skipped or blocked."""
    result = next((one for one in report.results if one.check.id == check_id), None)
    if result is None:
        raise BenchBlocked(report.aborted or f"{check_id} was not judged")
    verdict, reason = result.outcome.verdict, result.outcome.reason
    match verdict:
        case CheckVerdict.FAIL if baseline.knows(result):
            pytest.xfail(f"known: {reason}")
        case CheckVerdict.FAIL:
            pytest.fail(_text(result, report.node_id), pytrace=False)
        case CheckVerdict.NOT_APPLICABLE:
            pytest.skip(reason)
        case CheckVerdict.INCONCLUSIVE | CheckVerdict.BLOCKED:
            raise BenchBlocked(
                reason if verdict is CheckVerdict.BLOCKED else f"{verdict}: {reason}"
            )
        case _:
            return


def _text(result: Result, node_id: int) -> str:
    check = result.check
    frames = cut(decoded_frames({})(result.outcome.evidence), _MOST_LINES)
    where = [f"look at {text}"] if (text := hint(result)) else []
    head = f"{check.id}: {check.title}"
    return "\n".join([result.outcome.reason, head, check.source, *frames, *where])
