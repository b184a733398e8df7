"""Snapshots that restore machines in place: many runs from one state."""

from __future__ import annotations

import copyreg
import enum
import gc
import operator
import re
import struct
import weakref
from _random import Random
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from decimal import Decimal
from functools import partial
from io import BytesIO, StringIO
from types import (
    BuiltinFunctionType,
    CellType,
    CodeType,
    CoroutineType,
    FrameType,
    FunctionType,
    GeneratorType,
    GenericAlias,
    MappingProxyType,
    MethodType,
    MethodWrapperType,
    ModuleType,
)
from typing import Any, Final

from tickrig.device.twin.copyable import NonCopyable

# Theory of operation
# ===================
#
# A snapshot visits everything that machines refer to, once for each object. `_seen` holds the
# visited objects by id; it also keeps them alive, so that no id is used twice. For each object the
# snapshot notes a function that restores it. It does not copy objects: the same objects get their
# old contents again, so references to them stay valid. Kinds of objects, in the order in which they
# are tried:
#
# has `way_back`             supplies its own function; its contents are not visited
# `_NEVER_CHANGES`           not restored, but visited: a tuple may hold a list
# `_is_left`                 neither: numbers, classes, modules, loggers, what twins share
# functions, cells           the variables that they enclose
# generators, coroutines     only checked: one that has advanced cannot be restored
# containers                 contents, then attributes of their subclasses
# all others                 attributes, in `__dict__` and in slots
#
# Anything else that keeps state in C is refused with TypeError (`_is_plain`), because a file or a
# socket would otherwise silently not be restored. So a new kind of state needs a line in this table
# or a `way_back` of its own. The error names the class of the object and its owner.
#
# Two details matter. A dictionary is cleared and filled by the methods of `dict` itself, because a
# subclass may override them with effects of its own. An attribute that did not exist at the
# snapshot is deleted again, but only in interpreted classes: compiled ones cannot lose an
# attribute.

_PutBack = Callable[[], object]
"""Function that restores one object."""

_LEFT: Final = (
    *(int, str, bytes, float, complex, type(None), range, slice, type(...)),
    *(Decimal, type, ModuleType, CodeType, GenericAlias, re.Pattern, enum.Enum, struct.Struct),
    *(operator.attrgetter, operator.itemgetter, operator.methodcaller, property),
    *(weakref.ref, FrameType),
)
"""Types of objects that are not restored, because they never change or belong to the process."""

_NEVER_CHANGES: Final[tuple[type, ...]] = (
    *(tuple, frozenset, MethodType, BuiltinFunctionType, MethodWrapperType, partial),
    *(MappingProxyType, type({}.keys()), type({}.values()), type({}.items())),
)
"""Types whose objects never change, but refer to objects that may change."""

_LEFT_MODULES: Final = {"_thread", "datetime", "logging"}
"""Modules whose objects (locks, times, loggers) are not restored."""

_HEAP_TYPE: Final = 1 << 9
"""Type flag of a class written in Python."""


class MachineSnapshot:
    """The state of machines at one moment; `restore` restores the same objects to it.

    A twin is another machine. A restored machine is the same object, so references to it and to its
    wire stay valid. A snapshot costs a fraction of a copy. Objects made after the snapshot are not
    changed, and no restored object refers to them. So listeners added after the snapshot are
    removed.

    An object with a method `way_back` supplies its own restore function, and its contents are not
    visited. Not restored: classes, modules, functions except their closures, loggers, locks.

    Args:
        machines: devices, wires, rigs and hosts, with everything that they refer to.

    Raises:
        TypeError: an object in a machine cannot be restored, such as a file or a port of this
            computer.

    >>> numbers = {"of": [1, 2]}
    >>> snapshot = MachineSnapshot(numbers)
    >>> numbers["of"].append(3)
    >>> snapshot.restore()
    >>> numbers
    {'of': [1, 2]}
    """

    def __init__(self, *machines: object) -> None:
        self._put_back: tuple[_PutBack, ...] = tuple(_Walk().through(machines))

    def restore(self) -> None:
        """Restore the machine to its state at the time of the snapshot.

        The method may be called several times.

        Raises:
            TypeError: a generator has advanced since the snapshot, which cannot be undone.
        """
        for put_back in self._put_back:
            put_back()


class _Walk:
    """Visits each object that machines refer to once."""

    def __init__(self) -> None:
        self._seen: dict[int, object] = {}
        self._found: list[tuple[object, str]] = []

    def through(self, machines: tuple[object, ...]) -> Iterator[_PutBack]:
        """Yield the restore function of each object."""
        self._found = [(machine, "a snapshot") for machine in machines]
        while self._found:
            item, owner = self._found.pop()
            if id(item) in self._seen:
                continue
            self._seen[id(item)] = item
            way_back = getattr(type(item), "way_back", None)
            if way_back is not None:
                yield way_back(item)
            elif isinstance(item, _NEVER_CHANGES):
                self._find(item, gc.get_referents(item))
            elif not _is_left(item):
                yield from self._changing(item, owner)

    def _find(self, owner: object, items: Any) -> None:
        name = type(owner).__name__
        self._found.extend((item, name) for item in items)

    def _changing(self, item: Any, owner: str) -> Iterator[_PutBack]:
        if isinstance(item, FunctionType):
            self._find(item, item.__closure__ or ())
        elif isinstance(item, CellType):
            if (content := _content_of(item)) is not item:
                self._find(item, (content,))
                yield partial(setattr, item, "cell_contents", content)
        elif isinstance(item, GeneratorType | CoroutineType):
            self._find(item, gc.get_referents(item))
            yield partial(_check_place, item, _place_of(item))
        else:
            yield from self._contents(item, owner)
            yield from self._attributes(item)

    def _contents(self, item: Any, owner: str) -> Iterator[_PutBack]:
        """Yield the restore function of a container; raise TypeError if it cannot be restored."""
        if isinstance(item, dict):
            kept = dict(item)
            self._find(item, (*kept, *kept.values()))
            base = OrderedDict if isinstance(item, OrderedDict) else dict
            yield from (partial(base.clear, item), partial(base.update, item, kept))
        elif isinstance(item, list | deque | set):
            items, put = [*item], item.update if isinstance(item, set) else item.extend
            self._find(item, items)
            yield from (item.clear, partial(put, items))
        elif isinstance(item, bytearray):
            yield partial(item.__setitem__, slice(None), bytes(item))
        elif isinstance(item, Random):
            yield partial(Random.setstate, item, Random.getstate(item))
        elif isinstance(item, BytesIO | StringIO):
            yield partial(item.__setstate__, item.__getstate__())  # type: ignore[union-attr] # both have it
        elif isinstance(item, BaseException):
            self._find(item, item.args)
        elif not _is_plain(type(item)) or isinstance(item, NonCopyable):
            name = type(item).__name__
            raise TypeError(f"{name} cannot be put back, and {owner} has one")

    def _attributes(self, item: Any) -> Iterator[_PutBack]:
        """Yield the restore function of attributes; a frozen dataclass needs no such function."""
        kind, own = type(item), getattr(item, "__dict__", {})
        kept = dict(own)
        slots = [name for name in _slots_of(kind) if name != "__dict__"]
        values = {name: getattr(item, name) for name in slots if hasattr(item, name)}
        self._find(item, (*kept.values(), *values.values()))
        # What it refers to was found above; the object itself cannot have changed.
        if getattr(getattr(kind, "__dataclass_params__", None), "frozen", False):
            return
        if hasattr(item, "__dict__"):
            yield partial(_put_attributes, own, kept)
        for name, value in values.items():
            yield partial(getattr(kind, name).__set__, item, value)
        unset = () if hasattr(kind, "__mypyc_attrs__") else slots  # compiled, none can be deleted
        yield from (partial(_forget, item, name) for name in unset if name not in values)


def _is_left(item: object) -> bool:
    kind = type(item)
    shared = getattr(kind, "shared_by_twins", False)
    return shared or isinstance(item, _LEFT) or kind.__module__ in _LEFT_MODULES


def _slots_of(kind: type) -> list[str]:
    """Return the names of attributes that are not in `__dict__`."""
    return [*getattr(kind, "__mypyc_attrs__", ()), *copyreg._slotnames(kind)]  # type: ignore[attr-defined] # pickle asks it too


def _is_plain(kind: type) -> bool:
    """Return whether objects of a class have attributes only, without hidden state in C."""
    made = ((base, base.__new__) for base in kind.__mro__)
    solid = next(
        base
        for base, new in made
        if not base.__flags__ & _HEAP_TYPE
        or (isinstance(new, BuiltinFunctionType) and new.__self__ is base)
    )
    return solid is object or hasattr(kind, "__mypyc_attrs__")


def _put_attributes(own: dict[str, object], kept: dict[str, object]) -> None:
    own.update(kept)
    if len(own) != len(kept):
        for name in [name for name in own if name not in kept]:
            del own[name]


def _forget(item: object, name: str) -> None:
    if hasattr(item, name):
        delattr(item, name)


def _content_of(cell: CellType) -> object:
    """Return the content of a cell, or the cell itself if it is empty."""
    try:
        content: object = cell.cell_contents
    except ValueError:
        return cell
    return content


def _place_of(item: Any) -> int:
    """Return the position of a generator or coroutine, or -2 if it has ended."""
    frame = item.gi_frame if isinstance(item, GeneratorType) else item.cr_frame
    return -2 if frame is None else int(frame.f_lasti)


def _check_place(item: object, place: int) -> None:
    if _place_of(item) != place:
        name = getattr(item, "__qualname__", "")
        raise TypeError(f"{type(item).__name__} {name} has gone on, and cannot be put back")
