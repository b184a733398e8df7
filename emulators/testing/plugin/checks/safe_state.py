"""What the outputs of devices are when a test is over."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.host.text.values import Setting

SafeState = Mapping[str, Setting] | Callable[[Bench], object] | None
"""Values of outputs by name, or a check: False, or a text that says what is unsafe."""


def check_safe(bench: Bench, safe: SafeState) -> None:
    """Raise ValueError if something is asked for that the bench has not."""
    for name in safe if isinstance(safe, Mapping) and bench.mode != "hardware" else ():
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
