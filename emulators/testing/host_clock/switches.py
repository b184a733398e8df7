"""Puts switches in place of functions, and puts all back."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from typing import Any

from tickrig.emulators.testing.host_clock.kept_names import HOST_MODULES, Place
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
        new: dict[int, Switch] = {}
        for (owner, name), act in self._acts.items():
            before = vars(owner)[name]
            switch = (MethodSwitch if isinstance(owner, type) else Switch)(before, act)
            new[id(root_of(before))] = switch
            self._undo.callback(setattr, owner, name, before)
            setattr(owner, name, switch)
            self._undo.callback(setattr, switch, "on", False)
        for place in HOST_MODULES.places():
            switch_of_it, kept = new.get(id(place.function)), place.kept()
            if switch_of_it is not None and root_of(kept) is place.function:
                place.put(switch_of_it)
                self._undo.callback(_put_back, place, switch_of_it, kept)

    def __exit__(self, *exception: object) -> None:
        """Put back what was there."""
        self._undo.close()


def _put_back(place: Place, switch: Switch, before: Any) -> None:
    """Put back what was there, unless somebody has put something else there meanwhile."""
    if place.kept() is switch:
        place.put(before)
