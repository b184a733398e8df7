"""What a test in virtual time may not do: mistake the clock of the machine for its own."""

from __future__ import annotations

from collections.abc import Collection, Container
from contextlib import AbstractContextManager, nullcontext
from threading import Thread
from typing import Final

from tickrig.emulators.testing.bench.bench import VIRTUAL
from tickrig.emulators.testing.host_clock.unpatched_time import unpatched_time_fails

CLOCK: Final = "clock"


def guard(
    mode: str, allowed: Container[str], others: Collection[Thread]
) -> AbstractContextManager[None]:
    """Return what fails a test in virtual time that looks at the clock of the machine.

    Args:
        mode: of its bench.
        allowed: what its markers allow.
        others: threads that ran before there was a bench.
    """
    if mode != VIRTUAL or CLOCK in allowed:
        return nullcontext()
    return unpatched_time_fails(others=others)
