"""What is told after a failure: what was asked, what happened last, and how to repeat it."""

from __future__ import annotations

import shlex
from os.path import relpath
from typing import TYPE_CHECKING, Final

import pytest

from tickrig.emulators.testing.plugin.evidence.artifacts import TRACE
from tickrig.emulators.testing.plugin.evidence.journal_text import last_lines
from tickrig.emulators.testing.plugin.parameters import words_of
from tickrig.emulators.testing.plugin.settings import SETTINGS
from tickrig.host.text.values import format_time

if TYPE_CHECKING:
    from tickrig.emulators.testing.plugin.benched_test import BenchedTest

LINES: Final = 20
"""So many lines and frames are told."""


def sections_of(test: BenchedTest) -> list[tuple[str, str]]:
    """Return the sections of a report, each with its title."""
    command = ("bench: repeat it with", repeat_command(test.item))
    if test.bench is None:
        return [("bench", f"none was opened; {test.wanted.mode}"), command]
    last = last_lines(test.bench, LINES) or "nothing happened"
    sections = [("bench", _wanted(test)), ("bench: what happened last", last), command]
    if unheard := test.take_unheard():
        sections.insert(1, ("bench: beside the test", "\n".join(unheard)))
    if test.kept or test.not_kept:
        sections.append(("bench: what was kept", _kept(test)))
    return sections


def repeat_command(item: pytest.Item) -> str:
    """Return the command that runs a test again, for a shell."""
    config = item.config
    file, *names = str(item.nodeid).split("::")
    seed = config.stash[SETTINGS].seed
    words = [
        "pytest",
        "::".join([relpath(config.rootpath / file, config.invocation_params.dir), *names]),
    ]
    for flag, value in (
        ("--bench", config.getoption("bench")),
        ("--bench-mode", config.getoption("bench_mode")),
        ("--bench-seed", None if seed is None else str(seed)),
    ):
        words += [] if value is None else [flag, value]
    for name, word in words_of(item).items():
        words += ["--bench-param", f"{name}={word}"]
    return shlex.join(words)


def _wanted(test: BenchedTest) -> str:
    bench = test.bench
    assert bench is not None
    what = test.wanted.text
    devices = ", ".join(bench.devices)
    named = what if what == devices else f"{what} with {devices}"
    return f"{named}; {bench.mode}, seed {test.wanted.seed_used}, {format_time(bench.now_us)} s old"


def _kept(test: BenchedTest) -> str:
    """Return the files that were kept; a trace is a command."""
    paths = [shlex.quote(relpath(path)) for path in test.kept]
    lines = [f"tickrig replay {path}" if path.endswith(TRACE) else path for path in paths]
    return "\n".join([*lines, *test.not_kept])
