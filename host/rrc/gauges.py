"""Gauges of panels as text: the square of a stick, bars, scales and lamps."""

from __future__ import annotations

from typing import Final

from rich.text import Text

ON: Final = "bold yellow"
FAULT: Final = "bold white on red"
DIM: Final = "bright_black"

_HALF: Final = 15  # cells of a bar on each side of zero


def stick_pad(v_pct: int, w_pct: int) -> Text:
    """Draw the stick in its square. Forward is up, and right is right."""
    row, column = 5 - round(v_pct / 20), 10 + round(w_pct / 10)
    text = Text()
    for y in range(11):
        for x in range(21):
            if (y, x) == (row, column):
                text.append("●", style=ON)
            else:
                text.append("┼" if (y, x) == (5, 10) else _axis(y, x), style=DIM)
        text.append("\n")
    return text.append(f"v {signed(v_pct)} %     w {signed(w_pct)} %")


def signed(percent: int) -> str:
    """Return a number in -100..100 as text of four columns."""
    return f"{percent:+4}" if percent else "   0"


def _axis(y: int, x: int) -> str:
    if y == 5:
        return "─"
    return "│" if x == 10 else "·" if y % 5 == 0 or x % 10 == 0 else " "


def bar(percent: int) -> Text:
    """Draw -100..100 % as a bar to the left or right of zero."""
    cells = round(abs(percent) * _HALF / 100)
    left = "█" * cells if percent < 0 else ""
    right = "█" * cells if percent > 0 else ""
    return Text.assemble(
        ("░" * (_HALF - len(left)), DIM),
        (left, ON),
        "│",
        (right, ON),
        ("░" * (_HALF - len(right)), DIM),
        f" {signed(percent)} %",
    )


def scale(value: int, top: int) -> Text:
    """Draw 1..top as filled and empty squares."""
    return Text.assemble(("■" * value, ON), ("□" * (top - value), DIM), f" {value}")


def lamp(label: str, value: int | str, style: str) -> Text:
    """Draw a lamp that is on or off."""
    return Text.assemble(("● ", style) if value else ("○ ", DIM), label)
