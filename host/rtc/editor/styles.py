"""The styles that the editors have in common."""

from __future__ import annotations

from typing import Final

DIM: Final = "bright_black"
ALARM: Final = "bold red"
LIT: Final = "bold yellow"
"""Style of what is marked, or has changed."""

STATES: Final = {"ACTIVE": "bold green", "INACTIVE": "cyan", "ERROR": "bold white on red"}
"""Styles of components by their state."""
