"""What a test says is on its bench, and the bench that is made of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from pathlib import Path
from types import FunctionType
from typing import Any, Final, NamedTuple

import pytest

from tickrig.emulators.commands.device_type import DeviceType
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.build import BenchedDevice, name_of
from tickrig.emulators.testing.bench.errors import NotOnThisBench

Source = BenchedDevice | Mapping[str, Any] | Path
BenchSource = Source | Callable[[], Source] | None
"""A device or what makes one, arguments of `Bench` by name, or a rig file (`.toml`)."""

SUFFIX: Final = ".toml"

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

    @property
    def rig_file(self) -> Path | None:
        """The rig file, if it is one."""
        is_file = isinstance(self.source, Path) or (
            isinstance(self.source, str) and self.source.endswith(SUFFIX)
        )
        return self.folder / self.source if is_file else None  # type: ignore[operator] # a path

    def open(self) -> Bench:
        """Make the bench.

        Raises:
            ValueError: it cannot be made of that.
            NotOnThisBench: not in this mode.
            BenchBlocked: a port is not there, or somebody said no.
        """
        source = self.source() if callable(self.source) else self.source
        wanted = self._replace(source=source)
        if source is None:
            raise ValueError("nobody says what is on the bench: write a fixture bench_config")
        return wanted.open_devices()

    def open_devices(self) -> Bench:
        """Put devices on a bench."""
        if self.mode != "virtual":
            raise NotOnThisBench(f"a {self.mode} bench wants a rig file")
        given = self.source if isinstance(self.source, Mapping) else {"": self.source}
        options = dict(given)
        if self.seed is not None:
            options["seed"] = self.seed
        alone = options.pop("", None)
        return Bench(alone, **options)

    @property
    def seed_used(self) -> int:
        """The seed of all chance."""
        if self.seed is not None:
            return self.seed
        return self.source.get("seed", 0) if isinstance(self.source, Mapping) else 0

    @property
    def text(self) -> str:
        """What is on the bench, for people."""
        if isinstance(self.source, Path):
            return str(self.source)
        if isinstance(self.source, Mapping):
            return ", ".join(self.source)
        if callable(self.source):
            return getattr(self.source, "__name__", "devices of bench_config")
        if self.source is None or self.rig_file:
            return str(self.source or "nothing")
        return name_of(self.source)
