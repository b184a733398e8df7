r"""Read what has to be shown by tests: a text file with a requirement a line.

>>> parse_requirements("# Wheelchair\nSAF-12  A pulled bus stops the chair\n", "req.txt")
(Requirement(name='SAF-12', text='A pulled bus stops the chair'),)
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tickrig.emulators.testing.report.bench_report import Requirement

COMMENT: Final = "#"


def read_requirements(path: Path) -> tuple[Requirement, ...]:
    """Read a file of requirements.

    Raises:
        OSError: it cannot be read.
        ValueError: all that is wrong with it, a line each.
    """
    try:
        return parse_requirements(path.read_text("utf-8"), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not UTF-8 at byte {error.start}") from None


def parse_requirements(text: str, file: str) -> tuple[Requirement, ...]:
    """Return the requirements of a text.

    Args:
        text: in each line the name, as the marker `req` has it, and after blanks what it demands;
            a line that begins with `#` is a comment.
        file: where it stands, for people.

    Raises:
        ValueError: a name stands twice, or there is none at all.
    """
    found: dict[str, Requirement] = {}
    lines: dict[str, int] = {}
    mistakes: list[str] = []
    for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1):
        name, *demand = line.split(maxsplit=1) or [COMMENT]
        if name.startswith(COMMENT):
            continue
        if name in found:
            mistakes.append(f"{file}:{number}: {name} stands in line {lines[name]} already")
            continue
        found[name] = Requirement(name, "".join(demand).rstrip())
        lines[name] = number
    if mistakes:
        raise ValueError("\n".join(mistakes))
    if not found:
        raise ValueError(f"{file}: no requirement: write one a line, as SAF-12 It stops")
    return tuple(found.values())
