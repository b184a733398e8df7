"""Data of a test while it runs, and a skip of tests that their bench cannot run."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Final

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from tickrig.emulators.testing.bench.bench import Bench
    from tickrig.emulators.testing.plugin.bench_evidence import BenchEvidence
    from tickrig.emulators.testing.plugin.bench_source import WantedBench


class TestWithBench(ABC):
    """State that the pytest plug-in keeps for a test with a bench.

    Attributes:
        bench: bench of the test, once the bench is open.
        evidence: data of the bench for a report, once the bench is closed.
        blocked: reason why the test came to no verdict, or empty if it came to a verdict.
        unheard: errors outside the body of the test that were not reported yet, one per line.
        kept: files about a failed test that were written.
        not_kept: reasons why other files were not written, or not completely, one per line.

    Args:
        item: the test.
        wanted: bench that the test requested.
    """

    __test__ = False

    def __init__(self, item: pytest.Function, wanted: WantedBench) -> None:
        self.item, self.wanted = item, wanted
        self.bench: Bench | None = None
        self.evidence: BenchEvidence | None = None
        self.blocked = ""
        self.unheard: list[str] = []
        self.kept: list[Path] = []
        self.not_kept: list[str] = []

    def take_unheard(self) -> list[str]:
        """Return the errors outside the body of the test that were not reported yet."""
        told = list(self.unheard)
        del self.unheard[: len(told)]
        return told

    @abstractmethod
    def judged(self) -> AbstractContextManager[None]:
        """Return a context manager in which the test runs and is checked.

        The test fails if it uses the clock of the machine, or leaves its bench in a bad state.
        """

    @abstractmethod
    def judge(
        self, report: pytest.TestReport, call: pytest.CallInfo[None], *, mistaken: bool
    ) -> None:
        """Complete the report of a phase of the test."""

    @abstractmethod
    def run_body(self, function: pytest.Function) -> None:
        """Run an async test: time of the bench passes while it waits."""


BENCHED: Final[pytest.StashKey[TestWithBench]] = pytest.StashKey()
"""Data of a test that has requested a bench."""

_ERRORS: Final = "tickrig.emulators.testing.bench.errors"


def is_blocked(error: BaseException) -> bool:
    """Return whether a test came to no verdict about its device."""
    errors = sys.modules.get(_ERRORS)
    return errors is not None and isinstance(error, errors.BenchBlocked)


@contextmanager
def skipped_where_it_cannot() -> Iterator[None]:
    """Skip the test if it uses an operation that its bench cannot do."""
    try:
        yield
    except Exception as error:
        errors = sys.modules.get(_ERRORS)
        if errors is None or not isinstance(error, errors.NotOnThisBench):
            raise
        skip = pytest.skip.Exception(str(error), _use_item_location=True)
        raise skip.with_traceback(error.__traceback__) from None
