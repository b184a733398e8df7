"""Run a library's classes on another clock, without touching the library.

A function finds `time` among the global names of its module. A copy of the
function with other global names is the same code on another clock. `retime`
gives one object a class of its own with such copies: other objects of that
class, and everything else in the process, stay as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import FunctionType

Names = Mapping[str, object]
"""Global names of a module, and what they shall mean."""


def retime(target: object, names: Names, library: str) -> None:
    """Let an object's methods see other global names.

    Methods of classes outside the library stay as they are: a subclass that
    reads the clock itself reads the real one.

    Args:
        target: the object; its class must not have slots.
        names: what the names shall mean.
        library: name of the package whose classes are meant.
    """
    cls = type(target)
    if (other := retimed(cls, names, library)) is not cls:
        target.__class__ = other


def retimed(cls: type, names: Names, library: str) -> type:
    """Return a subclass whose methods see other global names; the class itself if none does."""
    members = {
        name: copied
        for name, (owner, member) in _members(cls).items()
        if owner.__module__.partition(".")[0] == library
        and (copied := _copy(member, names)) is not None
    }
    return type(cls.__name__, (cls,), {"__module__": cls.__module__, **members}) if members else cls


def _members(cls: type) -> dict[str, tuple[type, object]]:
    """Return what each name means in a class, and which base it comes from."""
    found: dict[str, tuple[type, object]] = {}
    for base in cls.__mro__:
        for name, member in vars(base).items():
            found.setdefault(name, (base, member))
    return found


def _copy(member: object, names: Names) -> object | None:
    """Return a copy of a function or property that uses one of the names, else None."""
    if isinstance(member, FunctionType):
        return _copy_function(member, names) if _uses(member, names) else None
    if isinstance(member, property):
        parts = (member.fget, member.fset, member.fdel)
        copies = [_copy(part, names) for part in parts]
        if any(copies):
            return property(*(c or p for c, p in zip(copies, parts, strict=True)))  # type: ignore[arg-type]  # copies of functions
    return None


def _uses(function: FunctionType, names: Names) -> bool:
    return not names.keys().isdisjoint(function.__code__.co_names)


def _copy_function(function: FunctionType, names: Names) -> FunctionType:
    copied = FunctionType(
        function.__code__,
        {**function.__globals__, **names},
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )
    copied.__kwdefaults__ = function.__kwdefaults__
    return copied
