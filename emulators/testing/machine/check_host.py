"""The search for errors of a host, and the replay of an error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tickrig._lazy import LazyModule
from tickrig.emulators.testing.machine.bench_machine import BenchMachine
from tickrig.emulators.testing.machine.host_runs import HostFailure, HostRuns, HostStep, parse_steps
from tickrig.host.text.values import counted

if TYPE_CHECKING:
    from tickrig.emulators.testing.machine import strategies
else:
    strategies = LazyModule("tickrig.emulators.testing.machine.strategies")  # an extra

_HEAD: Final = "# a scenario of {place}, {count}"
_NOT_AGAIN: Final = (
    "# it passed when it was repeated: the host keeps something from one run to the next, in a"
    " global or a class, or depends on a clock or on chance of its own"
)
_REPLAY: Final = "put it into a file, and: tickrig replay FILE --host {place}"
_WANTED: Final = "a search wants Hypothesis: pip install 'tickrig[test]'"


def check_host(
    machine: type[BenchMachine],
    *,
    max_examples: int = 200,
    max_steps: int = 12,
    seed: int | None = None,
) -> None:
    """Search for a sequence of calls, faults and input changes that shows an error of a host.

    The search shortens the sequence that it finds as much as possible. The exception has a note
    with the scenario and with the command that replays it without Hypothesis.

    Args:
        machine: the bench, the host and its rules.
        max_examples: number of runs, if no error is found.
        max_steps: largest number of steps in a run.
        seed: seed of the random choices. The same seed repeats the same search, independent of
            earlier findings. With None each search is different, and begins with earlier findings.

    Raises:
        ModuleNotFoundError: Hypothesis is not installed.
        Exception: the exception of the host, a rule or an invariant in the shortest failing run.
    """
    with HostRuns(machine) as runs:
        search = search_of(runs, max_examples=max_examples, max_steps=max_steps, seed=seed)
        try:
            search()
        except BaseException as error:
            if runs.failure is None or isinstance(error, KeyboardInterrupt):
                raise  # nothing was found: a strategy has raised it, or a test is skipped
            shortest = runs.shorten(runs.failure)
            failed = shortest or runs.failure
            failed.error.add_note(note_of(runs, failed, repeats=shortest is not None))
            raise failed.error from None


def search_of(runs: HostRuns, *, max_examples: int, max_steps: int, seed: int | None = None) -> Any:
    """Return a Hypothesis test that searches for failures of a host.

    Hypothesis chooses the steps of each run at random.

    Args:
        runs: object that executes the steps.
        max_examples: largest number of runs, if no failure is found.
        max_steps: largest number of steps in a run.
        seed: seed of the random choices, or None for a different search each time.

    Raises:
        ModuleNotFoundError: Hypothesis is not installed.
    """
    try:
        import hypothesis  # noqa: PLC0415 - an extra
        from hypothesis import HealthCheck, Phase, given, settings  # noqa: PLC0415 - an extra
    except ImportError:
        raise ModuleNotFoundError(_WANTED, name="hypothesis") from None
    others: dict[str, Any] = {} if seed is None else {"database": None}

    @settings(
        max_examples=max_examples,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
        print_blob=False,
        phases=[phase for phase in Phase if phase is not Phase.explain],
        **others,
    )
    @given(strategies.steps(runs.machine, max_steps))
    def search(steps: list[HostStep]) -> None:
        runs.run(steps)

    return search if seed is None else hypothesis.seed(seed)(search)


def replay_host(machine: type[BenchMachine], scenario: Path | str) -> None:
    """Repeat a failure that a search has found. This needs no random choices and no Hypothesis.

    Args:
        machine: class with the bench, the host and its rules.
        scenario: path of a file with the scenario, or the scenario as a text of several lines.

    Raises:
        OSError: the file cannot be read.
        ValueError: the text is not a scenario of this machine. The message names file and line.
        Exception: the exception of the host, a rule or an invariant, if the failure occurs again.
    """
    text, name = str(scenario), "scenario"
    if "\n" not in text:
        text, name = Path(scenario).read_text("utf-8"), str(scenario)
    steps = parse_steps(text, name, machine.rules())
    with HostRuns(machine) as runs:
        try:
            runs.run(steps)
        except BaseException as error:
            if runs.failure is not None:
                error.add_note(f"{runs.failure.text}\nwhat passed last:\n{runs.failure.passed}")
            raise


def note_of(runs: HostRuns, failure: HostFailure, *, repeats: bool = True) -> str:
    """Return the description of a failure that a search has found.

    It has the scenario, the command that replays it, and the last traffic before the failure.

    Args:
        runs: the runs of the search.
        failure: the failure.
        repeats: whether the run failed again when it was repeated.
    """
    place, steps = _place(type(runs.machine)), failure.steps
    return "\n".join(
        [
            _HEAD.format(place=place, count=counted(len(steps), "step")),
            *map(str, steps),
            f"# {failure.text}",
            *([] if repeats else [_NOT_AGAIN]),
            "",
            _REPLAY.format(place=place),
            "",
            f"what passed last:\n{failure.passed}",
        ]
    )


def _place(machine: type) -> str:
    """Return `FILE.py:Class` with the path of the file relative to the working directory."""
    import inspect  # noqa: PLC0415 - of failures alone

    try:
        path = Path(inspect.getfile(machine))
    except (OSError, TypeError):
        path = Path(f"{machine.__module__}.py")
    here = Path.cwd()
    shown = path.relative_to(here) if path.is_relative_to(here) else path
    return f"{shown}:{machine.__qualname__}"
