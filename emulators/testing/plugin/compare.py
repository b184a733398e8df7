"""Each test that has a bench, run twice: what differs between the two is a failure."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial
from hashlib import sha256
from typing import TYPE_CHECKING, Final

import pytest
from _pytest.runner import runtestprotocol

from tickrig.emulators.testing.plugin.stash import BENCHED

if TYPE_CHECKING:
    from tickrig.emulators.testing.plugin.evidence.fingerprint import Fingerprint

HASH: Final = "bench_hash"
"""The property of a test that has the hash of all that happened on its bench."""

FIRST: Final[pytest.StashKey[Fingerprint]] = pytest.StashKey()
"""Of the first run, while a test runs for the second time."""

CALL: Final = pytest.StashKey[pytest.TestReport]()

Reports = list[pytest.TestReport]


class Compare:
    """The plug-in of `--bench-compare`."""

    def __init__(self) -> None:
        self._hashes: dict[str, str] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(
        self, item: pytest.Item, nextitem: pytest.Item | None
    ) -> bool | None:
        """Run a test twice, unless the first run says enough."""
        if "bench" not in getattr(item, "fixturenames", ()):
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in run_twice(item, nextitem):
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Judge a test when its second run is over."""
        report = yield
        if call.when == "call":
            item.stash[CALL] = report
        elif call.when == "teardown" and (first := item.stash.get(FIRST, None)):
            _judge(item, first, report)
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note the hash of a test, of whatever process."""
        if report.when == "call":
            properties = dict(report.user_properties)
            if HASH in properties:
                self._hashes[str(report.nodeid)] = str(properties[HASH])

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say how many tests were compared, and the hash of all."""
        lines = [f"{nodeid} {digest}\n" for nodeid, digest in sorted(self._hashes.items())]
        digest = sha256("".join(lines).encode()).hexdigest()
        same = "1 test was" if len(lines) == 1 else f"{len(lines)} tests were"
        terminalreporter.write_line(
            f"bench: {same} the same in both runs; hash of all {digest[:16]}"
        )


def run_twice(item: pytest.Item, nextitem: pytest.Item | None) -> Reports:
    """Run a test, and again if it passed; return the reports of the run that counts."""
    properties = list(item.user_properties)
    reports = _run(item, item.parent)  # what it shares with others stays
    before = _fingerprint(item)
    if before is None or not all(report.passed for report in reports):
        return [*reports, *_end(item, nextitem)]
    item.user_properties[:], item.stash[FIRST] = properties, before
    return _run(item, nextitem)


def _run(item: pytest.Item, nextitem: pytest.Item | pytest.Collector | None) -> Reports:
    return runtestprotocol(item, log=False, nextitem=nextitem)  # type: ignore[arg-type]


def _end(item: pytest.Item, nextitem: pytest.Item | None) -> Reports:
    """Give back what a test shared with others, which there are none of."""
    end = partial(item.session._setupstate.teardown_exact, nextitem)
    call = pytest.CallInfo.from_call(end, when="teardown")
    if call.excinfo is None:
        return []
    return [item.ihook.pytest_runtest_makereport(item=item, call=call)]


def _fingerprint(item: pytest.Item) -> Fingerprint | None:
    test = item.stash.get(BENCHED, None)
    return test.fingerprint if test else None


def _judge(item: pytest.Item, first: Fingerprint, last: pytest.TestReport) -> None:
    """Fail a test whose runs differ; note the hash of one whose runs are the same."""
    second, report = _fingerprint(item), item.stash.get(CALL, None)
    if second is None or report is None:
        return
    if not (difference := first.difference(second)):
        for one in (report, last):
            one.user_properties.append((HASH, second.digest))
        return
    if report.passed:
        report.outcome = "failed"
        report.longrepr = f"the second run differs from the first at {difference}"
    else:
        report.sections.append(("bench: the second run differs from the first", difference))
