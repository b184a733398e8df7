"""Which clock a test has: that of its bench, or none that it could mistake for it."""

from __future__ import annotations

import time
from collections.abc import Container, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any, Final

from tickrig.emulators.testing.bench.bench import VIRTUAL, Bench
from tickrig.emulators.testing.host_clock.patched_time import patched_time
from tickrig.emulators.testing.host_clock.rig_passing import RigPassing
from tickrig.emulators.testing.host_clock.unpatched_time import unpatched_time_fails

CLOCK: Final = "clock"
FIXTURE: Final = "bench_time"


@contextmanager
def time_of(bench: Bench) -> Iterator[Any]:  # a module, or what is called like it
    """Let hosts that sleep and look at `time` live in the time of a bench.

    Args:
        bench: in virtual time its clock is theirs; else they keep that of the machine.

    Yields:
        The clock: `sleep`, `monotonic` and the others of `time`.
    """
    if bench.mode != VIRTUAL:
        yield time
        return
    with patched_time(RigPassing(bench._mode.act(lambda rig: rig.rig))) as clock:
        yield clock


def guard(
    mode: str, fixtures: Container[str], allowed: Container[str]
) -> AbstractContextManager[None]:
    """Return what fails a test in virtual time that looks at the clock of the machine.

    Args:
        mode: of its bench.
        fixtures: names of its fixtures.
        allowed: what its markers allow.
    """
    if mode != VIRTUAL or FIXTURE in fixtures or CLOCK in allowed:
        return nullcontext()
    return unpatched_time_fails()
