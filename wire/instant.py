"""Instants: points in time as whole microseconds, counted from when their clock started."""

from __future__ import annotations

from typing import Final

NEVER: Final = 2**62 - 1
"""A time in microseconds that never comes: later than any other.

It is the largest int that compiled code keeps without an object (drives: 5 % of their time).
"""
