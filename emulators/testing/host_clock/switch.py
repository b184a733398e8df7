"""A function that means something else to hosts, for a while."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import MethodType
from typing import Any

from tickrig.emulators.testing.host_clock.host_code import is_host

Act = Callable[..., Any]
"""Stands for a function: called with it, the frame that calls it, and its arguments."""


class Switch:
    """A function that hosts find in place of another one; all others find that one.

    Args:
        original: the other one.
        act: what hosts find.

    Attributes:
        original: the other one.
        act: what hosts find.
        on: whether it is in use; where somebody has kept it, it is the original afterwards.
    """

    def __init__(self, original: Callable[..., Any], act: Act) -> None:
        self.original, self.on, self.act = original, True, act
        self.__name__, self.__doc__ = original.__name__, original.__doc__

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Look who calls."""
        __tracebackhide__ = True
        frame = sys._getframe(1)
        name = frame.f_globals.get("__name__") or ""
        if self.on and is_host(name, frame.f_code.co_filename):
            return self.act(self.original, frame, *args, **kwargs)
        return self.original(*args, **kwargs)


class MethodSwitch(Switch):
    """A switch of a class: it is bound to its objects, as a function is."""

    def __get__(self, item: object, owner: type | None = None) -> Callable[..., Any]:
        """Bind it."""
        return self if item is None else MethodType(self, item)


def root_of(function: Any) -> Any:
    """Return what is behind switches; anything else is returned as it is."""
    while isinstance(function, Switch):
        function = function.original
    return function
