"""What `tickrig compare` prints: the first difference, the others, and a table of all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from tickrig.emulators.record.comparison import Pair, Said
from tickrig.host.text.values import counted, format_time

SHOWN: Final = 20
"""So many differences are listed."""

HEAD: Final = ("", "recorded", "emulated", "different", "worst")


def report(
    file: str, pairs: Mapping[str, Sequence[Pair]], tolerance_us: int, *, everything: bool
) -> tuple[list[str], bool]:
    """Return the lines of a comparison, and whether all is the same.

    Args:
        file: name of the trace.
        pairs: what was said, by device.
        tolerance_us: of the times.
        everything: list what is the same too.
    """
    rows = sorted(
        ((name, pair) for name, said in pairs.items() for pair in said),
        key=lambda row: row[1].at_us,
    )
    different = [row for row in rows if row[1].difference]
    listed = rows if everything else different[:SHOWN] if len(different) > 1 else []
    left = len(different) - len(listed) if listed and not everything else 0
    count = sum(pair.recorded is not None for _, pair in rows)
    result = f"different: {len(different)} of" if different else "same:"
    sections = (
        list(_first(file, *different[0])) if different else [],
        [_row(name, pair) for name, pair in listed] + [f"... and {left} more"] * bool(left),
        list(_table(pairs)),
        [f"{result} {counted(count, 'line')}, within {tolerance_us / 1_000:g} ms"],
    )
    lines = [line for section in sections if section for line in ("", *section)]
    return lines[1:], not different


def _first(file: str, name: str, pair: Pair) -> Iterator[str]:
    place = f" ({file}:{pair.recorded.line})" if pair.recorded and pair.recorded.line else ""
    yield f"different at {format_time(max(0, pair.at_us))} {name}{place}: {pair.difference}"
    yield f"  recorded < {_text(pair.recorded)}"
    yield f"  emulated < {_text(pair.emulated)}"


def _text(said: Said | None) -> str:
    return f"{said.text}  at {format_time(max(0, said.at_us))}" if said else "(nothing)"


def _row(name: str, pair: Pair) -> str:
    old, new = pair.recorded, pair.emulated
    late = f"{pair.late_us / 1_000:+9.1f}" if old and new else " " * 9
    sign = "!" if pair.difference else " "
    text = old.text if old else new.text if new else ""
    if old and new and old.text != new.text:
        text = f"{old.text} | {new.text}"
    missing = "" if old and new else "  (emulator alone)" if new else "  (recorded alone)"
    return f"{sign} {format_time(max(0, pair.at_us))} {late} ms  {name} {text}{missing}"


def _table(pairs: Mapping[str, Sequence[Pair]]) -> Iterator[str]:
    rows = [HEAD]
    for name, said in pairs.items():
        kinds: dict[str, list[Pair]] = {}
        for pair in said:
            kinds.setdefault(pair.kind, []).append(pair)
        rows += [_counts(f"{name} {kind}".strip(), kinds[kind]) for kind in sorted(kinds)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEAD))]
    for first, *numbers in rows:
        cells = (f"{cell:>{width}}" for cell, width in zip(numbers, widths[1:], strict=True))
        yield f"{first:<{widths[0]}}  {'  '.join(cells)}".rstrip()


def _counts(name: str, pairs: Sequence[Pair]) -> tuple[str, str, str, str, str]:
    worst_us = max((abs(pair.late_us) for pair in pairs), default=0)
    return (
        name,
        str(sum(pair.recorded is not None for pair in pairs)),
        str(sum(pair.emulated is not None for pair in pairs)),
        str(sum(bool(pair.difference) for pair in pairs)),
        f"{worst_us / 1_000:.1f} ms",
    )
