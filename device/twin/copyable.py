"""What can be copied while it runs, what never changes, and what belongs to its process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NoReturn, SupportsIndex, TypeVar

from tickrig._compiled import mypyc_attr
from tickrig.device.twin.pickler import restore, state_of, twin

T = TypeVar("T")


@mypyc_attr(allow_interpreted_subclasses=True, serializable=True)
class Immutable:
    """A description that never changes once it is made, as that of a dictionary.

    Copies within the process share it; a pickle has it by value.

    Attributes:
        shared_by_twins: true; a class of wire/ has this attribute instead of this base.
    """

    __slots__ = ()
    shared_by_twins: ClassVar[bool] = True

    def __getstate__(self) -> object:
        """Return the state for a pickle."""
        return state_of(self)

    def __setstate__(self, state: object) -> None:
        """Become what was pickled."""
        restore(self, state)

    def __copy__(self: T) -> T:
        """Return it itself."""
        return self

    def __deepcopy__(self: T, memo: dict[int, Any]) -> T:
        """Return it itself."""
        return self


@mypyc_attr(serializable=True)
class Part:
    """What a machine consists of; it is copied with it."""

    __slots__ = ()


@mypyc_attr(allow_interpreted_subclasses=True, serializable=True)
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
        return state_of(self, self._new_in_twins)

    def __copy__(self) -> NoReturn:
        """Refuse: a shallow copy would share its parts with the original."""
        raise TypeError(f"{type(self).__name__} cannot be copied by copy.copy: use copy.deepcopy")

    def __deepcopy__(self: T, memo: dict[int, Any]) -> T:
        """Return a twin, which has in common with other twins what the originals have."""
        return twin(self, memo)


@mypyc_attr(allow_interpreted_subclasses=True)
class NonCopyable:
    """What belongs to its process; `copy.copy`, `deepcopy`, `pickle` and `twin` raise.

    Attributes:
        why_not_copied: the reason, for people.
    """

    __slots__ = ()
    why_not_copied: ClassVar[str] = "the copy would act on the original; make a new one"

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> NoReturn:
        """Refuse; everything that copies asks here."""
        name = type(self).__name__
        raise TypeError(f"{name} cannot be copied or pickled: {self.why_not_copied}")


def itself(item: T) -> T:
    """Return what it is given: what `__reduce__` of a listener leaves is what it listens to."""
    return item
