"""What a campaign asks of its workers: which tests to collect, and how."""

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
"""Of pytest in a worker: nothing is shown or kept, and what was printed is not looked at."""


class CampaignRefusal(Exception):  # noqa: N818 - what a campaign cannot do; nothing is broken
    """What a campaign cannot do, in a line for people."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignOrder:
    """What a worker collects, and how long a run may take.

    Attributes:
        tests: files, folders and node IDs, as pytest has them.
        parameters: as `--bench-param` has them.
        bench: rig file, empty for that of the tests.
        keyword: as `-k` has it; empty for all.
        timeout_s: what a run takes at most.
        folder: where they are looked for, a whole path.
        version: of tickrig.
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
    """A test that runs with many seeds.

    Attributes:
        nodeid: as pytest has it.
        values: of its parameters, as they were written.
        place: its node ID as one types it where the campaign was begun.
    """

    nodeid: str
    values: Mapping[str, str]
    place: str


class Collected(NamedTuple):
    """What a worker found.

    Attributes:
        tests: those with a bench.
        left_out: node IDs of those without.
        digest: of the files that they stand in, and of what these import from their project.
    """

    tests: tuple[CollectedTest, ...]
    left_out: tuple[str, ...]
    digest: str


class Run(NamedTuple):
    """A test with a seed.

    Attributes:
        number: its place in the campaign.
        nodeid: of the test.
        seed: of all chance.
    """

    number: int
    nodeid: str
    seed: int


class RunVerdict(NamedTuple):
    """How a run ended.

    Attributes:
        number: its place in the campaign.
        outcome: `passed`, `failed`, `error`, `blocked` or `skipped`; `hung` if it took too long,
            `died` if its process ended three times.
        virtual_us: how old its bench was then.
        where: file and line; empty if it passed, or nobody knows.
        reason: why, in a line; empty if it passed.
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
    """Return the verdicts that a worker has sent.

    Args:
        answer: what came from the worker.
        runs: what it was asked for.

    Raises:
        ValueError: the answer is not one verdict for each run, in their order.
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
