"""Where hosts keep functions of the clock under names of their own."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from functools import cache, partial
from select import select
from types import FunctionType, ModuleType
from typing import Any, Final, NamedTuple

from tickrig.emulators.testing.host_clock.host_code import is_host
from tickrig.emulators.testing.host_clock.switch import root_of

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
        put: keeps another one there.
        function: the one that belongs there.
    """

    put: Callable[[Any], None]
    function: Any


def all_places() -> Iterator[Place]:
    """Yield all places in modules of hosts that are imported."""
    for name, module in tuple(sys.modules.items()):
        if isinstance(module, ModuleType):
            yield from _places_of(name, module)


@cache
def _places_of(name: str, module: ModuleType) -> tuple[Place, ...]:
    """Return the places in a module; it is looked at once."""
    file = vars(module).get("__file__")
    return tuple(_places(module)) if isinstance(file, str) and is_host(name, file) else ()


def _places(module: ModuleType) -> Iterator[Place]:
    names = vars(module)
    for key, value in tuple(names.items()):
        if (function := _original(value)) is not None:
            yield Place(partial(names.__setitem__, key), function)
        elif isinstance(value, FunctionType) and value.__module__ == module.__name__:
            yield from _defaults(value)
        elif isinstance(value, type) and value.__module__ == module.__name__:
            yield from _attributes(value)


def _attributes(owner: type) -> Iterator[Place]:
    for key, value in tuple(vars(owner).items()):
        if (function := _original(value)) is not None:
            yield Place(partial(setattr, owner, key), function)
        elif isinstance(value, staticmethod):
            if (function := _original(value.__func__)) is not None:
                yield Place(partial(_set_static, owner, key), function)
        elif isinstance(value, FunctionType):
            yield from _defaults(value)


def _defaults(function: FunctionType) -> Iterator[Place]:
    """Yield the defaults of its arguments."""
    for at, value in enumerate(function.__defaults__ or ()):
        if (found := _original(value)) is not None:
            yield Place(partial(_set_default, function, at), found)
    defaults = function.__kwdefaults__ or {}
    for key, value in defaults.items():
        if (found := _original(value)) is not None:
            yield Place(partial(defaults.__setitem__, key), found)


def _set_default(function: FunctionType, at: int, value: Any) -> None:
    defaults = function.__defaults__ or ()
    function.__defaults__ = (*defaults[:at], value, *defaults[at + 1 :])


def _set_static(owner: type, key: str, value: Any) -> None:
    setattr(owner, key, staticmethod(value))


def _original(value: Any) -> Any:
    """Return the function that a value is or stands for, None if it is none of those."""
    return KEEPABLE.get(id(root_of(value)))
