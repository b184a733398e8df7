"""Description of the bench in a test, and the bench that is made from the description."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable, Coroutine, Iterable, Mapping
from copy import deepcopy
from dataclasses import replace
from functools import cache, lru_cache
from hashlib import sha256
from inspect import iscoroutine
from os.path import relpath
from pathlib import Path
from types import FunctionType
from typing import Any, Final, NamedTuple

import pytest

from tickrig.device.physical import SignalType
from tickrig.device.twin import twin
from tickrig.emulators.canopen.choices import MODELS
from tickrig.emulators.commands.device_type import DEVICES, DeviceType
from tickrig.emulators.rig.faults import near_fault
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench.bench import HARDWARE, LIMIT, VIRTUAL, Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig, RigState
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.plan_parts import BenchedDevice, name_of, named_device
from tickrig.emulators.testing.plugin.health import CLOCK, ERRORS, LONG_WAITS, LOST, THREADS
from tickrig.emulators.testing.plugin.settings import MODES
from tickrig.emulators.testing.rig_file.devices import EDS_SUFFIXES, RIG_SUFFIXES, kind_of
from tickrig.emulators.testing.rig_file.plan import DevicePlan, RigPlan
from tickrig.emulators.testing.rig_file.probe import Probe, probe
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.text.names import known, near
from tickrig.host.text.values import Setting

_Source = BenchedDevice | Mapping[str, Any] | Path
BenchSource = _Source | Callable[[], _Source] | None
"""A device or a factory of a device, arguments of `Bench` by name, or a rig file (`.toml`, `.yml`).
A device may also be a text, as the `type` in a rig file."""

_NO_DEVICES: Final = ("seed", "line", "mode", "sdo_timeout", "limit")
"""Arguments of `Bench` that are not devices."""

_NO_DEVICE: Final = (str, int, Path, type, DeviceType, LineSettings, FunctionType, type(None))

_USED: Final = pytest.StashKey[list[object]]()
"""The devices of the previous test."""


def _fresh(item: pytest.Item, source: BenchSource) -> BenchSource:
    """Return a source with devices that no other test has used.

    Devices in the parameters of a test are copied.

    Raises:
        ValueError: the devices are those of the previous test.
    """
    params = getattr(item, "callspec", None)
    if params is not None and any(source is value for value in params.params.values()):
        return deepcopy(source)
    values = source.values() if isinstance(source, Mapping) else [source]
    devices = [value for value in values if not isinstance(value, _NO_DEVICE)]
    before = item.config.stash.get(_USED, [])
    if any(device is used for device in devices for used in before):
        raise ValueError("bench_config gives a device that a test has used: make one in each call")
    item.config.stash[_USED] = devices
    return source


class WantedBench(NamedTuple):
    """The bench that a pytest test requests.

    Attributes:
        source: description of the devices on the bench.
        mode: `virtual`, `real` or `hardware`.
        seed: seed of all random numbers, or None to use the seed of the source.
        folder: folder that relative paths start from.
        limit: longest time that hosts may wait, or None to use the limit of the source.
    """

    source: BenchSource
    mode: str
    seed: int | None
    folder: Path
    limit: str | None = None

    def settled(self, item: pytest.Item) -> WantedBench:
        """Return a copy of this request, in which `source` has new devices for one test.

        If `source` is a function, it is called. Relative paths of files start from `folder`.

        Args:
            item: the test.

        Raises:
            ValueError: the request names no device, or another test has already used the devices.
        """
        source = _fresh(item, self.source)
        made = source() if callable(source) else source
        if made is None:
            raise ValueError(
                "the bench has no configuration: write a fixture bench_config, or give "
                "--bench RIG.TOML"
            )
        return self._replace(source=_placed(made, self.folder))

    def open(self) -> Bench:
        """Open the bench that the test requests.

        Raises:
            ValueError: the configuration is not valid.
            NotOnThisBench: the bench is not possible in this mode.
            BenchBlocked: a port is missing, or the user refused.
            OSError: a file cannot be read.
        """
        if isinstance(self.source, Path):
            plan = plan_of(self.source)
            plan = replace(plan, seed=self.seed_used)
            return Bench.of_plan(plan, self.mode, limit=self.limit or LIMIT)
        if self.mode == HARDWARE:
            raise NotOnThisBench("where the hardware is stands in a rig file: --bench RIG.TOML")
        options = {"mode": self.mode, **self._options, "seed": self.seed_used}
        if self.limit is not None:
            options["limit"] = self.limit
        return Bench(options.pop("", None), **options)

    @property
    def seed_used(self) -> int:
        """The seed of all random numbers."""
        if self.seed is not None:
            return self.seed
        if isinstance(self.source, Path):
            return plan_of(self.source).seed
        seed = self._options.get("seed", 0)
        if not isinstance(seed, int):
            raise ValueError(f"seed is a number, not {seed!r}")
        return seed

    @property
    def safe(self) -> Mapping[str, Mapping[str, Setting]]:
        """Values that the rig file demands for outputs after a test, by device and output."""
        return plan_of(self.source).safe if isinstance(self.source, Path) else {}

    @property
    def text(self) -> str:
        """Description of the bench as text."""
        if isinstance(self.source, Path):
            return relpath(self.source)
        names = [name for name in self._options if name not in _NO_DEVICES]
        return ", ".join(name or name_of(self._options[name]) for name in names)

    @property
    def _options(self) -> Mapping[str, Any]:
        """The arguments of `Bench`; a single device has no name."""
        return self.source if isinstance(self.source, Mapping) else {"": self.source}


def _placed(source: _Source, folder: Path) -> _Source:
    """Return a source with paths of files relative to the test.

    Raises:
        ValueError: a text does not name a device.
    """
    if isinstance(source, Mapping):
        return {
            name: value if name in _NO_DEVICES else _placed_device(value, folder)
            for name, value in source.items()
        }
    if isinstance(source, Path) and source.suffix.lower() not in EDS_SUFFIXES:
        return folder / source
    if isinstance(source, str) and source.lower().endswith(RIG_SUFFIXES):
        return folder / source
    placed: _Source = _placed_device(source, folder)
    return placed


def _placed_device(device: Any, folder: Path) -> Any:
    """Return a device; a file that a text or path names is searched in the folder of the test."""
    if not isinstance(device, str | Path):
        return device
    plan = named_device(str(device), folder)
    return plan.type if plan.node_id is None else f"{plan.node_id}={plan.type}"


def plan_of(path: Path) -> RigPlan:
    """Return the content of a rig file. The file is read again only if it has changed.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file has errors. The message has all errors, one per line.
    """
    return _plan_of(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _plan_of(path: Path, changed_ns: int) -> RigPlan:
    return read_rig_file(path)


# What a test needs of its bench, and what of it is not there.

ALLOWED: Final = (ERRORS, LOST, CLOCK, THREADS, LONG_WAITS)
HAND: Final = "hand"
_OR: Final = " or "
_MEANT: Final = "did you mean"
_DIGIT: Final = re.compile("[0-9]")
"""Digits of a name; names that differ only in a digit (`arm1`, `arm2`) are not misspelt."""


def _words_of(item: pytest.Item, marker: str) -> tuple[str, ...]:
    """Return the words of all markers of a name, in the order in which the test has them."""
    marks = list(item.iter_markers(marker))[::-1]
    return tuple(str(word) for mark in marks for word in mark.args)


def allowed_of(item: pytest.Item) -> tuple[str, ...]:
    """Return the problems that a test permits by its markers `allows`.

    Each problem is a name. For example, `allows("lost")` permits lost data.

    Raises:
        ValueError: a name is unknown.
    """
    allowed = _words_of(item, "allows")
    for word in allowed:
        if word not in ALLOWED:
            raise ValueError(f"allows({word!r}): it can allow {', '.join(map(repr, ALLOWED))}")
    return allowed


def needs_of(item: pytest.Item) -> tuple[str, ...]:
    """Return the arguments of a test's pytest markers with the name `needs`, in their order.

    Raises:
        ValueError: a name is unknown.
    """
    needs = _words_of(item, "needs")
    for choice in (choice for need in needs for choice in need.split(_OR)):
        kind, _, name = choice.partition(":")
        if choice not in (*MODES, HAND) and not (kind in KINDS and name):
            kinds = [*MODES, HAND, *(f"{kind}:{name or 'NAME'}" for kind in KINDS)]
            raise ValueError(f"needs({choice!r}): unknown; {near(choice, kinds)}")
    return needs


def check_mode(needs: Iterable[str], mode: str) -> None:
    """Raise NotOnThisBench if a test needs another mode, before the bench is opened."""
    for need in needs:
        choices = need.split(_OR)
        if mode not in choices and all(choice in MODES for choice in choices):
            raise NotOnThisBench(f"needs {need}, and this bench is {mode}")


def check_needs(needs: Iterable[str], bench: Bench) -> None:
    """Check that a bench has everything that a test needs.

    Args:
        needs: names from the markers `needs` of the test.
        bench: bench of the test.

    Raises:
        NotOnThisBench: the bench lacks something.
        ValueError: a name is probably misspelt: the bench has a similar name.
    """
    for need in needs:
        lacks = [_lack(choice, bench) for choice in need.split(_OR)]
        if all(lacks):
            for choice, lack in zip(need.split(_OR), lacks, strict=True):
                if _MEANT in lack and not _is_elsewhere(choice):
                    raise ValueError(f"needs({choice!r}): {lack}")
            raise NotOnThisBench(f"needs {need}: {' and '.join(lacks)}")


def _lack(choice: str, bench: Bench) -> str:
    """Return the needed properties that a bench lacks, or "" if the bench has all of them."""
    if choice in MODES:
        return "" if choice == bench.mode else f"this bench is {bench.mode}"
    if choice == HAND:
        return "" if bench.describe().inputs else "nothing can be set on this bench"
    kind, _, name = choice.partition(":")
    there = [each.rpartition("/")[2] for each in KINDS[kind](bench)]  # of any device
    if name in there or name in KINDS[kind](bench):
        return ""
    others = [each for each in there if _DIGIT.sub("", each) != _DIGIT.sub("", name)]
    hint = (near_fault if kind == "fault" else near)(name, others)
    if not hint.startswith(_MEANT):
        hint = f"known: {known(dict.fromkeys(there))}"
    return f"no {kind} {name!r}; {hint}"


def _is_elsewhere(choice: str) -> bool:
    """Return whether a device type that is not on the bench has the needed property."""
    kind, _, name = choice.partition(":")
    return name in _names_anywhere().get(kind, ())


@cache
def _names_anywhere() -> dict[str, set[str]]:
    """Return the names of all properties of device types and models, each of which is made once."""
    names: dict[str, set[str]] = {"fault": set(), "input": set(), "output": set()}
    for each in (*DEVICES.names(), *MODELS):
        kind, place = kind_of(each, Path())
        found = probe(DevicePlan(name=each, kind=kind, type=place, wire=""))
        if isinstance(found, Probe):
            inputs = found.physical.inputs
            names["fault"] |= {*inputs.names(SignalType.FAULT), *found.wire_faults}
            names["input"] |= {*inputs.table, *inputs.groups}
            names["output"] |= {*found.physical.outputs}
    return names


KINDS: Final[Mapping[str, Callable[[Bench], Iterable[str]]]] = {
    "fault": lambda bench: bench.describe().faults,
    "input": lambda bench: [*bench.describe().inputs, *bench.describe().groups],
    "output": lambda bench: bench.describe().outputs,
    "device": lambda bench: bench.devices,
}
"""The kinds of names for `needs`, each with a function that returns the names of a bench."""


# Benches that have done something before the test: once for each test, then out of a snapshot.

WarmUp = Callable[[Bench], Coroutine[Any, Any, None] | None] | None
"""Function that prepares a bench before the test (the bench runs a returned coroutine), or None."""


class _BenchSnapshot(NamedTuple):
    """A bench after its warm-up, for tests whose bench was equal before the warm-up.

    Attributes:
        digest: hash of the bench before its warm-up, without its seed.
        bench: the bench. Tests use only copies of this bench.
    """

    digest: bytes
    bench: Bench


SNAPSHOTS: Final = pytest.StashKey[dict[str, _BenchSnapshot]]()
"""Snapshots by node ID, in runs that repeat tests; the key is missing if each test runs once."""


def warmed(item: pytest.Item, bench: Bench, warm_up: WarmUp) -> Bench:
    """Run the warm-up of a test on its bench, and return the bench for the test.

    A campaign runs a test several times. In virtual time the bench may be kept after the warm-up of
    the first run. Then a later run gets a copy of the kept bench without a warm-up. A bench is not
    kept if its warm-up drew random numbers. The copy is used only if, before the warm-up, `bench`
    and the bench of the first run were equal; their seeds may differ. Hosts, triggers and tasks of
    the warm-up are removed.

    Raises:
        ValueError: the bench cannot be copied after the warm-up, although it could be copied
            before.
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
    """Warm a bench up; close the bench if the warm-up fails."""
    try:
        if iscoroutine(body := warm_up(bench)):
            bench.run(body)
    except BaseException:
        bench.close()
        raise


def _state(rig: BenchRig) -> RigState:
    return rig.state


def _digest(state: RigState) -> bytes:
    """Return the hash of a bench without the seeds of its wires, or "" if there is no hash.

    Raises:
        TypeError: an object in the bench cannot be copied.
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
    """Return a twin whose wires draw the same random numbers as the wires of a fresh bench."""
    state = bench._mode.act(_state)
    for chance, other in zip(state.chances, fresh.chances, strict=True):
        chance.seed = other.seed
    if state.recorder is not None and fresh.recorder is not None:
        state.recorder.header = fresh.recorder.header
    return bench
