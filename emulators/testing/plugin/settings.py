"""Settings of benches, from options of pytest and lines of its configuration file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import pytest

from tickrig._lazy import LazyModule

if TYPE_CHECKING:
    from tickrig.host.text import values
else:  # only some options need them
    values = LazyModule("tickrig.host.text.values")

MODES: Final = ("virtual", "real", "hardware")
RANDOM: Final = "random"
NO_LIMIT: Final = "none"
_FAILED: Final = "failed"
_EVERY: Final = "every"


class _Option(NamedTuple):
    """An option of the command line and of the configuration file.

    Attributes:
        name: name, such as `bench_mode` for the option `--bench-mode`.
        metavar: placeholder of the value, or empty if the option has no value.
        text: help text of the option.
        many: whether the option may be repeated. In the configuration file each value has its own
            line.
    """

    name: str
    metavar: str
    text: str
    many: bool = False

    @property
    def flag(self) -> str:
        """The option as written on the command line."""
        return "--" + self.name.replace("_", "-")


OPTIONS: Final = (
    _Option("bench", "RIG.TOML", "rig file of the bench, instead of the fixture `bench_config`"),
    _Option(
        "bench_mode",
        "MODE",
        "run each test in MODE: virtual, real or hardware, or several, such as virtual,real",
    ),
    _Option("bench_seed", "N", "seed of all random values, or `random` to choose and print a seed"),
    _Option("bench_limit", "TIME", "longest time that a host may wait in virtual time, or `none`"),
    _Option(
        "bench_artifacts", "DIR", "save trace, candump log and transcript of failed tests in DIR"
    ),
    _Option("bench_artifacts_of", "WHICH", "tests for --bench-artifacts: failed or every"),
    _Option("bench_compare", "", "run each test twice; the test fails if the runs differ"),
    _Option("bench_report", "OUT.HTML", "write a report of all tests that have a bench"),
    _Option("bench_requirements", "FILE", "requirements that the report must cover, one per line"),
    _Option(
        "bench_param",
        "NAME=V,V",
        "run tests that take NAME with each value; may be repeated",
        many=True,
    ),
)


class _BenchParameter(NamedTuple):
    """Values of an argument or fixture of tests.

    Attributes:
        name: name of the argument or fixture.
        words: the values as written.
    """

    name: str
    words: tuple[str, ...]


class PluginSettings(NamedTuple):
    """The settings of the command line.

    Attributes:
        rig_file: path of the rig file, or None if tests define the bench themselves.
        ordered: whether the command line names the rig file.
        modes: modes in which each test runs.
        seed: seed of all random numbers, or None to use the seed of the rig file or test.
        limit: longest time that hosts may wait, or None to use the limit of the test.
        artifacts: folder for kept files, or None to keep no files.
        every: whether to keep files of passed tests too.
        compare: whether each test runs twice.
        report: file for the report, or None for no report.
        requirements: file with the requirements, or None if there is none.
        parameters: parameters of tests, each with its values.
    """

    rig_file: Path | None = None
    ordered: bool = False
    modes: tuple[str, ...] = MODES[:1]
    seed: int | None = None
    limit: str | None = None
    artifacts: Path | None = None
    every: bool = False
    compare: bool = False
    report: Path | None = None
    requirements: Path | None = None
    parameters: tuple[_BenchParameter, ...] = ()

    @classmethod
    def of(cls, config: pytest.Config) -> PluginSettings:
        """Return the settings of a test run; raise UsageError if a setting is invalid."""
        wanted = {option.name: _wanted(config, option) for option in OPTIONS}
        return cls(
            _path(config, "bench", wanted["bench"]),
            config.getoption("bench") is not None,
            _modes(wanted["bench_mode"] or MODES[0]),
            _seed(wanted["bench_seed"]),
            _limit(wanted["bench_limit"]),
            _path(config, "bench_artifacts", wanted["bench_artifacts"]),
            _every(wanted["bench_artifacts_of"] or _FAILED),
            wanted["bench_compare"].lower() in {"true", "1", "yes", "on"},
            _path(config, "bench_report", wanted["bench_report"]),
            _requirements(config, wanted),
            _parameters(wanted["bench_param"]),
        )

    @property
    def head(self) -> str:
        """Lines at the start of a run, or no lines without options."""
        if self == PluginSettings():
            return ""
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"bench: {self.rig_file or 'of each test'}, {', '.join(self.modes)}{seed}"


SETTINGS: Final = pytest.StashKey[PluginSettings]()


def _wanted(config: pytest.Config, option: _Option) -> str:
    given = config.getoption(option.name)
    if isinstance(given, list):
        given = "\n".join(given)
    return str(config.getini(option.name) if given is None else given).strip()


def _path(config: pytest.Config, name: str, text: str) -> Path | None:
    """Return the path of a file, relative to the working directory or the configuration file.

    Paths on the command line are relative to the working directory.
    """
    if not text:
        return None
    if config.getoption(name) is not None:
        return config.invocation_params.dir / text
    return (config.inipath.parent if config.inipath else config.rootpath) / text


def _requirements(config: pytest.Config, wanted: Mapping[str, str]) -> Path | None:
    """Return the file of requirements, if a report needs it."""
    path = _path(config, "bench_requirements", wanted["bench_requirements"])
    if path is None or wanted["bench_report"]:
        return path
    if config.getoption("bench_requirements") is not None:
        raise pytest.UsageError("--bench-requirements: they belong in a report: add --bench-report")
    return None


def _modes(text: str) -> tuple[str, ...]:
    modes = tuple(word.strip() for word in text.split(","))
    for mode in modes:
        if mode not in MODES:
            raise pytest.UsageError(
                f"--bench-mode {text}: {mode!r} is not one of {', '.join(MODES)}"
            )
    return tuple(dict.fromkeys(modes))


def _seed(text: str) -> int | None:
    if not text:
        return None
    if not text.isdecimal():
        raise pytest.UsageError(f"--bench-seed {text}: it is a number from 0 on, or {RANDOM}")
    return int(text)


def _limit(text: str) -> str | None:
    if text and text != NO_LIMIT:
        try:
            values.us_of(text)
        except ValueError as error:
            raise pytest.UsageError(f"--bench-limit {text}: {error}, or {NO_LIMIT}") from None
    return text or None


def _parameters(text: str) -> tuple[_BenchParameter, ...]:
    """Read the lines `NAME=VALUE,VALUE`."""
    found: dict[str, _BenchParameter] = {}
    for line in filter(None, map(str.strip, text.splitlines())):
        name, _, listed = line.partition("=")
        words = tuple(dict.fromkeys(values.split_list(listed)))
        if not (name.isidentifier() and words and all(words)):
            raise pytest.UsageError(f"--bench-param {line}: write NAME=VALUE,VALUE, as flip=0.001")
        if name in found:
            raise pytest.UsageError(f"--bench-param {line}: {name} has values already")
        found[name] = _BenchParameter(name, words)
    return tuple(found.values())


def _every(text: str) -> bool:
    if text not in (_FAILED, _EVERY):
        raise pytest.UsageError(f"--bench-artifacts-of {text}: it is {_FAILED} or {_EVERY}")
    return text == _EVERY
