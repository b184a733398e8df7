"""Benches that have done something before the test: once for each test, then out of a snapshot."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Coroutine
from dataclasses import replace
from hashlib import sha256
from inspect import iscoroutine
from typing import Any, Final, NamedTuple

import pytest

from tickrig.device.twin import twin
from tickrig.emulators.testing.bench.bench import VIRTUAL, Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig, RigState

WarmUp = Callable[[Bench], Coroutine[Any, Any, None] | None] | None
"""What is done to a bench before the test; None for nothing."""


class _BenchSnapshot(NamedTuple):
    """A bench after its warm-up, for others that were the same before it.

    Attributes:
        digest: of the bench before its warm-up, without its seed.
        bench: the bench; only twins of it are used.
    """

    digest: bytes
    bench: Bench


SNAPSHOTS: Final = pytest.StashKey[dict[str, _BenchSnapshot]]()
"""By node ID, where tests run many times; missing where they run once."""


def warmed(item: pytest.Item, bench: Bench, warm_up: WarmUp) -> Bench:
    """Return the bench that a test gets: in virtual time a twin of that which was warmed up.

    Nothing of a host, a trigger or a task of the warm-up is there any more.

    A snapshot is used where nothing is different by it: what was before the warm-up is the same but
    for the seed, and nothing was drawn by chance in it.

    Raises:
        ValueError: after the warm-up the bench cannot be copied, though it could be before.
    """
    if warm_up is None:
        return bench
    if bench.mode != VIRTUAL:
        _do(warm_up, bench)
        return bench
    state = bench._mode.act(_state)
    try:
        digest = _digest(state)
    except TypeError:  # a device that cannot be copied
        _do(warm_up, bench)
        return bench
    snapshots = item.config.stash.get(SNAPSHOTS, {})
    if digest and (found := snapshots.get(item.nodeid)) and found.digest == digest:
        bench.close()
        return _with_chance_of(state, found.bench.fork())
    _do(warm_up, bench)
    try:
        used = bench.fork()
    except TypeError as error:
        raise ValueError(f"after bench_warm_up: {error}") from None
    finally:
        bench.close()
    if not any(chance.drawn for chance in state.chances):
        snapshots[item.nodeid] = _BenchSnapshot(digest, bench)
    return used


def _do(warm_up: Callable[[Bench], Coroutine[Any, Any, None] | None], bench: Bench) -> None:
    """Warm a bench up; it is closed if that fails."""
    try:
        if iscoroutine(body := warm_up(bench)):
            bench.run(body)
    except BaseException:
        bench.close()
        raise


def _state(rig: BenchRig) -> RigState:
    return rig.state


def _digest(state: RigState) -> bytes:
    """Return the hash of a bench with all seeds of its wires left out; empty if it has none.

    Raises:
        TypeError: something in it cannot be copied.
    """
    bare = twin(state)
    for chance in bare.chances:
        chance.seed = 0
    if bare.recorder is not None:
        bare.recorder.header = replace(bare.recorder.header, seed=0)
    try:
        return sha256(pickle.dumps(bare)).digest()
    except (AttributeError, pickle.PicklingError):  # a class within a function
        return b""


def _with_chance_of(fresh: RigState, bench: Bench) -> Bench:
    """Return a twin whose wires draw as those of a fresh bench do."""
    state = bench._mode.act(_state)
    for chance, other in zip(state.chances, fresh.chances, strict=True):
        chance.seed = other.seed
    if state.recorder is not None and fresh.recorder is not None:
        state.recorder.header = fresh.recorder.header
    return bench
