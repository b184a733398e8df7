"""Twins: independent copies of devices, wires and rigs while they run.

State is data: values, names and bound methods, never closures or lambdas. So all
that can be copied goes through pickle, `copy.deepcopy` too: the default one would
take bound methods of compiled classes for atoms, and such a copy would act on the
original.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from enum import Enum
from io import BytesIO
from typing import Any, ClassVar, NoReturn, SupportsIndex, TypeVar

T = TypeVar("T")
K = TypeVar("K")


class Immutable:
    """A description that never changes once it is made, as that of a dictionary.

    Copies within the process share it; a pickle has it by value.

    Attributes:
        shared_by_twins: true; a class of wire/ has this attribute instead of this base.
    """

    __slots__ = ()
    shared_by_twins = True

    def __copy__(self: T) -> T:
        """Return it itself."""
        return self

    def __deepcopy__(self: T, memo: dict[int, Any]) -> T:
        """Return it itself."""
        return self


class Copyable:
    """A machine whose twin is had by `copy.deepcopy`, `pickle` or `twin`.

    A twin that is fed the same does the same to the byte; fed otherwise it leaves the
    original untouched.

    Attributes:
        _new_in_twins: attributes, and what they are in a twin whatever the original has:
            callbacks of somebody outside.
    """

    __slots__ = ()
    _new_in_twins: ClassVar[Mapping[str, object]] = {}

    def __getstate__(self) -> object:
        """Return the state that a twin begins with."""
        state = super().__getstate__()
        attributes = state[1] if isinstance(state, tuple) else state
        if self._new_in_twins and isinstance(attributes, dict):
            attributes = {**attributes, **self._new_in_twins}
            return (state[0], attributes) if isinstance(state, tuple) else attributes
        return state

    def __copy__(self) -> NoReturn:
        """Refuse: a shallow copy would share its parts with the original."""
        raise TypeError(f"{type(self).__name__} cannot be copied by copy.copy: use copy.deepcopy")

    def __deepcopy__(self: T, memo: dict[int, Any]) -> T:
        """Return a twin, which has in common with other twins what the originals have."""
        return twin(self, memo)


class NonCopyable:
    """What belongs to its process; `copy.copy`, `deepcopy`, `pickle` and `twin` raise.

    Attributes:
        why_not_copied: the reason, for people.
    """

    __slots__ = ()
    why_not_copied = "the copy would act on the original; make a new one"

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> NoReturn:
        """Refuse; everything that copies asks here."""
        name = type(self).__name__
        raise TypeError(f"{name} cannot be copied or pickled: {self.why_not_copied}")


class Listeners(list[T]):
    """Callbacks of somebody outside. A twin begins with none: nobody listens to it yet."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[type[Listeners[T]], tuple[()]]:
        """Copy none of them."""
        return Listeners, ()


class Cache(dict[K, T]):
    """What can be worked out again. A twin begins with nothing."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[type[Cache[K, T]], tuple[()]]:
        """Copy nothing of it."""
        return Cache, ()


def itself(item: T) -> T:
    """Return what it is given: what `__reduce__` of a listener leaves is what it listens to."""
    return item


def twin(machine: T, memo: dict[int, Any] | None = None) -> T:
    """Return an independent copy of a device, a wire or a rig, as it is now.

    What is `Immutable` in it is shared.

    Args:
        machine: what is copied, with all that it refers to.
        memo: of a `copy.deepcopy` that this is a part of: what was copied by `id`.

    Raises:
        TypeError: something in it belongs to its process, or is a closure or a lambda.
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
    """Writes places in `shared` instead of what twins share."""

    def __init__(self, stream: BytesIO, known: dict[int, Any]) -> None:
        super().__init__(stream, pickle.HIGHEST_PROTOCOL)
        self.shared: list[object] = []
        self._known = known

    def reducer_override(self, item: object) -> Any:
        if isinstance(item, (Enum, type)) or getattr(type(item), "shared_by_twins", False):
            self.shared.append(item)
        elif id(item) in self._known and item is not _shared:
            self.shared.append(self._known[id(item)])
        else:
            return NotImplemented
        return _shared, (len(self.shared) - 1,)


class _Unpickler(pickle.Unpickler):
    """Finds what twins share where `_Pickler` has put it."""

    def __init__(self, stream: BytesIO, shared: list[object]) -> None:
        super().__init__(stream)
        self._items = shared

    def find_class(self, module: str, name: str) -> Any:
        return self._items.__getitem__ if name == "_shared" else super().find_class(module, name)


def _shared(place: int) -> NoReturn:
    """Stand in a stream for the list that only the process has which wrote it."""
    raise TypeError(f"item {place} of a twin was shared within its process")
