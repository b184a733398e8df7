"""Two revisions side by side: `tools/bench --compare REV`."""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.sides import HERE, in_turn, revision

ROUNDS = 3


def compare(name: str, suites: Sequence[str]) -> None:
    """Print what each row was at a revision and is here, and the ratio of each pair of rounds.

    Args:
        name: a revision, as git takes it.
        suites: names of suites; they are run as they are here over both.
    """
    with tempfile.TemporaryDirectory() as folder:
        sides = revision(name, Path(folder)), HERE
        then, now = in_turn(sides, suites, ROUNDS, lambda text: print(text, file=sys.stderr))
    print(f"| what | {name} | here | here / {name} | min .. max |\n|---|---|---|---|---|")
    for what, row in now[0].items():
        was = [found[what].median for found in then if what in found]
        print(f"| {what} | {pair(was, [found[what].median for found in now], row.unit)} |")


def pair(was: Sequence[float], is_: Sequence[float], unit: str) -> str:
    """Return the cells of a row: both medians, and the ratios of the rounds."""
    here = f"{statistics.median(is_):,.4g} {unit}"
    if len(was) < len(is_):
        return f"not there | {here} | |"
    ratios = [new / old for old, new in zip(was, is_, strict=True)]
    ratio = f"{statistics.median(ratios):.3f} | {min(ratios):.3f} .. {max(ratios):.3f}"
    return f"{statistics.median(was):,.4g} {unit} | {here} | {ratio}"
