"""Runs each test with a bench twice; a difference between the two runs is a failure."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial
from hashlib import sha256
from itertools import zip_longest
from typing import Final

import pytest
from _pytest.runner import runtestprotocol

from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.mounts import LineMount
from tickrig.emulators.testing.plugin.journal_text import signals_of
from tickrig.emulators.testing.plugin.settings import MODES, PluginSettings
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.can import CanFrame, ErrorFrame

# All that is on the wires of a bench, and all that its devices show, line by line.


class Fingerprint:
    """Records everything that happens on a bench, in order to compare two runs of a test.

    The traffic and all changes of signals are recorded.

    Args:
        rig: the rig of the bench.

    Attributes:
        lines: the recorded events.
    """

    def __init__(self, rig: BenchRig) -> None:
        self._rig, self.lines = rig, list[str]()
        self._signals = signals_of(rig)
        self._values: dict[str, Setting] = {}
        for name, mount in rig.state.mounts.items():
            if isinstance(mount, LineMount):
                mount.tap.listeners.append(partial(self._pass, name))
            else:
                mount.wire.observers.append(partial(self._frame, name))
        rig.rig.watchers.append(self._look)
        self._look(rig.rig.now_us)

    def end(self) -> None:
        """Record the time of the end."""
        self._take(self._rig.rig.now_us, "(the end)")

    @property
    def digest(self) -> str:
        """The hash of all recorded events."""
        return sha256("\n".join(self.lines).encode()).hexdigest()

    def difference(self, other: Fingerprint) -> str:
        """Return the first difference between this run and a second run, or "" if there is none."""
        pairs = zip_longest(self.lines, other.lines, fillvalue="nothing")
        for number, (first, second) in enumerate(pairs, 1):
            if first != second:
                return f"line {number}\n  first run:  {first}\n  second run: {second}"
        return ""

    def _pass(self, wire: str, at_us: int, mark: Mark, data: bytes) -> None:
        self._take(at_us, f"{wire} {mark} {escape(data)}")

    def _frame(self, wire: str, at_us: int, frame: CanFrame | ErrorFrame) -> None:
        self._take(at_us, f"{wire} {frame}")

    def _look(self, now_us: int) -> None:
        for name, read in self._signals.items():
            value = read()
            if name not in self._values or self._values[name] != value:
                self._values[name] = value
                self._take(now_us, f"{name}={value}")

    def _take(self, at_us: int, text: str) -> None:
        self.lines.append(f"{format_time(at_us)} {text}")


_HASH: Final = "bench_hash"
"""Name of the property of a test that has the hash of the events on its bench."""

FINGERPRINT: Final[pytest.StashKey[Fingerprint | None]] = pytest.StashKey()
"""The events of the latest run of a test with a bench."""

_FIRST: Final[pytest.StashKey[Fingerprint]] = pytest.StashKey()
"""The events of the first run, while a test runs for the second time."""

_CALL: Final = pytest.StashKey[pytest.TestReport]()

_Reports = list[pytest.TestReport]


class Compare:
    """pytest plug-in for `--bench-compare`: runs each test twice, and compares the two runs.

    Args:
        config: the configuration of pytest.
        settings: the settings of the plug-in.

    Raises:
        pytest.UsageError: no test runs in virtual time.
    """

    def __init__(self, config: pytest.Config, settings: PluginSettings) -> None:
        if MODES[0] not in settings.modes:
            raise pytest.UsageError("--bench-compare compares runs in virtual time only")
        self._hashes: dict[str, str] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(
        self, item: pytest.Item, nextitem: pytest.Item | None
    ) -> bool | None:
        """Run a test twice, unless the first run has failed."""
        if "bench" not in getattr(item, "fixturenames", ()):
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in _run_twice(item, nextitem):
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
            item.stash[_CALL] = report
        elif call.when == "teardown" and (first := item.stash.get(_FIRST, None)):
            _judge(item, first, report)
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record the hash of a test, which another process may have run."""
        if report.when == "call":
            properties = dict(report.user_properties)
            if _HASH in properties:
                self._hashes[str(report.nodeid)] = str(properties[_HASH])

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Report how many tests were compared, and the hash of all tests."""
        lines = [f"{nodeid} {digest}\n" for nodeid, digest in sorted(self._hashes.items())]
        digest = sha256("".join(lines).encode()).hexdigest()
        same = "1 test was" if len(lines) == 1 else f"{len(lines)} tests were"
        terminalreporter.write_line(
            f"bench: {same} the same in both runs; hash of all {digest[:16]}"
        )


def _run_twice(item: pytest.Item, nextitem: pytest.Item | None) -> _Reports:
    """Run a test, and run it again if it passed; return the reports of the run that counts."""
    properties = list(item.user_properties)
    reports = _run(item, item.parent)  # what it shares with others stays
    before = _fingerprint(item)
    if before is None or not all(report.passed for report in reports):
        return [*reports, *_end(item, nextitem)]
    item.user_properties[:], item.stash[_FIRST] = properties, before
    return _run(item, nextitem)


def _run(item: pytest.Item, nextitem: pytest.Item | pytest.Collector | None) -> _Reports:
    return runtestprotocol(item, log=False, nextitem=nextitem)  # type: ignore[arg-type]


def _end(item: pytest.Item, nextitem: pytest.Item | None) -> _Reports:
    """Tear down the fixtures that a test shares with other tests; return the reports of errors."""
    end = partial(item.session._setupstate.teardown_exact, nextitem)
    call = pytest.CallInfo.from_call(end, when="teardown")
    if call.excinfo is None:
        return []
    return [item.ihook.pytest_runtest_makereport(item=item, call=call)]


def _fingerprint(item: pytest.Item) -> Fingerprint | None:
    return item.stash.get(FINGERPRINT, None)


def _judge(item: pytest.Item, first: Fingerprint, last: pytest.TestReport) -> None:
    """Fail a test if its runs differ; if they are equal, record their hash."""
    second, report = _fingerprint(item), item.stash.get(_CALL, None)
    if second is None or report is None:
        return
    if not (difference := first.difference(second)):
        for one in (report, last):
            one.user_properties.append((_HASH, second.digest))
        return
    if report.passed:
        report.outcome = "failed"
        report.longrepr = f"the second run differs from the first at {difference}"
    else:
        report.sections.append(("bench: the second run differs from the first", difference))
