"""Which code is a host's: that of users and of libraries, not Python, pytest, pyserial or ours."""

from __future__ import annotations

import os
import sys
import sysconfig
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import cache, partial
from itertools import chain
from operator import is_
from pathlib import Path
from select import select
from types import FrameType, FunctionType, MethodType, ModuleType
from typing import Any, Final, NamedTuple

# What is raised where a host deals with time as it cannot in virtual time.
#
# RuntimeError
#   HostTimeError         it waits where nobody can make time pass
#     UnpatchedTimeError  it waits for the clock of this machine


class HostTimeError(RuntimeError):
    """A host waits where nobody can make time pass."""


class UnpatchedTimeError(HostTimeError):
    """A host waits for the clock of this machine, or looks at it."""


_KEPT: Final = frozenset(
    {
        *("tickrig", "serial", "can", "canopen"),
        *("pytest", "_pytest", "pluggy", "iniconfig", "xdist", "execnet"),
        *("hypothesis", "coverage", "debugpy", "IPython", "ipykernel"),
    }
)
"""Packages that keep the clock of this machine.

pyserial, python-can and canopen are on a rig by objects of ours (`SimSerial`, the interface
`tickrig`, `SimNetwork`), which wait on it by themselves; on a real port they need real time.
"""

_KEPT_BEGINNINGS: Final = ("pytest_", "pydev", "_pydev")

_INSTALLED: Final = tuple(f"{os.sep}{name}{os.sep}" for name in ("site-packages", "dist-packages"))
_PYTHON: Final = tuple(f"{sysconfig.get_path(name)}{os.sep}" for name in ("stdlib", "platstdlib"))


@cache
def is_host(module: str, file: str) -> bool:
    """Return whether code is a host's.

    Args:
        module: name of its module.
        file: where it is, as its code object says.

    >>> is_host("my_robot.link", "/home/me/my_robot/link.py"), is_host("queue", "<frozen queue>")
    (True, False)
    """
    package = module.partition(".")[0]
    if package in _KEPT or package.startswith(_KEPT_BEGINNINGS) or file.startswith("<frozen"):
        return False
    return is_installed(file) or not file.startswith(_PYTHON)


@cache
def is_installed(file: str) -> bool:
    """Return whether a file is of an installed package."""
    return any(folder in file for folder in _INSTALLED)


def package_of(frame: FrameType) -> str:
    """Return the name of the package that is running."""
    name: str = frame.f_globals.get("__name__") or ""
    return name.partition(".")[0]


def line_of(frame: FrameType) -> str:
    """Return the file and line that are running, for people."""
    return place_of(frame.f_code.co_filename, frame.f_lineno)


def place_of(file: str, line: int) -> str:
    """Return a file and line for people."""
    path = Path(file)
    return f"{path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path}:{line}"


# Functions of the clock that mean something else to hosts for a while, by whatever name.

# A function that means something else to hosts, for a while.

_Act = Callable[..., Any]
"""Stands for a function: called with it, the frame that calls it, and its arguments."""


class Patch:
    """A function that hosts find in place of another one; all others find that one.

    Args:
        original: the other one.
        act: what hosts find.

    Attributes:
        original: the other one.
        act: what hosts find.
        on: whether it is in use; where somebody has kept it, it is the original afterwards.
    """

    def __init__(self, original: Callable[..., Any], act: _Act) -> None:
        self.original, self.on, self.act = original, True, act
        self.__name__, self.__doc__ = original.__name__, original.__doc__

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Look who calls."""
        __tracebackhide__ = True
        # The caller alone decides; one level up, because nothing stands between it and this
        # call.
        frame = sys._getframe(1)
        name = frame.f_globals.get("__name__") or ""
        if self.on and is_host(name, frame.f_code.co_filename):
            return self.act(self.original, frame, *args, **kwargs)
        return self.original(*args, **kwargs)


class _MethodSwitch(Patch):
    """A switch of a class: it is bound to its objects, as a function is."""

    def __get__(self, item: object, owner: type | None = None) -> Callable[..., Any]:
        """Bind it."""
        return self if item is None else MethodType(self, item)


def root_of(function: Any) -> Any:
    """Return what is behind switches; anything else is returned as it is."""
    while isinstance(function, Patch):
        function = function.original
    return function


# Where hosts keep functions of the clock under names of their own.

LOOKS: Final = (
    *("time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns"),
)
"""Functions of `time` that tell a time."""

KEEPABLE: Final = {
    id(found): found for found in (*(vars(time)[name] for name in (*LOOKS, "sleep")), select)
}
"""The functions, by their identity: not all that a module has can be hashed."""


class _Alias(NamedTuple):
    """Where a function is kept.

    Attributes:
        kept: returns what is there now.
        put: keeps another one there.
        function: the one that belongs there.
    """

    kept: Callable[[], Any]
    put: Callable[[Any], None]
    function: Any


class _HostModules:
    """The modules of hosts that are imported: each is looked at once, and again when it grows.

    With 1143 modules that takes 40 us where nothing has changed, and 240 if each is asked for.
    """

    def __init__(self) -> None:
        self._modules: tuple[object, ...] = ()
        self._hosts: dict[int, dict[str, Any]] = {}
        self._counts: list[int] = []
        self._places: dict[int, tuple[_Alias, ...]] = {}

    def places(self) -> Iterator[_Alias]:
        """Yield all places where functions were kept; something else may be there by now."""
        modules = tuple(sys.modules.values())
        # By identity and in order: comparing by equality would call `__eq__` of strange
        # modules.
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


_HOST_MODULES: Final = _HostModules()


def _names_of_host(module: object) -> dict[str, Any] | None:
    """Return what a module has by name; None if it is not a host's."""
    names = vars(module) if isinstance(module, ModuleType) else {}
    file = names.get("__file__")
    return names if isinstance(file, str) and is_host(str(names.get("__name__")), file) else None


def _places(names: dict[str, Any]) -> Iterator[_Alias]:
    module = names.get("__name__")
    for key, value in tuple(names.items()):
        if isinstance(value, FunctionType):
            if value.__module__ == module:
                yield from _defaults(value)
        elif isinstance(value, type):
            if value.__module__ == module:
                yield from _attributes(value)
        elif (function := _original(value)) is not None:
            yield _Alias(partial(names.get, key), partial(names.__setitem__, key), function)


def _attributes(owner: type) -> Iterator[_Alias]:
    for key, value in tuple(vars(owner).items()):
        if isinstance(value, FunctionType):
            yield from _defaults(value)
        elif isinstance(value, staticmethod):
            if (function := _original(value.__func__)) is not None:
                kept = partial(_static, owner, key)
                yield _Alias(kept, partial(_set_static, owner, key), function)
        elif (function := _original(value)) is not None:
            yield _Alias(partial(vars(owner).get, key), partial(setattr, owner, key), function)


def _defaults(function: FunctionType) -> Iterator[_Alias]:
    """Yield the defaults of its arguments."""
    for at, value in enumerate(function.__defaults__ or ()):
        if (found := _original(value)) is not None:
            kept = partial(_default, function, at)
            yield _Alias(kept, partial(_set_default, function, at), found)
    defaults = function.__kwdefaults__ or {}
    for key, value in defaults.items():
        if (found := _original(value)) is not None:
            yield _Alias(partial(defaults.get, key), partial(defaults.__setitem__, key), found)


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
    return KEEPABLE.get(id(root_of(value))) if isinstance(value, Patch) else found


# Puts switches in place of functions, and puts all back.

Acts = Mapping[tuple[Any, str], _Act]
"""What hosts find, by the module or class of a function and its name."""


class Patches:
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
        new: dict[int, Patch] = {}
        for (owner, name), act in self._acts.items():
            before = vars(owner)[name]
            switch = (_MethodSwitch if isinstance(owner, type) else Patch)(before, act)
            new[id(root_of(before))] = switch
            self._undo.callback(setattr, owner, name, before)
            setattr(owner, name, switch)
            # Whoever has kept the switch itself meanwhile finds the original in it from
            # then on.
            self._undo.callback(setattr, switch, "on", False)
        for place in _HOST_MODULES.places():
            switch_of_it, kept = new.get(id(place.function)), place.kept()
            if switch_of_it is not None and root_of(kept) is place.function:
                place.put(switch_of_it)
                self._undo.callback(_put_back, place, switch_of_it, kept)

    def __exit__(self, *exception: object) -> None:
        """Put back what was there."""
        self._undo.close()


def _put_back(place: _Alias, switch: Patch, before: Any) -> None:
    """Put back what was there, unless somebody has put something else there meanwhile."""
    if place.kept() is switch:
        place.put(before)
