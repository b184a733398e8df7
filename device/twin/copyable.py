"""Base classes: copyable machines, immutable descriptions, and objects bound to their process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NoReturn, SupportsIndex, TypeVar

from tickrig._compiled import mypyc_attr
from tickrig.device.twin.pickler import restore, state_of, twin

T = TypeVar("T")


@mypyc_attr(allow_interpreted_subclasses=True, serializable=True)
class Immutable:
    """Base class of objects that never change after creation, such as descriptions.

    If an emulated device (a machine) is copied within the process, the original and the copy share
    such an object. A pickle contains the value of the object.

    Attributes:
        shared_by_twins: flag that is always true. The code that copies machines reads it, and
            shares the object instead of copying it.
    """

    # A class in `tickrig.wire` has the flag itself instead of this base class, because that package
    # does not import `tickrig.device`.

    __slots__ = ()
    shared_by_twins: ClassVar[bool] = True

    def __getstate__(self) -> object:
        """Return the state for a pickle."""
        return state_of(self)

    def __setstate__(self, state: object) -> None:
        """Restore the pickled state."""
        restore(self, state)

    def __copy__(self: T) -> T:
        """Return the object itself."""
        return self

    def __deepcopy__(self: T, memo: dict[int, Any]) -> T:
        """Return the object itself."""
        return self


@mypyc_attr(serializable=True)
class Part:
    """A part of a machine, which is copied with the machine."""

    __slots__ = ()


@mypyc_attr(allow_interpreted_subclasses=True, serializable=True)
class Copyable:
    """Base class of machines that `copy.deepcopy`, `pickle` and `twin` can copy while they run.

    A twin is such a copy. With the same input it behaves exactly as the original, to the byte.
    Other input to the twin does not affect the original.

    Attributes:
        _new_in_twins: names of attributes that are not copied, such as callbacks of outside code,
            and the values that these attributes get in a twin.
    """

    __slots__ = ()
    _new_in_twins: ClassVar[Mapping[str, object]] = {}

    def __getstate__(self) -> object:
        """Return the initial state of a twin."""
        return state_of(self, self._new_in_twins)

    def __copy__(self) -> NoReturn:
        """Raise TypeError, because a shallow copy would share its parts with the original."""
        raise TypeError(f"{type(self).__name__} cannot be copied by copy.copy: use copy.deepcopy")

    def __deepcopy__(self: T, memo: dict[int, Any]) -> T:
        """Return a twin; twins of one deepcopy share the parts that their originals share."""
        return twin(self, memo)


@mypyc_attr(allow_interpreted_subclasses=True)
class NonCopyable:
    """Base class of objects that cannot be copied, because they are bound to their process.

    `copy.copy`, `deepcopy`, `pickle` and `twin` raise TypeError for them.

    Attributes:
        why_not_copied: reason as readable text, for the message of the error.
    """

    __slots__ = ()
    why_not_copied: ClassVar[str] = "the copy would act on the original; make a new one"

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> NoReturn:
        """Raise TypeError; all ways of copying call this method."""
        name = type(self).__name__
        raise TypeError(f"{name} cannot be copied or pickled: {self.why_not_copied}")


def itself(item: T) -> T:
    """Return the argument; `__reduce__` of a listener uses it."""
    return item
