"""What the options of pytest and the lines of its configuration file say about benches."""

from __future__ import annotations

from typing import Final, NamedTuple

import pytest

MODES: Final = ("virtual", "real", "hardware")
RANDOM: Final = "random"


class Option(NamedTuple):
    """An option of the command line, which the configuration file has as well.

    Attributes:
        name: as `bench_mode`: the option is `--bench-mode`.
        metavar: stands for its value; empty if it has none.
        text: what it is for.
    """

    name: str
    metavar: str
    text: str

    @property
    def flag(self) -> str:
        """As the command line has it."""
        return "--" + self.name.replace("_", "-")


OPTIONS: Final = (
    Option("bench_mode", "MODE", "virtual, real or hardware; several, with commas, run each test"),
    Option("bench_seed", "N", "seed of all chance, or `random`, which is printed"),
)


class Settings(NamedTuple):
    """What was asked for.

    Attributes:
        modes: each test runs in each of them.
        seed: of all chance, None if what is on the bench says it.
    """

    modes: tuple[str, ...] = MODES[:1]
    seed: int | None = None

    @classmethod
    def of(cls, config: pytest.Config) -> Settings:
        """Return those of a test run; UsageError if one is wrong."""
        wanted = {option.name: _wanted(config, option) for option in OPTIONS}
        return cls(
            _modes(wanted["bench_mode"] or MODES[0]),
            _seed(wanted["bench_seed"]),
        )

    @property
    def head(self) -> str:
        """What a run begins with; empty if nothing was asked."""
        if self == Settings():
            return ""
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"bench: {', '.join(self.modes)}{seed}"


SETTINGS: Final = pytest.StashKey[Settings]()


def _wanted(config: pytest.Config, option: Option) -> str:
    given = config.getoption(option.name)
    return str(config.getini(option.name) if given is None else given).strip()


def _modes(text: str) -> tuple[str, ...]:
    modes = tuple(word.strip() for word in text.split(","))
    for mode in modes:
        if mode not in MODES:
            raise pytest.UsageError(f"--bench-mode {text}: {mode!r} is none of {', '.join(MODES)}")
    return tuple(dict.fromkeys(modes))


def _seed(text: str) -> int | None:
    if not text:
        return None
    if not text.isdecimal():
        raise pytest.UsageError(f"--bench-seed {text}: it is a number from 0 on, or {RANDOM}")
    return int(text)
