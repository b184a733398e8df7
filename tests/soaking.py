"""What `tools/soak` does: inputs by their number, and how far it is in a file."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import FrameType, FunctionType, ModuleType
from typing import Any, Final

from tests.soak_targets import DEVICES, TARGETS, Throw
from tickrig.emulators.testing.machine.fuzz_one_input import printing_notes

KEPT_EACH_S: Final = 10.0
INTERRUPTED: Final = 130
MOST_FOUND: Final = 20
"""After so many findings a run ends."""


@dataclass
class Progress:
    """How far a run is, as it stands in its file.

    Attributes:
        seed: of all inputs.
        done: how many inputs were thrown.
        cpu_s: processor time that they took.
        seen: what came of them.
        found: numbers of those that raised, or after which it was silent, and what came.
    """

    seed: int
    done: int = 0
    cpu_s: float = 0.0
    seen: Counter[str] = field(default_factory=Counter)
    found: dict[int, str] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path | None, seed: int) -> Progress:
        """Return what a file says; a new one if there is none.

        Raises:
            SystemExit: it is of another seed, or no such file.
        """
        if path is None or not path.exists():
            return cls(seed)
        try:
            said = json.loads(path.read_text("utf-8"))
            found = {int(number): text for number, text in said["found"].items()}
            read = cls(said["seed"], said["done"], said["cpu_s"], Counter(said["seen"]), found)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            sys.exit(f"{path} says not how far a soak is: {error!r}")
        if read.seed != seed:
            sys.exit(f"{path} is of seed {read.seed}, not {seed}: remove it, or give --seed")
        return read

    def write(self, path: Path | None) -> None:
        """Keep it, whole or not at all."""
        if path is not None:
            new = path.with_suffix(".new")
            new.write_text(json.dumps(vars(self)), "utf-8")
            os.replace(new, path)

    def line(self, name: str) -> str:
        """Say it in one line."""
        rate = self.done / self.cpu_s if self.cpu_s else 0
        seen = ", ".join(f"{word} {count:,}" for word, count in sorted(self.seen.items()))
        return (
            f"{name}: {self.done:,} inputs of seed {self.seed}, {len(self.found)} findings;"
            f" {self.cpu_s:,.0f} s of processor, {rate:,.0f} inputs/s; {seen}"
        )


class Soak:
    """Inputs that are thrown at one target, until there are enough.

    Args:
        throw: throws one.
        progress: how far it is.
        path: where that is kept, if anywhere.
    """

    def __init__(self, throw: Throw, progress: Progress, path: Path | None) -> None:
        self._throw, self.progress, self._path = throw, progress, path
        self._ended = False

    def end(self, number: int, frame: FrameType | None) -> None:
        """End after the present input; a handler of signals."""
        self._ended = True

    def run(self, inputs: int, told: Callable[[], None]) -> bool:
        """Throw until so many were thrown; return whether that was so.

        Args:
            inputs: how many, with those of earlier runs.
            told: called each time that it is kept.
        """
        progress, begun_s, kept_s = self.progress, time.process_time(), time.monotonic()
        while progress.done < inputs and not self._ended and len(progress.found) < MOST_FOUND:
            self._throw_one()
            if progress.done % 64 == 0 and time.monotonic() - kept_s > KEPT_EACH_S:
                begun_s, kept_s = self._keep(begun_s), time.monotonic()
                told()
        self._keep(begun_s)
        return progress.done >= inputs

    def _throw_one(self) -> None:
        progress = self.progress
        try:
            progress.seen[self._throw(Random(f"{progress.seed} {progress.done}"))] += 1
        except Exception as error:  # what is looked for
            progress.found[progress.done] = "".join(traceback.format_exception_only(error))
        progress.done += 1

    def _keep(self, begun_s: float) -> float:
        now_s = time.process_time()
        self.progress.cpu_s += now_s - begun_s
        self.progress.write(self._path)
        return now_s


def main(doc: str | None) -> int:
    """Throw inputs at targets, one after the other; return 1 if something was found."""
    words = _asked(doc)
    if words.guided:
        return _guided(words.targets)
    if words.state is not None:
        words.state.mkdir(parents=True, exist_ok=True)
    if words.one is not None:
        for name in words.targets or TARGETS:
            print(TARGETS[name]()(Random(f"{words.seed} {words.one}")))
        return 0
    status = 0
    for name in words.targets or TARGETS:
        came = _soak(name, words)
        if came == INTERRUPTED:
            return came
        status |= came
    return status


def _soak(name: str, words: argparse.Namespace) -> int:
    """Throw inputs at one target; return 1 if something was found, `INTERRUPTED` if not all."""
    path = words.state / f"{name}.json" if words.state else None
    soak = Soak(TARGETS[name](), Progress.read(path, words.seed), path)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, soak.end)
    whole = soak.run(words.inputs, lambda: _tell(soak, name))
    print(soak.progress.line(name), flush=True)
    for found, text in soak.progress.found.items():
        print(f"input {found}: {text}")
    if soak.progress.found:
        return 1
    return 0 if whole else INTERRUPTED


def _guided(targets: list[str]) -> int:
    """Let Atheris throw, until something is found or somebody ends it; it ends the process."""
    try:
        import atheris  # noqa: PLC0415 - an extra
    except ImportError:
        sys.exit("--guided wants Atheris: pip install 'tickrig[fuzz]'")
    if len(targets) != 1 or targets[0] not in DEVICES:
        sys.exit(f"--guided is for one device: {', '.join(DEVICES)}")
    one_input = printing_notes(DEVICES[targets[0]]())
    for name, module in tuple(sys.modules.items()):
        if name.startswith(("tickrig.device.", "tickrig.wire.")):
            _instrument(module, atheris.instrument_func)
    atheris.Setup([sys.argv[0], "-max_len=96"], one_input)
    atheris.Fuzz()
    return 0


def _instrument(module: ModuleType, instrument: Callable[[Any], Any]) -> None:
    """Have Atheris see which code of a module is reached."""
    kinds = [item for item in vars(module).values() if isinstance(item, type)]
    for owner in (module, *kinds):
        for item in tuple(vars(owner).values()):
            if isinstance(item, FunctionType) and item.__module__ == module.__name__:
                instrument(item)


def _tell(soak: Soak, name: str) -> None:
    if sys.stderr.isatty():
        print(f"\r{soak.progress.line(name):.100}", end="\r", file=sys.stderr)


def _asked(doc: str | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    parser.add_argument("--inputs", type=int, default=1_000_000, help="how many  [1000000]")
    parser.add_argument("--seed", type=int, default=1, help="of all inputs  [1]")
    parser.add_argument("--state", type=Path, metavar="DIR", help="where it is kept how far it is")
    parser.add_argument("--one", type=int, metavar="N", help="throw this one input, and end")
    parser.add_argument("--guided", action="store_true", help="by coverage, with Atheris")
    words = parser.parse_args()
    if unknown := set(words.targets) - set(TARGETS):
        parser.error(f"no target {', '.join(sorted(unknown))}; known: {', '.join(TARGETS)}")
    return words
