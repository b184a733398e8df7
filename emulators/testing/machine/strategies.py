"""Hypothesis strategies for events at devices and hosts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import ceil, floor
from typing import Any, Final

from hypothesis import strategies as st

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.machine.bench_machine import BenchMachine, World, WorldInput
from tickrig.emulators.testing.machine.host_runs import SEED, HostStep, check_written
from tickrig.emulators.testing.properties.strategies import (
    Act,
    Session,
    chunks,
    frames,
    input_changes,
    sessions,
    values,
    waits,
)
from tickrig.host.text.values import us_of

__all__ = (
    "Act",
    "Session",
    "chunks",
    "faults",
    "frames",
    "input_changes",
    "operator",
    "sessions",
    "steps",
    "timing",
    "traffic",
    "values",
    "waits",
)

_RATES: Final = ("1", "0.5", "0.1", "0.02", "0.003", "0.0003")
_SEEDS: Final = 9_999
_PRESSES: Final = ("10ms", "100ms", "500ms", "2s")
_WAITS_US: Final = (0, 0, 0, 1_000, 10_000, 50_000, 100_000, 300_000, 1_000_000, 3_000_000)


def timing() -> st.SearchStrategy[int]:
    """Draw the pause before a step, in microseconds: mostly 0, at most 3 s."""
    return st.sampled_from(_WAITS_US)


def faults(
    bench: Bench, names: Sequence[str] | None = None, for_: Sequence[str] = ("100ms", "1s")
) -> st.SearchStrategy[HostStep]:
    """Return a Hypothesis strategy for temporary faults.

    The strategy draws a `HostStep`. The method `do` of the step starts the fault on a bench.

    Args:
        bench: the bench with the faults.
        names: names of the faults to draw from. The default is all faults of the bench.
        for_: possible durations of a fault.

    Raises:
        ValueError: a fault is unknown.
    """
    return _faults(World(bench, names, ()), for_)


def operator(bench: Bench, names: Sequence[str] | None = None) -> st.SearchStrategy[HostStep]:
    """Return a Hypothesis strategy for manual actions: pressed buttons and changed levels.

    `step.do(bench)` executes the drawn action.

    Args:
        bench: the bench with the inputs.
        names: names of the inputs and buttons to draw from. The default is all inputs and buttons
            of the bench, except the objects of CANopen nodes.

    Raises:
        ValueError: an input is unknown.
    """
    return _operator(World(bench, (), names))


def traffic(words: Sequence[str]) -> st.SearchStrategy[HostStep]:
    """Return a Hypothesis strategy for traffic of hosts other than the host under test.

    Each drawn value is a `HostStep`. Its method `do(bench)` sends the traffic.

    Args:
        words: texts to draw from. Each text is a frame in candump's notation, or bytes in hex; see
            `HostStep.what`.
    """
    return st.builds(HostStep, timing(), st.just("send"), st.sampled_from(words))


def _faults(world: World, for_: Sequence[str]) -> st.SearchStrategy[HostStep]:
    if isinstance(for_, str):
        raise ValueError(f"fault_for is a tuple of times: ({for_!r},), not {for_!r}")

    @st.composite
    def fault(draw: st.DrawFn) -> HostStep:
        wait_us = draw(timing())
        name = draw(st.sampled_from(list(world.faults)))
        form = world.faults[name]
        rate = draw(st.sampled_from(_RATES)) if form.rated and "rate=" not in name else ""
        if rate and form.bare != ["rate"]:  # a bare word is another argument
            rate = "" if rate == "1" else f"rate={rate}"
        rate = f"{',' if '=' in name else '='}{rate}" if rate else ""
        return HostStep(wait_us, "fault", name + rate, us_of(draw(st.sampled_from(for_))))

    return fault()


def _operator(world: World) -> st.SearchStrategy[HostStep]:
    @st.composite
    def act(draw: st.DrawFn) -> HostStep:
        wait_us, item = draw(timing()), draw(st.sampled_from(world.inputs))
        if item.type == "button":
            return HostStep(wait_us, "press", item.name, us_of(draw(st.sampled_from(_PRESSES))))
        return HostStep(wait_us, "set", f"{item.name} {draw(_values(item))}")

    return act()


def _calls(rules: Mapping[str, Mapping[str, object]]) -> st.SearchStrategy[HostStep]:
    """Draw calls of rules.

    Args:
        rules: arguments of the rules, by name of the rule.
    """
    drawn = {
        name: st.fixed_dictionaries({each: _strategy(what) for each, what in given.items()})
        for name, given in rules.items()
    }
    for name, given in rules.items():  # a listed input has an immediate effect
        for each, what in given.items():
            for value in what if isinstance(what, list | tuple) else ():
                check_written(name, each, value, what)

    @st.composite
    def call(draw: st.DrawFn) -> HostStep:
        wait_us, name = draw(timing()), draw(st.sampled_from(list(drawn)))
        arguments = draw(drawn[name])
        for each, value in arguments.items():
            if isinstance(rules[name][each], st.SearchStrategy):
                check_written(name, each, value)
        return HostStep(wait_us, "call", name, arguments=arguments)

    return call()


def steps(machine: BenchMachine, most: int) -> st.SearchStrategy[list[HostStep]]:
    """Return a Hypothesis strategy for the steps of a run. On average half of them call a rule.

    Args:
        machine: the machine with the rules and its bench.
        most: largest number of steps.
    """
    world, rules = machine.world, machine.rules()
    happens = [
        *([_faults(world, machine.fault_for)] if world.faults else []),
        *([_operator(world)] if world.inputs else []),
        *([traffic(machine.traffic)] if machine.traffic else []),
    ]
    called = [_calls(rules)] if rules else []
    if not called:
        raise ValueError(f"{type(machine).__name__} has no host_rule: nothing would ask its host")

    @st.composite
    def step(draw: st.DrawFn) -> HostStep:
        kinds = called if not happens or draw(st.booleans()) else happens
        return draw(draw(st.sampled_from(kinds)))

    drawn = st.lists(step(), max_size=most)
    return (
        st.builds(partial(_with_seed, world), drawn, st.integers(0, _SEEDS))
        if any(form.rated for form in world.faults.values())
        else drawn
    )


def _with_seed(world: World, drawn: list[HostStep], seed: int) -> list[HostStep]:
    """Return a run with other random faults; with seed 0 the bench uses its own random numbers."""
    # Faults without a rate draw too, such as `jitter` and `garbage`.
    rated = {name.partition("=")[0] for name, form in world.faults.items() if form.rated}
    noisy = any(step.verb == "fault" and step.what.partition("=")[0] in rated for step in drawn)
    return [HostStep(0, SEED, str(seed)), *drawn] if seed and noisy else drawn


def _strategy(what: object) -> st.SearchStrategy[Any]:
    if isinstance(what, st.SearchStrategy):
        return what
    if isinstance(what, list | tuple | range):
        return st.sampled_from(what)
    raise TypeError(f"{what!r:.60} says not what an argument may be: a list, a range, a strategy")


def _values(item: WorldInput) -> st.SearchStrategy[float]:
    """Draw integers in the range of a level; the limits and 0 are more frequent.

    If the range contains no integer, only its limits are drawn.
    """
    low, high = ceil(item.low), floor(item.high)
    if low > high:
        return st.sampled_from((item.low, item.high))
    ends = [value for value in (0, low, high, 1) if low <= value <= high]
    return st.sampled_from(ends) | st.integers(low, high)
