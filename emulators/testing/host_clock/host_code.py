"""Detection of host code, which excludes Python, pytest, pyserial and tickrig."""

from __future__ import annotations

import os
import sys
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

# Errors of hosts that use time in a way that virtual time does not support:
#
# - `HostTimeError`, a RuntimeError: the host waits, but nothing can advance the time.
# - `UnpatchedTimeError`, a HostTimeError: the host waits for the clock of this machine.
# - `HostHangsError`, an AssertionError: the host waits again and again, longer than it may.


class HostTimeError(RuntimeError):
    """A host waits where the time cannot be advanced."""

    __module__ = "tickrig"


class UnpatchedTimeError(HostTimeError):
    """A host waits by the clock of this machine, or reads it."""

    __module__ = "tickrig"


class HostHangsError(AssertionError):
    """Raised if a host waits longer than the limit of the bench, for example in an endless loop.

    In a search for failures, the class `BenchMachine` sets this limit.
    """

    __module__ = "tickrig"


_KEPT: Final = frozenset(
    {
        *("tickrig", "serial", "can", "canopen"),
        *("pytest", "_pytest", "pluggy", "iniconfig", "xdist", "execnet"),
        *("hypothesis", "coverage", "debugpy", "IPython", "ipykernel"),
    }
)
"""Packages that keep the clock of this machine. On a rig, pyserial, python-can and canopen use
objects of tickrig (`SimSerial`, the interface `tickrig`, `SimNetwork`), which wait on the rig
themselves. On a real port these packages need real time."""

_KEPT_BEGINNINGS: Final = ("pytest_", "pydev", "_pydev")

_INSTALLED: Final = tuple(f"{os.sep}{name}{os.sep}" for name in ("site-packages", "dist-packages"))


@cache
def _python_folders() -> tuple[str, ...]:
    """Return the folders of the standard library."""
    import sysconfig  # noqa: PLC0415 - slow

    return tuple(f"{sysconfig.get_path(name)}{os.sep}" for name in ("stdlib", "platstdlib"))


@cache
def is_host(module: str, file: str) -> bool:
    """Return whether code belongs to a host, and so uses the time of the bench.

    Args:
        module: name of the module of the code.
        file: path of the file in the code object.

    >>> is_host("my_robot.link", "/home/me/my_robot/link.py"), is_host("queue", "<frozen queue>")
    (True, False)
    """
    package = module.partition(".")[0]
    if package in _KEPT or package.startswith(_KEPT_BEGINNINGS) or file.startswith("<frozen"):
        return False
    return is_installed(file) or not file.startswith(_python_folders())


@cache
def is_installed(file: str) -> bool:
    """Return whether a file belongs to an installed package."""
    return any(folder in file for folder in _INSTALLED)


def place_of(file: str, line: int) -> str:
    """Return a file and line as text for messages."""
    path = Path(file)
    return f"{path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path}:{line}"


def host_places(frame: FrameType | None) -> list[str]:
    """Return the lines of host code in a Python call stack, from innermost to outermost.

    The last line in the result is a line of the test.

    Args:
        frame: innermost frame of the call stack.
    """
    places: list[str] = []
    while frame is not None:
        module, file = frame.f_globals.get("__name__") or "", frame.f_code.co_filename
        if places and module.startswith("_pytest."):
            break  # what lies beyond called pytest, and not the test
        if is_host(module, file):
            places.append(place_of(file, frame.f_lineno))
        frame = frame.f_back
    return places


def place_of_body(body: object) -> str:
    """Return file and line of host code at which a coroutine waits, or "" if there is none."""
    place = ""
    while (frame := getattr(body, "cr_frame", None)) is not None:
        file = frame.f_code.co_filename
        if is_host(frame.f_globals.get("__name__") or "", file):
            place = place_of(file, frame.f_lineno)
        body = getattr(body, "cr_await", None)
    return place


# Functions of the clock that mean something else to hosts for a while, by whatever name.

# A function that means something else to hosts, for a while.

_Act = Callable[..., Any]
"""Replacement of a function, called with the original, the calling frame and the arguments."""


class Patch:
    """Replacement of a function such as `time.sleep` for callers in host code.

    Other callers get the original function.

    Args:
        original: the original function.
        act: function that is called instead if the caller is a host.

    Attributes:
        original: the original function.
        act: function that is called instead if the caller is a host.
        on: whether the replacement is active. If it is not, all callers get the original function,
            also code that still has a reference to this object.
    """

    def __init__(self, original: Callable[..., Any], act: _Act) -> None:
        self.original, self.on, self.act = original, True, act
        self.__name__, self.__doc__ = original.__name__, original.__doc__

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the replacement if the caller is a host, or else the original."""
        __tracebackhide__ = True
        # The caller alone decides; one level up, because nothing stands between it and this
        # call.
        frame = sys._getframe(1)
        name = frame.f_globals.get("__name__") or ""
        if self.on and is_host(name, frame.f_code.co_filename):
            return self.act(self.original, frame, *args, **kwargs)
        return self.original(*args, **kwargs)


class _MethodSwitch(Patch):
    """A patch of a method. Like a function, the patch is bound to the objects of its class."""

    def __get__(self, item: object, owner: type | None = None) -> Callable[..., Any]:
        """Bind the patch to an object."""
        return self if item is None else MethodType(self, item)


def root_of(function: Any) -> Any:
    """Return the original of a patch; return other objects unchanged."""
    while isinstance(function, Patch):
        function = function.original
    return function


# Where hosts keep functions of the clock under names of their own.

LOOKS: Final = (
    *("time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns"),
)
"""Functions of `time` that return a time."""

KEEPABLE: Final = {
    id(found): found for found in (*(vars(time)[name] for name in (*LOOKS, "sleep")), select)
}
"""The functions by identity, because some objects in modules cannot be hashed."""


class _Alias(NamedTuple):
    """A place where a function is stored.

    Attributes:
        kept: function that returns the object that is stored at the place now.
        put: function that stores another object at the place.
        function: the original function.
    """

    kept: Callable[[], Any]
    put: Callable[[Any], None]
    function: Any


class _HostModules:
    """The imported modules of hosts. A module is scanned once, and again when it grows.

    A check of 1143 modules takes 40 us if nothing has changed, and 240 us if each module is looked
    up.
    """

    def __init__(self) -> None:
        self._modules: tuple[object, ...] = ()
        self._hosts: dict[int, dict[str, Any]] = {}
        self._counts: list[int] = []
        self._places: dict[int, tuple[_Alias, ...]] = {}

    def places(self) -> Iterator[_Alias]:
        """Yield all places where functions were stored; a place may hold another object now."""
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
        """Update the list of modules."""
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
        """Scan new and grown modules."""
        for (key, names), count, before in zip(
            self._hosts.items(), counts, self._counts, strict=True
        ):
            if count != before:
                self._places[key] = tuple(_places(names))
        self._counts = counts


_HOST_MODULES: Final = _HostModules()


def _names_of_host(module: object) -> dict[str, Any] | None:
    """Return the names of a module, or None if the module is not host code."""
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
    """Yield the defaults of the arguments of a function."""
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
    """Return the original clock function of a value, or None for other values."""
    found = KEEPABLE.get(id(value))
    return KEEPABLE.get(id(root_of(value))) if isinstance(value, Patch) else found


# Installs and removes switches.

Acts = Mapping[tuple[Any, str], _Act]
"""Replacements for hosts by the module or class of a function and the name of the function."""


class Patches:
    """Context manager that replaces functions such as `time.sleep` for host code.

    The functions are replaced in their modules and classes, and wherever a host's module has stored
    them: by `from time import sleep`, as an attribute of a class, or as the default of an argument.
    If another patch had already replaced a function, the function has that patch again at the end.

    Args:
        acts: replacements for hosts, by owner and name of the function.
    """

    def __init__(self, acts: Acts) -> None:
        self._acts, self._undo = acts, ExitStack()

    def __enter__(self) -> None:
        """Install the patches."""
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
        """Restore the original functions."""
        self._undo.close()


def _put_back(place: _Alias, switch: Patch, before: Any) -> None:
    """Restore the original, unless the place was changed by other code."""
    if place.kept() is switch:
        place.put(before)
