"""A test with its bench, which is opened before, checked after the test, and always closed."""

from __future__ import annotations

import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import pytest

from tickrig._lazy import LazyModule
from tickrig.emulators.testing.bench.bench import VIRTUAL, Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import BenchBlocked, NotOnThisBench
from tickrig.emulators.testing.bench.mounts import LineMount
from tickrig.emulators.testing.host_clock.host_code import HostTimeError, UnpatchedTimeError
from tickrig.emulators.testing.plugin import bench_source
from tickrig.emulators.testing.plugin.bench_source import WarmUp, warmed
from tickrig.emulators.testing.plugin.compare import FINGERPRINT, Fingerprint
from tickrig.emulators.testing.plugin.failure_report import keep, sections_of
from tickrig.emulators.testing.plugin.health import (
    LONG_WAITS,
    THREADS,
    Health,
    SafeState,
    check_safe,
    dead_threads,
    guard,
    never_awaited,
    unsafe,
    with_plan,
)
from tickrig.emulators.testing.plugin.settings import NO_LIMIT, SETTINGS
from tickrig.emulators.testing.plugin.stash import BENCHED, TestWithBench
from tickrig.emulators.testing.plugin.verdict import MisusedError, blocked, make_error

if TYPE_CHECKING:
    from tickrig.emulators.testing.plugin import bench_evidence
else:
    bench_evidence = LazyModule("tickrig.emulators.testing.plugin.bench_evidence")  # for reports

# Theory of operation
# ===================
#
# Each phase of a test in pytest calls this module, in this order:
#
# setup: `open`. A test that its markers or its mode exclude is skipped before anything is opened.
# Then the bench is opened and warmed up. Then two things are checked: whether the bench lacks
# something of `needs` (known only of an open bench), and whether the safe values of outputs are
# valid. `Health` starts last, so faults that a warm-up has left on count as requested.
#
# call: `judged`, around the body. Only if the body has passed, the bench is checked: tasks, errors
# in threads and coroutines, health, outputs. A failed test may leave its bench in any state,
# because its own failure is what people want to read.
#
# report of each phase: `judge`. For each failure it determines whether the bench is the cause.
# Artifacts are kept at the first failure, once, while the bench is still open. An exception here
# would end the whole run of pytest, so it becomes a section of the report.
#
# teardown: `close`. Evidence and artifacts of passed tests are taken before the bench is closed.
# Errors outside the body that occurred after it had passed fail the test here.
#
# Threads and coroutines are watched from before the bench is opened until after it is closed,
# because a host may start a thread while the bench is opened.
#
# Errors of the bench: a test without a verdict about the device is an error and not a failure.
# pytest and JUnit call it an error if it happened in setup, so `make_error` (verdict.py) reports
# setup as its phase. A mistake of the test, such as a misspelt name, never counts as an error of a
# bench that was too slow (`is_mistake`).


class _BenchedTest(TestWithBench):
    """A test and its bench.

    Args:
        item: the test.
        wanted: the requested bench.
        safe: the safe values of outputs at the end of the test.
        warm_up: function that prepares the bench before the test.

    Attributes:
        fingerprint: events on the bench, if two runs are compared.
    """

    def __init__(
        self,
        item: pytest.Function,
        wanted: bench_source.WantedBench,
        safe: SafeState,
        warm_up: WarmUp = None,
    ) -> None:
        super().__init__(item, wanted)
        self._safe, self._warm_up = safe, warm_up
        self._settings = item.config.stash[SETTINGS]
        item.stash[FINGERPRINT] = None
        self.fingerprint: Fingerprint | None = None
        self._witness: bench_evidence.BenchWitness | None = None
        self._health: Health | None = None
        self._allowed: tuple[str, ...] = ()
        self._passed, self._stack, self._others = False, ExitStack(), threading.enumerate()
        self._is_misused = False

    def open(self) -> Bench:
        """Open the bench of the test, run its warm-up, and start the checks of the bench.

        Raises:
            NotOnThisBench: the bench lacks something that the test needs.
            ValueError: the test needs something unknown.
        """
        needs, self._allowed = bench_source.needs_of(self.item), bench_source.allowed_of(self.item)
        bench_source.check_mode(needs, self.wanted.mode)
        if LONG_WAITS in self._allowed:
            self.wanted = self.wanted._replace(limit=NO_LIMIT)
        self._listen()
        self.wanted = self.wanted.settled(self.item)
        bench = self.bench = warmed(self.item, self.wanted.open(), self._warm_up)
        bench_source.check_needs(needs, bench)
        self._safe = with_plan(self._safe, self.wanted.safe, bench)
        check_safe(bench, self._safe)
        _offer(bench)
        self._health = Health(bench)
        if self._settings.report:
            self._witness = bench_evidence.BenchWitness(bench)
        if self._settings.compare and bench.mode == VIRTUAL:
            self.fingerprint = self.item.stash[FINGERPRINT] = bench._mode.act(Fingerprint)
        return bench

    def _listen(self) -> None:
        """Collect errors that no assert checks, from before the bench is opened."""
        if THREADS not in self._allowed:
            self._stack.enter_context(dead_threads(self.unheard.append))
        self._stack.enter_context(never_awaited(self._misused))

    def _misused(self, text: str) -> None:
        self.unheard.append(text)
        self._is_misused = True

    def close(self) -> None:
        """Close the bench of the test.

        If the body of the test has passed but an error has occurred since, the test fails.
        """
        since = self.take_unheard() if self._passed else []
        with self._stack:
            if self.bench is not None:
                self._close(self.bench)
        if since:
            pytest.fail("\n".join(since), pytrace=False)

    def _close(self, bench: Bench) -> None:
        """Keep files of a passed test, too, if configured, and close the bench."""
        try:
            if self.fingerprint is not None:
                self.fingerprint.end()
            if self._settings.every:
                self._keep()
            if self._witness is not None:
                self.evidence = self._witness.evidence()
        finally:
            bench.close()

    def _keep(self) -> None:
        """Keep the configured files, once."""
        folder = self._settings.artifacts
        if folder and self.bench and not (self.kept or self.not_kept):
            self.kept, self.not_kept = keep(self.bench, folder, str(self.item.nodeid))

    def run_body(self, function: pytest.Function) -> None:
        """Run an async test: time of the bench passes while it waits."""
        assert self.bench is not None
        names = function._fixtureinfo.argnames
        self.bench.run(function.obj(**{name: function.funcargs[name] for name in names}))

    @contextmanager
    def judged(self) -> Iterator[None]:
        """Check the test that runs in this `with` block.

        The test fails if it uses the clock of the machine, or leaves its bench in a bad state.
        """
        assert self.bench is not None
        over = False
        try:
            with guard(self.bench.mode, self._allowed, self._others):
                yield
                over = True
        except UnpatchedTimeError as error:  # swallowed by the host, if the test has ended
            if not over:
                raise
            raise pytest.fail.Exception(str(error), pytrace=False) from None
        self._check(self.bench)

    def _check(self, bench: Bench) -> None:
        """Check the bench of a test that has passed; fail the test if there is a problem."""
        bench.check_tasks()
        if hung := bench._mode.hung():  # and the host has caught the error
            pytest.fail(hung, pytrace=False)
        if unheard := self.take_unheard():
            fail = MisusedError if self._is_misused else pytest.fail.Exception
            raise fail("\n".join(unheard), pytrace=False)
        found = list(self._health.complaints(self._allowed)) if self._health else []
        try:
            found += unsafe(bench, self._safe)
        except NotOnThisBench as error:  # no reason to skip a test that has passed
            refusal = f"bench_safe cannot be checked: {error}"
            if not found:
                raise BenchBlocked(f"the test has passed, but {refusal}") from None
            found.append(refusal)
        if found:
            text = "after the test the bench is not as it has to be:"
            pytest.fail("\n".join([text, *found]), pytrace=False)
        self._passed = True
        for fault in bench._mode.never_begun:
            warnings.warn_explicit(
                f"a fault of this test never began: {fault}",
                pytest.PytestWarning,
                str(self.item.path),
                (self.item.reportinfo()[1] or 0) + 1,
            )

    def judge(
        self, report: pytest.TestReport, call: pytest.CallInfo[None], *, mistaken: bool
    ) -> None:
        """Complete pytest's report of a phase of the test with data of the bench.

        If the bench made the phase impossible, for example because a port is missing, the report
        becomes an error with this reason. The report of a failure gets the evidence of the bench.

        Args:
            report: report of the phase: setup, call or teardown.
            call: result of the phase.
            mistaken: whether the cause of a failure is a mistake in the test.
        """
        try:
            self._judge(report, call, mistaken=mistaken)
        except Exception as error:  # whatever broke the bench: the report of the test is made
            report.sections.append(("bench", f"it is broken: {error!r}"))

    def _judge(
        self, report: pytest.TestReport, call: pytest.CallInfo[None], *, mistaken: bool
    ) -> None:
        if reason := blocked(report, call, self.bench, mistaken=mistaken):
            self.blocked = reason
            make_error(report, reason)
        if report.failed:
            self._keep()
            report.sections += sections_of(self)


@contextmanager
def benched(
    request: pytest.FixtureRequest,
    source: bench_source.BenchSource,
    mode: str,
    safe: SafeState,
    warm_up: WarmUp = None,
) -> Iterator[Bench]:
    """Yield the bench of a test."""
    settings = request.config.stash[SETTINGS]
    if settings.rig_file and (settings.ordered or source is None):
        source = settings.rig_file
    folder = request.path.parent
    wanted = bench_source.WantedBench(source, mode, settings.seed, folder, settings.limit)
    test = request.node.stash[BENCHED] = _BenchedTest(request.node, wanted, safe, warm_up)
    try:
        yield _opened(test)
    finally:
        test.close()


@contextmanager
def clocked(bench: Bench) -> Iterator[Any]:
    """Run a test with the clock of its bench in place of the machine's.

    The test fails if a host waits at a place where waiting is impossible, such as in a callback.
    """
    try:
        with bench.patched_time() as clock:
            yield clock
    except HostTimeError as error:
        raise pytest.fail.Exception(str(error), pytrace=False) from None


def _offer(bench: Bench) -> None:
    """Offer the wires under their names to hosts that open a port or a bus themselves."""
    mode = bench._mode
    for wire, library in mode.act(_libraries) if bench.mode == VIRTUAL else ():
        if library in sys.modules:
            mode.doors.address(wire)


def _libraries(rig: BenchRig) -> list[tuple[str, str]]:
    """Return the libraries by which hosts open each wire."""
    mounts = rig.state.mounts.values()
    return [(one.name, "serial" if isinstance(one, LineMount) else "can") for one in mounts]


def _opened(test: _BenchedTest) -> Bench:
    """Open the bench; an error in the request is reported without a traceback."""
    try:
        return test.open()
    except (ValueError, OSError) as error:
        raise pytest.fail.Exception(f"no bench: {error}", pytrace=False) from None
