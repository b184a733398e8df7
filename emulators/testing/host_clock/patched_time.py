"""Hosts that call `time.sleep` and `time.monotonic`, in the time of a rig."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

from tickrig.emulators.rig.sim_waits import Passing, SimTime
from tickrig.emulators.testing.host_clock.errors import HostTimeError
from tickrig.emulators.testing.host_clock.host_waits import HostWaits, check_clock
from tickrig.emulators.testing.host_clock.switches import Switches


@contextmanager
def patched_time(passing: Passing) -> Iterator[SimTime]:
    """Let hosts live in the time of a rig.

    What their code calls of `time` (`sleep`, `time`, `monotonic`, `perf_counter`, and in
    nanoseconds) is on the clock of `passing`; so are `wait` and `wait_for` of threading's events
    and conditions, `get` and `put` of queues, and a `select` of nothing with a timeout. Each look
    at the clock takes 100 us, so that a loop that only looks comes to its end. Event loops of
    asyncio that are made meanwhile, if it was imported before, have the time of `passing` too.

    Code of a host is all that is not Python's own, pytest's, Hypothesis's, coverage's, pyserial's,
    python-can's, canopen's or ours. It is found in its modules whatever it has kept: names
    (`from time import sleep`), attributes of classes, defaults of arguments. Threads that run
    already keep their time. Of the others, only that of the caller can wait.

    Not patched: what an object has kept before, `datetime`, `socket`, `Thread.join`,
    semaphores, `threading.Timer`, `queue.SimpleQueue`.

    Args:
        passing: a `RigPassing`, or a `SimNetwork`.

    Yields:
        The clock.

    Raises:
        HostTimeError: another thread waited, or something that the rig had called back; it is
            raised there, and once more at the end: such things are swallowed easily. Or freezegun
            or time-machine has replaced the clock.
    """
    check_clock()
    clock = SimTime(passing)
    waits = HostWaits(passing, clock)
    with Switches(waits.acts()), _loops(passing):
        yield clock
    if waits.refusals:
        raise HostTimeError(waits.refusals[0])


def _loops(passing: Passing) -> AbstractContextManager[None]:
    """Return what lets event loops have this time; nothing where asyncio is not in use."""
    if "asyncio" not in sys.modules:
        return nullcontext()
    from tickrig.emulators.testing.host_clock.bench_loop import (  # noqa: PLC0415 - imports asyncio
        bench_loops,
    )

    return bench_loops(passing)
