"""What the outputs of devices are when a test is over."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tickrig.emulators.testing.bench.bench import HARDWARE, Bench
from tickrig.host.text.values import Setting

SafeState = Mapping[str, Setting] | Callable[[Bench], object] | None
"""Values of outputs by name, or a check: False, or a text that says what is unsafe."""


def with_plan(
    safe: SafeState, plan: Mapping[str, Mapping[str, Setting]], bench: Bench
) -> SafeState:
    """Return what is safe by the rig file and by the fixture, whose values come first.

    Args:
        safe: of the fixture.
        plan: of the rig file, by device and output.
        bench: the bench.
    """
    alone = len(bench.devices) == 1
    of_plan = {
        name if alone else f"{device}/{name}": value
        for device, values in plan.items()
        for name, value in values.items()
    }
    if not of_plan:
        return safe
    if not callable(safe):
        return of_plan | {_short(name, bench): value for name, value in (safe or {}).items()}
    check = safe

    def both(bench: Bench) -> object:
        if found := unsafe(bench, of_plan):
            return "; ".join(found)
        return check(bench)

    return both


def _short(name: str, bench: Bench) -> str:
    """Return a name without the device that is alone on its bench."""
    return name.removeprefix(f"{bench.devices[0]}/") if len(bench.devices) == 1 else name


def check_safe(bench: Bench, safe: SafeState) -> None:
    """Raise ValueError if something is asked for that the bench has not."""
    for name in safe if isinstance(safe, Mapping) and bench.mode != HARDWARE else ():
        bench.get(name)


def unsafe(bench: Bench, safe: SafeState) -> list[str]:
    """Return what is not as it has to be when a test is over, each in a line."""
    if safe is None:
        return []
    if isinstance(safe, Mapping):
        found = [(name, bench.get(name), value) for name, value in safe.items()]
        return [
            f"{name} is {present}, and safe is {value}"
            for name, present, value in found
            if present != value
        ]
    said = safe(bench)
    if isinstance(said, str):
        return [said] if said else []
    return ["bench_safe says that it is not safe"] if said is False else []
