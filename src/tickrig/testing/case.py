"""Tests of the standard library's unittest, each with a bench of its own."""

from __future__ import annotations

import unittest
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, ClassVar

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.plugin.journal_text import last_lines

_LINES = 20


class BenchTestCase(unittest.TestCase):
    """Base class for unittest test cases: each test gets a new bench, which is closed at its end.

    Derive your test case from this class and write `make_bench`. A test is skipped if it uses an
    operation that the bench cannot do. The error of a failed test has a note with the last lines
    and frames of the bench.

    Attributes:
        bench: the bench of the present test, from `setUp` on.
        patched: whether hosts that call `time.sleep` and `time.monotonic` use the bench's time.

    >>> import io
    >>> class ChairTest(BenchTestCase):
    ...     def make_bench(self):
    ...         return Bench("rrc")
    ...     def test_it_is_off(self):
    ...         self.bench.run_for("1s")
    ...         self.assertEqual(self.bench.get("state"), "WaitPowerOn")
    >>> unittest.TextTestRunner(io.StringIO()).run(ChairTest("test_it_is_off"))
    <unittest.runner.TextTestResult run=1 errors=0 failures=0>
    """

    patched: ClassVar[bool] = True

    bench: Bench

    def make_bench(self) -> Bench:
        """Return a new bench; `setUp` calls this method before each test."""
        raise NotImplementedError(f"{type(self).__name__} makes no bench: write make_bench")

    def setUp(self) -> None:
        """Open the bench; a method that overrides this one calls it first."""
        super().setUp()
        with _skipped():
            self.bench = self.enterContext(self.make_bench())
            if self.patched:
                self.enterContext(self.bench.patched_time())

    def run(self, result: unittest.TestResult | None = None) -> unittest.TestResult | None:
        """Run the test, as unittest and pytest do.

        Args:
            result: object that collects the result of the test.
        """
        name = self._testMethodName
        setattr(self, name, self._noted(getattr(self, name)))
        return super().run(result)

    def _noted(self, test: Callable[[], Any]) -> Callable[[], Any]:
        """Return the test; if it fails, the error has a note with the last lines and frames."""

        @wraps(test)
        def run_test() -> Any:
            with _skipped():
                try:
                    returned = test()
                    self.bench.check_tasks()
                    if hung := self.bench._mode.hung():
                        self.fail(hung)
                except (NotOnThisBench, unittest.SkipTest):
                    raise
                except Exception as error:
                    error.add_note(f"what passed last:\n{last_lines(self.bench, _LINES)}")
                    raise
            return returned

        return run_test


@contextmanager
def _skipped() -> Iterator[None]:
    """Skip a test that uses an operation that its bench cannot do."""
    try:
        yield
    except NotOnThisBench as error:
        raise unittest.SkipTest(str(error)) from None
