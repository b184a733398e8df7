"""Bring a node back that was lost, a few times (ours)."""

from __future__ import annotations

from typing import Final

WELL_US: Final = 60_000_000
"""A node that was well for so long has all its restarts again."""


class Restart:
    """Counts the restarts of a node.

    Args:
        most: restarts one after the other, 0 for none.

    Attributes:
        pending: it was lost, and nothing was done about it yet.
        to_activate: it was Active, and is to be again once it is Inactive.
    """

    def __init__(self, most: int) -> None:
        self._most, self._made, self._last_us = most, 0, -WELL_US
        self.pending = self.to_activate = self._active = False

    def lose(self, now_us: int, *, active: bool) -> None:
        """Take note that a node was lost, without anybody's will."""
        if now_us - self._last_us >= WELL_US:
            self._made = 0
        self.pending = self._most > 0
        self._active |= active or self.to_activate
        self.to_activate = False

    def forget(self) -> None:
        """Leave it to a person."""
        self.pending = self.to_activate = self._active = False

    def leave(self) -> None:
        """Do nothing about it if somebody was faster; a restart that has begun goes on."""
        if self.pending:
            self.forget()

    def take(self, now_us: int) -> str:
        """Begin a restart; return which, as `1 of 3`, or nothing if none is left."""
        active = self._active
        self.forget()
        if self._made >= self._most:
            return ""
        self._made, self._last_us, self.to_activate = self._made + 1, now_us, active
        return f"{self._made} of {self._most}"
