"""The same suites over several states of tickrig, in turn: all meet the same machine."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from benchmarks.table import Row

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True, slots=True)
class Side:
    """A state of tickrig: its name, and the folder to import it from."""

    name: str
    source: Path


HERE = Side("here", ROOT / "src")

Found = dict[str, Row]
"""What one run of the suites has found, by what it is."""


def revision(name: str, folder: Path) -> Side:
    """Return a revision of this repository, unpacked into a folder."""
    packed = subprocess.run(["git", "archive", name], cwd=ROOT, capture_output=True, check=False)
    if packed.returncode:
        raise SystemExit(f"{name!r} is no revision here: {packed.stderr.decode().strip()}")
    with tarfile.open(fileobj=BytesIO(packed.stdout)) as archive:
        archive.extractall(folder, filter="tar")
    return Side(name, folder / "src")


def compiled(folder: Path, wheel: str) -> Side:
    """Return this tree as a compiled wheel has it, unpacked into a folder; built if not given."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(folder)]
    subprocess.run(
        [*pip, wheel or str(ROOT)], env=os.environ | {"TICKRIG_COMPILE": "1"}, check=True
    )
    return Side("compiled", folder)


def in_turn(
    sides: Sequence[Side], suites: Sequence[str], rounds: int, told: Callable[[str], None]
) -> list[list[Found]]:
    """Run the suites over each side, one side after the other, again and again.

    Args:
        sides: what is measured.
        suites: names of suites, as `tools/bench` takes them.
        rounds: how often each side has its turn.
        told: is told what is under way.

    Returns:
        For each side what each of its rounds has found.
    """
    found: list[list[Found]] = [[] for _ in sides]
    for number in range(rounds):
        for side, its in zip(sides, found, strict=True):
            told(f"round {number + 1} of {rounds}: {side.name}")
            its.append(one_round(side, suites))
    return found


def one_round(side: Side, suites: Sequence[str]) -> Found:
    """Run the suites in a process of their own over one side."""
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder, "rows.json")
        command = [sys.executable, str(ROOT / "tools" / "bench"), *suites]
        command += ["--source", str(side.source), "--json", str(kept)]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        return {row["what"]: Row(**row) for row in json.loads(kept.read_text())}
