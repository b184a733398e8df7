"""Where hosts keep functions of the clock under names of their own."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from operator import is_
from select import select
from types import FunctionType, ModuleType
from typing import Any, Final, NamedTuple

from tickrig.emulators.testing.host_clock.host_code import is_host
from tickrig.emulators.testing.host_clock.switch import Switch, root_of

LOOKS: Final = (
    *("time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns"),
)
"""Functions of `time` that tell a time."""

KEEPABLE: Final = {
    id(found): found for found in (*(vars(time)[name] for name in (*LOOKS, "sleep")), select)
}
"""The functions, by their identity: not all that a module has can be hashed."""


class Place(NamedTuple):
    """Where a function is kept.

    Attributes:
        kept: returns what is there now.
        put: keeps another one there.
        function: the one that belongs there.
    """

    kept: Callable[[], Any]
    put: Callable[[Any], None]
    function: Any


class HostModules:
    """The modules of hosts that are imported: each is looked at once, and again when it grows.

    With 1143 modules that takes 40 us where nothing has changed, and 240 if each is asked for.
    """

    def __init__(self) -> None:
        self._modules: tuple[object, ...] = ()
        self._hosts: dict[int, dict[str, Any]] = {}
        self._counts: list[int] = []
        self._places: dict[int, tuple[Place, ...]] = {}

    def places(self) -> Iterator[Place]:
        """Yield all places where functions were kept; something else may be there by now."""
        modules = tuple(sys.modules.values())
        if len(modules) != len(self._modules) or not all(map(is_, modules, self._modules)):
            self._renew(modules)
        counts = list(map(len, self._hosts.values()))
        if counts != self._counts:
            self._look(counts)
        return chain.from_iterable(self._places.values())

    def _renew(self, modules: tuple[object, ...]) -> None:
        """Note which modules have come, and which have gone."""
        known = {id(module) for module in self._modules}
        hosts, before, self._modules = dict[int, dict[str, Any]](), self._hosts, modules
        for module in modules:
            key = id(module)
            names = before.get(key) if key in known else _names_of_host(module)
            if names is not None:
                hosts[key] = names
        counts = dict(zip(before, self._counts, strict=True))
        self._hosts, self._counts = hosts, [counts.get(key, -1) for key in hosts]
        self._places = {key: found for key, found in self._places.items() if key in hosts}

    def _look(self, counts: list[int]) -> None:
        """Look at the modules that have come or grown."""
        for (key, names), count, before in zip(
            self._hosts.items(), counts, self._counts, strict=True
        ):
            if count != before:
                self._places[key] = tuple(_places(names))
        self._counts = counts


HOST_MODULES: Final = HostModules()


def _names_of_host(module: object) -> dict[str, Any] | None:
    """Return what a module has by name; None if it is not a host's."""
    names = vars(module) if isinstance(module, ModuleType) else {}
    file = names.get("__file__")
    return names if isinstance(file, str) and is_host(str(names.get("__name__")), file) else None


def _places(names: dict[str, Any]) -> Iterator[Place]:
    module = names.get("__name__")
    for key, value in tuple(names.items()):
        if isinstance(value, FunctionType):
            if value.__module__ == module:
                yield from _defaults(value)
        elif isinstance(value, type):
            if value.__module__ == module:
                yield from _attributes(value)
        elif (function := _original(value)) is not None:
            yield Place(partial(names.get, key), partial(names.__setitem__, key), function)


def _attributes(owner: type) -> Iterator[Place]:
    for key, value in tuple(vars(owner).items()):
        if isinstance(value, FunctionType):
            yield from _defaults(value)
        elif isinstance(value, staticmethod):
            if (function := _original(value.__func__)) is not None:
                kept = partial(_static, owner, key)
                yield Place(kept, partial(_set_static, owner, key), function)
        elif (function := _original(value)) is not None:
            yield Place(partial(vars(owner).get, key), partial(setattr, owner, key), function)


def _defaults(function: FunctionType) -> Iterator[Place]:
    """Yield the defaults of its arguments."""
    for at, value in enumerate(function.__defaults__ or ()):
        if (found := _original(value)) is not None:
            kept = partial(_default, function, at)
            yield Place(kept, partial(_set_default, function, at), found)
    defaults = function.__kwdefaults__ or {}
    for key, value in defaults.items():
        if (found := _original(value)) is not None:
            yield Place(partial(defaults.get, key), partial(defaults.__setitem__, key), found)


def _default(function: FunctionType, at: int) -> Any:
    defaults = function.__defaults__ or ()
    return defaults[at] if at < len(defaults) else None


def _set_default(function: FunctionType, at: int, value: Any) -> None:
    defaults = function.__defaults__ or ()
    function.__defaults__ = (*defaults[:at], value, *defaults[at + 1 :])


def _static(owner: type, key: str) -> Any:
    return getattr(vars(owner).get(key), "__func__", None)


def _set_static(owner: type, key: str, value: Any) -> None:
    setattr(owner, key, staticmethod(value))


def _original(value: Any) -> Any:
    """Return the function that a value is or stands for, None if it is none of those."""
    found = KEEPABLE.get(id(value))
    return KEEPABLE.get(id(root_of(value))) if isinstance(value, Switch) else found
