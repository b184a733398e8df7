"""The table of docs/performance.md: `tools/bench --page`, on a quiet machine."""

from __future__ import annotations

import os
import platform
import re
import statistics
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.sides import HERE, ROOT, Found, compiled, in_turn
from benchmarks.table import BUSY, Row, turn_ns

PAGE = ROOT / "docs" / "performance.md"
MARKED = re.compile(r"(?<=<!-- tools/bench --page -->\n).*?(?=<!-- end -->)", re.DOTALL)
SUITES = ("can", "canopen", "drives", "servo", "urg", "rtc", "rtc-canopen", "rrc")
ROUNDS = 2
OURS = "tickrig: "
PEERS = ("python-canopen LocalNode: ", "durand: ")
HEAD = "| work | pure | compiled | best peer | ratio |\n|---|---|---|---|---|\n"


def write(wheel: str) -> None:
    """Measure this tree, pure and compiled, and write the table into the page.

    Args:
        wheel: the compiled one; it is built if there is none.
    """
    with tempfile.TemporaryDirectory() as folder:
        tell = lambda text: print(text, file=sys.stderr, flush=True)  # noqa: E731 - one line says it
        tell("installing the compiled wheel" if wheel else "building the compiled wheel")
        sides = HERE, compiled(Path(folder), wheel)
        pure, fast = (merged(each) for each in in_turn(sides, SUITES, ROUNDS, tell))
    text = PAGE.read_text("utf-8")
    if not MARKED.search(text):
        raise SystemExit(f"{PAGE.name} has no place for the table: <!-- tools/bench --page -->")
    busy = sum(row.busy > BUSY for row in (*pure.values(), *fast.values()))
    said = (
        f"{os.cpu_count()} cores, {platform.python_implementation()} {platform.python_version()}, "
        f"{ROUNDS} rounds in turn; a turn of the fixed loop {turn_ns():.1f} ns; "
        f"{busy} of {len(pure) + len(fast)} rows taken under load.\n\n"
    )
    PAGE.write_text(MARKED.sub(lambda _: said + HEAD + "".join(lines(pure, fast)), text), "utf-8")


def merged(rounds: list[Found]) -> Found:
    """Return the rows with the values of all rounds."""
    found = {}
    for what, row in rounds[0].items():
        same = [each[what] for each in rounds]
        values = tuple(value for each in same for value in each.values)
        found[what] = Row(what, values, row.unit, statistics.median(each.busy for each in same))
    return found


def lines(pure: Found, fast: Found) -> Iterator[str]:
    """Yield a line for each work."""
    for what, row in pure.items():
        if what.startswith(PEERS):
            continue
        work = what.removeprefix(OURS)
        peers = [pure[peer + work] for peer in PEERS if peer + work in pure]
        best = max(peers, key=lambda peer: peer.median, default=None)
        ratio = f"{fast[what].median / best.median:.2f}" if best else ""
        named = f"{best.what.partition(': ')[0]} {told(best)}" if best else ""
        yield f"| {work} | {told(row)} | {told(fast[what])} | {named} | {ratio} |\n"


def told(row: Row) -> str:
    """Return a median with its unit, and a mark where the machine was busy."""
    return f"{row.median:,.4g} {row.unit}{'*' if row.busy > BUSY else ''}".strip()
