"""Puts switches in place of functions, and puts all back."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from typing import Any

from tickrig.emulators.testing.host_clock.kept_names import all_places
from tickrig.emulators.testing.host_clock.switch import Act, MethodSwitch, Switch, root_of

Acts = Mapping[tuple[Any, str], Act]
"""What hosts find, by the module or class of a function and its name."""


class Switches:
    """Switches in place of functions, from `__enter__` to `__exit__`.

    They stand in modules and classes, and wherever a host's module has kept the function: by
    `from time import sleep`, as an attribute of a class, as the default of an argument. What
    other switches have replaced already comes back at the end.

    Args:
        acts: what hosts find.
    """

    def __init__(self, acts: Acts) -> None:
        self._acts, self._undo = acts, ExitStack()

    def __enter__(self) -> None:
        """Put them in place."""
        new: dict[int, tuple[Switch, Any]] = {}
        for (owner, name), act in self._acts.items():
            before = vars(owner)[name]
            switch = (MethodSwitch if isinstance(owner, type) else Switch)(before, act)
            new[id(root_of(before))] = switch, before
            self._undo.callback(setattr, owner, name, before)
            setattr(owner, name, switch)
            self._undo.callback(setattr, switch, "on", False)
        for place in all_places():
            switch_and_before = new.get(id(place.function))
            if switch_and_before is not None:
                switch, before = switch_and_before
                place.put(switch)
                self._undo.callback(place.put, before)

    def __exit__(self, *exception: object) -> None:
        """Put back what was there."""
        self._undo.close()
