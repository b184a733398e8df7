"""What a test says is on its bench, and the bench that is made of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache
from os.path import relpath
from pathlib import Path
from types import FunctionType
from typing import Any, Final, NamedTuple

import pytest

from tickrig.emulators.commands.device_type import DeviceType
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench.bench import HARDWARE, Bench
from tickrig.emulators.testing.bench.build import BenchedDevice, name_of, named_device
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.rig_file.devices import EDS_SUFFIXES, RIG_SUFFIXES
from tickrig.emulators.testing.rig_file.plan import RigPlan
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.text.values import Setting

Source = BenchedDevice | Mapping[str, Any] | Path
BenchSource = Source | Callable[[], Source] | None
"""A device or what makes one, arguments of `Bench` by name, or a rig file (`.toml`, `.yml`).

A device may be a text too: what a rig file has as its `type`."""

NO_DEVICES: Final = ("seed", "line", "mode")
"""Arguments of `Bench` that are something else."""

NO_DEVICE: Final = (str, int, Path, type, DeviceType, LineSettings, FunctionType, type(None))

USED: Final = pytest.StashKey[list[object]]()
"""The devices of the test before."""


def fresh(item: pytest.Item, source: BenchSource) -> BenchSource:
    """Return a source whose devices no other test has used.

    What stands in the parameters of a test is copied.

    Raises:
        ValueError: these are the devices of the test before.
    """
    params = getattr(item, "callspec", None)
    if params is not None and any(source is value for value in params.params.values()):
        return deepcopy(source)
    values = source.values() if isinstance(source, Mapping) else [source]
    devices = [value for value in values if not isinstance(value, NO_DEVICE)]
    before = item.config.stash.get(USED, [])
    if any(device is used for device in devices for used in before):
        raise ValueError("bench_config gives a device that a test has used: make one in each call")
    item.config.stash[USED] = devices
    return source


class Wanted(NamedTuple):
    """What a test asked for.

    Attributes:
        source: what is on the bench.
        mode: `virtual`, `real` or `hardware`.
        seed: of all chance; None for that of the source.
        folder: where relative paths begin.
    """

    source: BenchSource
    mode: str
    seed: int | None
    folder: Path

    def settled(self, item: pytest.Item) -> Wanted:
        """Return it with what is on the bench of this test itself: made, and of a whole path.

        Raises:
            ValueError: nothing is, or what another test has used.
        """
        source = fresh(item, self.source)
        made = source() if callable(source) else source
        if made is None:
            raise ValueError(
                "nobody says what is on the bench: write a fixture bench_config, or give "
                "--bench RIG.TOML"
            )
        return self._replace(source=_placed(made, self.folder))

    def open(self) -> Bench:
        """Make the bench.

        Raises:
            ValueError: it cannot be made of that.
            NotOnThisBench: not in this mode.
            BenchBlocked: a port is not there, or somebody said no.
            OSError: a file cannot be read.
        """
        if isinstance(self.source, Path):
            plan = plan_of(self.source)
            return Bench.of_plan(replace(plan, seed=self.seed_used), self.mode)
        if self.mode == HARDWARE:
            raise NotOnThisBench("where the hardware is stands in a rig file: --bench RIG.TOML")
        options = {"mode": self.mode, **self._options, "seed": self.seed_used}
        return Bench(options.pop("", None), **options)

    @property
    def seed_used(self) -> int:
        """The seed of all chance."""
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
        """What the rig file says of outputs when a test is over, by device and name."""
        return plan_of(self.source).safe if isinstance(self.source, Path) else {}

    @property
    def text(self) -> str:
        """What is on the bench, for people."""
        if isinstance(self.source, Path):
            return relpath(self.source)
        names = [name for name in self._options if name not in NO_DEVICES]
        return ", ".join(name or name_of(self._options[name]) for name in names)

    @property
    def _options(self) -> Mapping[str, Any]:
        """The arguments of `Bench`; a lone device has no name."""
        return self.source if isinstance(self.source, Mapping) else {"": self.source}


def _placed(source: Source, folder: Path) -> Source:
    """Return a source whose files are found beside the test.

    Raises:
        ValueError: a text that names no device.
    """
    if isinstance(source, Mapping):
        return {
            name: value if name in NO_DEVICES else _placed_device(value, folder)
            for name, value in source.items()
        }
    if isinstance(source, Path) and source.suffix.lower() not in EDS_SUFFIXES:
        return folder / source
    if isinstance(source, str) and source.lower().endswith(RIG_SUFFIXES):
        return folder / source
    placed: Source = _placed_device(source, folder)
    return placed


def _placed_device(device: Any, folder: Path) -> Any:
    """Return a device; what a text or path names is found beside the test."""
    if not isinstance(device, str | Path):
        return device
    plan = named_device(str(device), folder)
    return plan.type if plan.node_id is None else f"{plan.node_id}={plan.type}"


def plan_of(path: Path) -> RigPlan:
    """Return what a rig file says; it is read once, unless it has changed.

    Raises:
        OSError: it cannot be read.
        ValueError: all that is wrong with it, a line each.
    """
    return _plan_of(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _plan_of(path: Path, changed_ns: int) -> RigPlan:
    return read_rig_file(path)
