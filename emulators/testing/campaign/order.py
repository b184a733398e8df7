"""Requests of a campaign to its workers, and their verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.emulators.testing.report.bench_report import Outcome
from tickrig.host.text.values import counted

_OPTIONS: Final = (
    *("-p", "no:cacheprovider", "--capture=no", "--tb=short", "--bench-mode", "virtual"),
    *("-o", "tmp_path_retention_policy=none", "-o", "bench_report=", "-o", "bench_artifacts="),
    *("-o", "bench_compare="),
)
"""Options of pytest in a worker: no output, no cache, no capture reports."""


class CampaignRefusal(Exception):  # noqa: N818 - what a campaign cannot do; nothing is broken
    """An operation of a campaign is impossible; the message is one line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignOrder:
    """Options by which each worker of a campaign collects and runs the tests.

    Attributes:
        tests: files, folders and node IDs, as in the command line of pytest.
        parameters: parameters of the tests, as in `--bench-param`.
        bench: path of the rig file, or empty to use the rig file of the tests.
        keyword: expression that selects tests, as in `-k`, or empty for all tests.
        timeout_s: time-out of a run, in seconds.
        folder: absolute path of the folder in which the tests are searched.
        version: version of tickrig.
    """

    tests: tuple[str, ...]
    parameters: tuple[str, ...] = ()
    bench: str = ""
    keyword: str = ""
    timeout_s: float = 60.0
    folder: str = ""
    version: str = ""

    def words(self) -> list[str]:
        """Return the command line of pytest."""
        words = [*_OPTIONS]
        for parameter in self.parameters:
            words += ["--bench-param", parameter]
        for flag, value in (("--bench", self.bench), ("-k", self.keyword)):
            words += [flag, value] if value else []
        return [*words, "--", *self.tests]


class CollectedTest(NamedTuple):
    """A test of a campaign, which is run with many seeds.

    Attributes:
        nodeid: node ID as pytest reports it, relative to pytest's root folder.
        values: values of the test's parameters, as written in the command line.
        place: node ID relative to the folder in which the campaign was started, as in a command
            line of pytest.
    """

    nodeid: str
    values: Mapping[str, str]
    place: str


class Collected(NamedTuple):
    """The tests that a worker of a campaign has collected.

    Attributes:
        tests: tests that use a bench.
        left_out: tests that use no bench, as pytest's node IDs. The campaign does not run them.
        digest: hash of the files of the tests, and of the project's modules that these files
            import.
    """

    tests: tuple[CollectedTest, ...]
    left_out: tuple[str, ...]
    digest: str


class Run(NamedTuple):
    """One run of a campaign: a test with a seed.

    Attributes:
        number: number of the run in the campaign.
        nodeid: node ID of the test.
        seed: seed of all random numbers.
    """

    number: int
    nodeid: str
    seed: int


class RunVerdict(NamedTuple):
    """Outcome of one run of a campaign, with the reason.

    Attributes:
        number: number of the run in the campaign.
        outcome: `passed`, `failed`, `error`, `blocked`, `skipped`, `hung` or `died`. The outcome is
            `hung` if the run took too long. If the worker process ends during the run, the run is
            repeated. If this happens three times, the outcome is `died`.
        virtual_us: virtual time on the bench at the end of the run, in microseconds.
        where: file and line of the failure, or empty if the run passed or the line is unknown.
        reason: reason of the outcome in one line, or empty if the run passed.
    """

    number: int
    outcome: str
    virtual_us: int = 0
    where: str = ""
    reason: str = ""


HUNG: Final = "hung"
DIED: Final = "died"
_OUTCOMES: Final = frozenset({*(outcome.value for outcome in Outcome), HUNG, DIED})


def verdicts_of(answer: object, runs: Sequence[Run]) -> list[RunVerdict]:
    """Check the answer of a worker process, and return its verdicts.

    Args:
        answer: the data from the worker.
        runs: the requested runs.

    Raises:
        ValueError: the answer does not have one verdict for each run, in the order of the runs.
    """
    if not isinstance(answer, list) or len(answer) != len(runs):
        came = counted(len(answer), "item") if isinstance(answer, list) else type(answer).__name__
        raise ValueError(f"{came} in place of {counted(len(runs), 'verdict')}")
    return [_verdict_of(each, run) for each, run in zip(answer, runs, strict=True)]


def _verdict_of(answer: object, run: Run) -> RunVerdict:
    match answer:
        case (run.number, str(outcome), int(virtual_us), str(where), str(reason)) if (
            outcome in _OUTCOMES and virtual_us >= 0
        ):
            return RunVerdict(run.number, outcome, int(virtual_us), where, reason)
    raise ValueError(f"{repr(answer)[:60]} in place of a verdict of run {run.number}")
