"""Independent copies of machines by pickle."""

from __future__ import annotations

import copyreg
import pickle
from collections.abc import Mapping
from enum import Enum
from io import BytesIO
from typing import Any, Final, NoReturn, TypeVar

# Theory of operation
# ===================
#
# A twin is made by pickling a machine into memory and loading it again, in the same process.
# `copy.deepcopy` would be the natural way but cannot be used: it treats the bound methods of
# compiled classes (mypyc) as atoms, and such a copy still acts on the original. Pickle asks each
# object how to copy it, so it finds these methods. Rules:
#
# - State is data. Attributes may be values, names, bound methods and `functools.partial` of these.
#   A lambda or a closure cannot be pickled, and `twin` raises TypeError.
# - Three things are shared and not copied: enumerations, classes, and everything that has the
#   attribute `shared_by_twins` (descriptions that never change). The pickler appends them to a list
#   and writes `_shared(place)` in their place. The unpickler finds the name `_shared` and takes the
#   item from the list. So a stream with shared items can only be loaded by the call that wrote it,
#   and `_shared` itself raises. A real pickle (`pickle.dumps`) does not use `_Pickler` and contains
#   everything by value.
# - Listeners and caches begin empty in a twin (listeners.py). Attributes named in `_new_in_twins`
#   begin with the value given there. The reason is that the callbacks of the original belong to
#   outside code.
# - In a `copy.deepcopy` of something larger, `memo` holds the objects that were copied before, and
#   receives those that are copied here. Pickler and unpickler number their memos alike, which gives
#   the pairs of original and copy. So two twins of one deepcopy share what their originals share.
#
# `state_of` and `restore` are the two halves of one format. They exist because a compiled class
# keeps its attributes outside `__dict__` and names them in `__mypyc_attrs__`, which pickle does not
# use; an interpreted class uses `object.__getstate__`. A class that defines one of `__getstate__`
# and `__setstate__` itself must define the other too, and must handle both kinds of attributes.
# After a change run `tests/device/test_twin.py` and `test_copies.py` both interpreted and compiled:
# most faults in this module appear in only one of them.

T = TypeVar("T")

_NOTHING: Final[Mapping[str, object]] = {}


def state_of(machine: object, begun: Mapping[str, object] = _NOTHING) -> Any:
    """Return the attributes from which a copy (twin) of a machine is made.

    `__getstate__` calls this function. It works for compiled classes, too.

    Args:
        machine: the machine to copy.
        begun: values by name of attribute. In the copy, these attributes have these values instead
            of the values that they have in the machine.

    Returns:
        The attributes of the machine by name. If some attributes are not in its `__dict__`, the
        result is a pair: the attributes in `__dict__`, and the other attributes.
    """
    state: Any
    compiled = getattr(type(machine), "__mypyc_attrs__", None)
    if compiled is None:
        state = object.__getstate__(machine)
    else:
        names = (*compiled, *copyreg._slotnames(type(machine)))  # type: ignore[attr-defined] # pickle asks it too
        own = {name: getattr(machine, name) for name in names if hasattr(machine, name)}
        state = own.pop("__dict__", None) or getattr(machine, "__dict__", None), own
    if not begun:
        return state
    if isinstance(state, tuple):
        kept = {name: value for name, value in (state[0] or {}).items() if name not in begun}
        return kept or None, {**state[1], **begun}
    return {**(state or {}), **begun}


def restore(machine: object, state: Any) -> None:
    """Set the state that `state_of` has returned; `__setstate__` uses this function."""
    attributes, others = state if isinstance(state, tuple) else (state, {})
    for name, value in {**(attributes or {}), **others}.items():
        object.__setattr__(machine, name, value)  # also of what is frozen


def twin(machine: T, memo: dict[int, Any] | None = None) -> T:
    """Return an independent copy of a device, a wire or a rig in its present state.

    `Immutable` parts are not copied but shared.

    Args:
        machine: machine to copy, with everything that it refers to.
        memo: copies by `id`, from an enclosing `copy.deepcopy`.

    Raises:
        TypeError: an object in the machine is bound to its process, or is a closure or a lambda.
    """
    stream = BytesIO()
    pickler = _Pickler(stream, memo or {})
    try:
        pickler.dump(machine)
    except (AttributeError, pickle.PicklingError) as error:
        what = machine[0] if isinstance(machine, tuple) else machine
        raise TypeError(f"{type(what).__name__} cannot be copied: {error}") from error
    stream.seek(0)
    unpickler = _Unpickler(stream, pickler.shared)
    copied: T = unpickler.load()
    if memo is not None:
        originals, copies = pickler.memo.copy(), unpickler.memo.copy()
        memo.setdefault(id(memo), []).append(originals)  # kept alive, so that no id is used twice
        memo.update((key, copies[place]) for key, (place, _) in originals.items())
    return copied


class _Pickler(pickle.Pickler):
    """Writes positions in `shared` instead of objects that twins share."""

    def __init__(self, stream: BytesIO, known: dict[int, Any]) -> None:
        super().__init__(stream, pickle.HIGHEST_PROTOCOL)
        self.shared: list[object] = []
        self._known = known

    def reducer_override(self, item: object) -> Any:
        if isinstance(item, (Enum, type)) or getattr(type(item), "shared_by_twins", False):
            self.shared.append(item)
        # `_shared` is a function, and the memo of an earlier copy may contain it. It must be
        # written by its name, or the unpickler would not recognise it.
        elif id(item) in self._known and item is not _shared:
            self.shared.append(self._known[id(item)])
        else:
            return NotImplemented
        return _shared, (len(self.shared) - 1,)


class _Unpickler(pickle.Unpickler):
    """Resolves shared objects from the list of `_Pickler`."""

    def __init__(self, stream: BytesIO, shared: list[object]) -> None:
        super().__init__(stream)
        self._items = shared

    def find_class(self, module: str, name: str) -> Any:
        return self._items.__getitem__ if name == "_shared" else super().find_class(module, name)


def _shared(place: int) -> NoReturn:
    """Raise an error; the shared objects of a stream exist only in the writing process."""
    raise TypeError(f"item {place} of a twin was shared within its process")
