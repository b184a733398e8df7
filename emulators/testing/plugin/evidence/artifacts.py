"""What is kept of a test: its trace, the frames of its buses, its transcript."""

from __future__ import annotations

import re
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Final

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.journal import missing_of
from tickrig.emulators.testing.plugin.evidence.journal_text import buses_of, frame_of
from tickrig.host.text.trace import Mark
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.candump import LogLine

TRACE: Final = ".trace"
MOST: Final = 80
"""Characters of a name that are of the test."""


def stem_of(nodeid: str) -> str:
    """Return what files of a test are called: no path, and no two tests have the same.

    >>> stem_of("tests/test_stop.py::test_it_stops[../fast]")
    'tests_test_stop.py_test_it_stops_fast-24cfca'
    """
    words = re.sub(r"[^A-Za-z0-9.-]+", "_", nodeid.replace("..", "")).strip("._-")
    return f"{words[-MOST:].lstrip('._-') or 'test'}-{sha256(nodeid.encode()).hexdigest()[:6]}"


def keep(bench: Bench, folder: Path, nodeid: str) -> tuple[list[Path], list[str]]:
    """Write what is kept of a test.

    Args:
        bench: its bench, still open.
        folder: where to; it is made.
        nodeid: of the test.

    Returns:
        The files, and why others are not there, or not whole, each in a line.
    """
    kept: list[Path] = []
    failed: list[str] = []
    for suffix, write in WRITERS.items():
        path = folder / f"{stem_of(nodeid)}{suffix}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if write(bench, path):
                kept.append(path)
                failed += _cut(bench, path)
        except NotOnThisBench:
            continue
        except OSError as error:
            failed.append(f"{path} was not written: {error.strerror or error}")
    return kept, failed


def _cut(bench: Bench, path: Path) -> list[str]:
    """Say that a file has the latest alone; a trace has all."""
    missing = "" if path.suffix == TRACE else missing_of(bench._mode.journal())
    return [f"{path} is not whole: {missing}"] if missing else []


def _trace(bench: Bench, path: Path) -> bool:
    bench.save_trace(path)
    return True


def _candump(bench: Bench, path: Path) -> bool:
    buses = buses_of(bench)
    frames = [
        f"{LogLine(line.at_us, line.source, frame_of(line))}\n"
        for line in bench._mode.journal()
        if line.source in buses and line.mark is not Mark.PHYSICAL
    ]
    if frames:
        write_whole(path, "".join(frames))
    return bool(frames)


def _transcript(bench: Bench, path: Path) -> bool:
    write_whole(path, f"{bench.transcript()}\n")
    return True


WRITERS: Final[dict[str, Callable[[Bench, Path], bool]]] = {
    TRACE: _trace,
    ".log": _candump,
    ".txt": _transcript,
}
"""By suffix; each says whether there was something to write."""
