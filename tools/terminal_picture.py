"""Run commands and draw what a terminal shows of them, line after line, as a moving SVG.

    python tools/terminal_picture.py first-test docs/pictures/first-test.svg

The words are those of the run, with their colours; the times are those of a person who types and
reads. Where nothing moves (a reader who wants no motion, a printer) the last screen is shown.
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

EXAMPLES: Final = Path(__file__).parents[1] / "examples"
SCRIPTS: Final = {
    "first-test": (
        "chair",
        "grep -A 8 '^def drive' test_chair.py",
        "tail -5 test_chair.py",
        "pytest -q",
        "sed -i 's/TRIES = 20/TRIES = 1/' test_chair.py",
        "pytest -q --tb=line",
    ),
    "demo": ("rigs", "tickrig demo fig120"),
}
"""By name: a folder of examples/, in a copy of which they run, and the commands."""

COLUMNS, ROWS = 92, 26
ENVIRONMENT: Final = {
    **{"PY_COLORS": "1", "COLUMNS": str(COLUMNS), "PYTHONDONTWRITEBYTECODE": "1"},
    **{"PYTEST_ADDOPTS": "-p no:cacheprovider -p no:randomly -p no:xdist"},
}
CELL: Final = (8, 17)
GROUND, INK = "#121212", "#e0e0e0"
KEY_S, LINE_S, READ_S, END_S = 0.03, 0.06, 1.8, 6.0


@dataclass
class Line:
    """A line of the terminal: when it appears, and how long it is typed."""

    text: Text
    at_s: float
    typed_s: float = 0.0


def lines_of(folder: str, *commands: str) -> list[Line]:
    """Run the commands and return what a terminal shows."""
    lines, now_s = list[Line](), 0.5
    with TemporaryDirectory() as scratch:
        place = Path(scratch, folder)
        shutil.copytree(EXAMPLES / folder, place, ignore=shutil.ignore_patterns("[._]*"))
        for command in commands:
            typed_s = KEY_S * len(command)
            lines.append(Line(Text(f"$ {command}", style="bold"), now_s, typed_s))
            now_s += typed_s + 0.3
            for text in _output(command, place):
                lines.append(Line(text, now_s))
                now_s += LINE_S
            now_s += READ_S
    return lines


def _output(command: str, place: Path) -> Iterator[Text]:
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=place,
        env={**os.environ, **ENVIRONMENT},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    said = done.stdout.replace(f"{place}/", "")
    said = re.sub(r" in [\d.]+s( \([\d:]+\))?", "", said)  # a run of this machine, on that day
    for line in said.rstrip("\n").splitlines():
        text = Text.from_ansi(line)
        text.truncate(COLUMNS)
        yield text


def svg(lines: list[Line]) -> str:
    """Return the picture."""
    wide, high = CELL
    width, height = COLUMNS * wide, ROWS * high + 8
    end_s = lines[-1].at_s + END_S
    rules = [
        "text{font:13.3px monospace;white-space:pre}.b{font-weight:bold}",
        f"g,text{{animation:0s step-end infinite;animation-duration:{end_s:.2f}s}}",
        _scrolling(lines, end_s),
        *(_appearing(row, line, end_s) for row, line in enumerate(lines)),
        "@media (prefers-reduced-motion){g,text{animation:none!important}}",
    ]
    scroll = max(0, len(lines) - ROWS) * high
    rules.append(f"#s{{transform:translateY(-{scroll}px);animation-name:s}}")
    body = "\n".join(_row(row, line) for row, line in enumerate(lines))
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" '
        f'viewBox="0 0 {width + 16} {height}" fill="{INK}">\n'
        f"<style>\n{chr(10).join(rules)}\n</style>\n"
        f'<rect width="100%" height="100%" rx="6" fill="{GROUND}"/>\n'
        f'<g id="s">\n{body}\n</g>\n</svg>\n'
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
    y = row * CELL[1] + 17
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
    Path(sys.argv[2]).write_text(svg(lines_of(*SCRIPTS[sys.argv[1]])), "utf-8")
