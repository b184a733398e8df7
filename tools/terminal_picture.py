"""Run commands and draw what a terminal shows of them, line after line, as a moving SVG.

    python tools/terminal_picture.py first-test docs/pictures/first-test.svg

The words are those of the run, with their colours; the times are those of a person who types and
reads. The last screen is shown first, for READ_S seconds, and where nothing moves (a preview, a
printer, a reader who wants no motion): a picture that begins empty is an empty picture there.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from rich.style import Style
from rich.terminal_theme import MONOKAI
from rich.text import Text

ROOT: Final = Path(__file__).parents[1]


@dataclass(frozen=True)
class Script:
    """What is typed, and where.

    Attributes:
        source: a folder, in a copy of which the commands run; or a page, whose files are written.
        commands: what is typed, in bash.
        columns: how wide the terminal is.
    """

    source: str
    commands: tuple[str, ...]
    columns: int = 92


SCRIPTS: Final = {
    "first-test": Script(
        "examples/chair",
        (
            "grep -A 8 '^def drive' test_chair.py",
            "tail -5 test_chair.py",
            "pytest -q",
            "sed -i 's/TRIES = 20/TRIES = 1/' test_chair.py",
            "pytest -q --tb=line",
        ),
    ),
    "demo": Script("examples/rigs", ("tickrig demo fig120",)),
    "canmon": Script(
        "tests/golden/canmon",
        (
            "canmon info drive.log",
            "canmon dump drive.log -t z -F 'node=5 and (nmt or pdo or emcy)'",
            "canmon check drive.log -t z --rule dlc --rule 'emcy never' --around 1; echo status $?",
        ),
        columns=128,
    ),
    "canopen-master": Script(
        "docs/tutorials/canopen-master.md",
        (
            "tail -7 rig.toml",
            "grep -A 5 'loses_supply' test_master.py",
            "pytest -v --no-header --bench rig.toml test_master.py",
        ),
    ),
    "robot": Script(
        "docs/tutorials/robot.md",
        (
            "tickrig check rig.toml",
            "grep -A 6 'def go' robot.py",
            "pytest -q --bench rig.toml test_robot.py",
            "tail -5 test_ice.py",
            "pytest -q --bench rig.toml --tb=short test_ice.py",
            "sed -i 's/0x6060, 3, size=1)/&; write(wheel, 0x6083, 1000, size=4)/' robot.py",
            "pytest -q --bench rig.toml test_robot.py test_ice.py",
        ),
    ),
}

ROWS: Final = 26
ENVIRONMENT: Final = {
    **{"PY_COLORS": "1", "PYTHONDONTWRITEBYTECODE": "1"},
    **{"PYTEST_ADDOPTS": "-p no:cacheprovider -p no:randomly -p no:xdist"},
}
CI: Final = ("CI", "BUILD_NUMBER")  # where pytest prints its summary in full
FILE: Final = re.compile(r"^```\w+\n# ([\w.]+)\n\n?(.*?)^```", re.DOTALL | re.MULTILINE)
CELL: Final = (8, 17)
EDGE: Final = 4  # above the first line; what is scrolled out of the screen ends there
GROUND, INK = "#121212", "#e0e0e0"
KEY_S, LINE_S, READ_S, END_S = 0.03, 0.06, 1.8, 6.0


@dataclass
class Line:
    """A line of the terminal: when it appears, and how long it is typed."""

    text: Text
    at_s: float
    typed_s: float = 0.0


def draw(name: str) -> str:
    """Return the picture of a script."""
    script = SCRIPTS[name]
    return svg(lines_of(script), script.columns)


def lines_of(script: Script) -> list[Line]:
    """Run the commands and return what a terminal shows."""
    lines, now_s = list[Line](), 0.5
    with TemporaryDirectory() as scratch:
        place = Path(scratch, Path(script.source).stem)
        _fill(place, ROOT / script.source)
        for command in script.commands:
            typed_s = KEY_S * len(command)
            lines.append(Line(Text(f"$ {command}", style="bold"), now_s, typed_s))
            now_s += typed_s + 0.3
            for text in _output(command, place, script.columns):
                lines.append(Line(text, now_s))
                now_s += LINE_S
            now_s += READ_S
    return lines


def _fill(place: Path, source: Path) -> None:
    """Copy a folder, or write the files of a page as they are there first."""
    if source.is_dir():
        shutil.copytree(source, place, ignore=shutil.ignore_patterns("[._]*"))
        return
    place.mkdir()
    for name, text in reversed(FILE.findall(source.read_text("utf-8"))):
        (place / name).write_text(text, "utf-8")


def _output(command: str, place: Path, columns: int) -> Iterator[Text]:
    here = {name: value for name, value in os.environ.items() if name not in CI}
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=place,
        env={**here, **ENVIRONMENT, "COLUMNS": str(columns)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    said = done.stdout.replace(f"{place}/", "")
    said = re.sub(r" in [\d.]+s( \([\d:]+\))?", "", said)  # a run of this machine, on that day
    for line in said.rstrip("\n").splitlines():
        text = Text.from_ansi(line)
        yield from text.divide(range(columns, len(text), columns))


def svg(lines: list[Line], columns: int) -> str:
    """Return the picture."""
    wide, high = CELL
    width, height = columns * wide, ROWS * high + 2 * EDGE
    end_s = lines[-1].at_s + END_S
    rules = [
        "text{font:13.3px monospace;white-space:pre}.b{font-weight:bold}",
        f"g,text{{animation:0s step-end {READ_S}s infinite;animation-duration:{end_s:.2f}s}}",
        _scrolling(lines, end_s),
        *(_appearing(row, line, end_s) for row, line in enumerate(lines)),
        "@media (prefers-reduced-motion){g,text{animation:none!important}}",
    ]
    scroll = max(0, len(lines) - ROWS) * high
    rules.append(f"#s{{transform:translateY(-{scroll}px);animation-name:s}}")
    body = "\n".join(_row(row, line) for row, line in enumerate(lines))
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" xml:space="preserve" '  # for viewers without CSS
        f'viewBox="0 0 {width + 16} {height}" fill="{INK}">\n'
        f"<style>\n{chr(10).join(rules)}\n</style>\n"
        f'<rect width="100%" height="100%" rx="6" fill="{GROUND}"/>\n'
        f'<svg y="{EDGE}"><g id="s">\n{body}\n</g></svg>\n</svg>\n'
    )


def _percent(at_s: float, end_s: float) -> str:
    return f"{100 * at_s / end_s:.2f}%"


def _scrolling(lines: list[Line], end_s: float) -> str:
    """Return key frames that move all up by a line for each that has no room."""
    moves = "".join(
        f"{_percent(line.at_s, end_s)}{{transform:translateY(-{(row - ROWS + 1) * CELL[1]}px)}}"
        for row, line in enumerate(lines)
        if row >= ROWS
    )
    return f"@keyframes s{{0%{{transform:translateY(0)}}{moves}}}"


def _appearing(row: int, line: Line, end_s: float) -> str:
    """Return the rule of a line: hidden, then there; a command is typed, an eighth at a time."""
    begin, letters = line.at_s, len(line.text)
    rule = f"#l{row}{{animation-name:k{row}}}@keyframes k{row}{{0%{{opacity:0}}"
    if not line.typed_s:
        return f"{rule}{_percent(begin, end_s)}{{opacity:1}}}}"
    for part in range(9):
        hidden = 100 - max(200, 100 * letters * part // 8) // letters  # the prompt is there
        at = _percent(begin + line.typed_s * part / 8, end_s)
        rule += f"{at}{{opacity:1;clip-path:inset(0 {hidden}% 0 0)}}"
    return f"{rule}}}"


def _row(row: int, line: Line) -> str:
    y = (row + 1) * CELL[1] - EDGE
    return f'<text id="l{row}" x="8" y="{y}">{"".join(_runs(line.text)) or " "}</text>'


def _runs(text: Text) -> Iterator[str]:
    """Return the runs of one look."""
    plain = text.plain.replace(" ", "\N{NO-BREAK SPACE}")
    bounds = sorted({0, len(plain), *(b for span in text.spans for b in (span.start, span.end))})
    for begin, end in pairwise(bounds):
        style = Style.combine(
            [Style.parse(str(text.style))]
            + [Style.parse(str(s.style)) for s in text.spans if s.start <= begin < s.end]
        )
        ink = style.color.get_truecolor(MONOKAI).hex if style.color else ""
        look = f' fill="{ink}"' * bool(ink) + ' class="b"' * bool(style.bold)
        words = escape(plain[begin:end], quote=False)
        yield f"<tspan{look}>{words}</tspan>" if look else words


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(draw(sys.argv[1]), "utf-8")
