"""A test with its bench: opened before it, looked at after it, closed in any case."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pytest

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.plugin.bench_source import BenchSource, Wanted, fresh
from tickrig.emulators.testing.plugin.failure_report import sections_of
from tickrig.emulators.testing.plugin.health import Health
from tickrig.emulators.testing.plugin.needs import allowed_of, check_mode, check_needs, needs_of
from tickrig.emulators.testing.plugin.safe_state import SafeState, unsafe
from tickrig.emulators.testing.plugin.settings import SETTINGS
from tickrig.emulators.testing.plugin.stash import BENCHED
from tickrig.emulators.testing.plugin.verdict import blocked, make_error


class BenchedTest:
    """A test, and its bench.

    Args:
        item: the test.
        wanted: what it asked for.
        safe: what outputs are when it is over.

    Attributes:
        bench: its bench, from the moment at which it is open.
    """

    def __init__(self, item: pytest.Item, wanted: Wanted, safe: SafeState) -> None:
        self.item, self.wanted, self._safe = item, wanted, safe
        self.bench: Bench | None = None
        self._health: Health | None = None
        self._allowed: tuple[str, ...] = ()

    def open(self) -> Bench:
        """Open the bench.

        Raises:
            NotOnThisBench: it has not what the test needs.
            ValueError: the test asks for what nobody has.
        """
        needs, self._allowed = needs_of(self.item), allowed_of(self.item)
        check_mode(needs, self.wanted.mode)
        self.wanted = self.wanted._replace(source=fresh(self.item, self.wanted.source))
        bench = self.bench = self.wanted.open()
        check_needs(needs, bench)
        with suppress(NotOnThisBench):
            self._health = bench._mode.act(Health)
        return bench

    def close(self) -> None:
        """Give everything back."""
        if self.bench is not None:
            self.bench.close()

    def run_body(self, function: pytest.Function) -> None:
        """Run an async test: time of the bench passes while it waits."""
        assert self.bench is not None
        names = function._fixtureinfo.argnames
        self.bench.run(function.obj(**{name: function.funcargs[name] for name in names}))

    def check(self) -> None:
        """Fail the test if it leaves its bench in a state in which none may be."""
        assert self.bench is not None
        complaints = self._health.complaints(self._allowed) if self._health else ()
        if found := [*complaints, *unsafe(self.bench, self._safe)]:
            text = "after the test the bench is not as it has to be:"
            pytest.fail("\n".join([text, *found]), pytrace=False)

    def judge(self, report: pytest.TestReport, call: pytest.CallInfo[None]) -> None:
        """Say what blocked a phase of the test, and tell with a failure what there is to know."""
        if reason := blocked(report, call, self.bench):
            make_error(report, reason)
        if report.failed:
            report.sections += sections_of(self)


@contextmanager
def benched(
    request: pytest.FixtureRequest, source: BenchSource, mode: str, safe: SafeState
) -> Iterator[Bench]:
    """Give a test its bench."""
    settings = request.config.stash[SETTINGS]
    wanted = Wanted(source, mode, settings.seed, request.path.parent)
    test = request.node.stash[BENCHED] = BenchedTest(request.node, wanted, safe)
    try:
        yield _opened(test)
    finally:
        test.close()


def _opened(test: BenchedTest) -> Bench:
    """Open the bench; what is wrong with what was asked needs no traceback."""
    try:
        return test.open()
    except ValueError as error:
        raise pytest.fail.Exception(f"no bench: {error}", pytrace=False) from None
