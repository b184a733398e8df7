"""Instants: points in time as whole microseconds, counted from when their clock started."""

from __future__ import annotations

from typing import Final

NEVER: Final = 2**63 - 1
"""A time in microseconds that never comes: later than any other, and still an int of 64 bits."""
