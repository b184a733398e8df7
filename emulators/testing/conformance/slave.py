"""What the conformance tester can judge in virtual time: a slave that is told the time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol, TypeGuard

from tickrig.wire.can import Frames

TICK_US: Final = 1_000


class Slave(Protocol):
    """A CANopen slave as a machine: frames in with the time, frames out.

    A slave of `tickrig.device` is one. Yours is, too, if it takes the time as an argument and
    says when it next wants to be called; it may be written around a library in C.
    """

    @property
    def tick_us(self) -> int:
        """How often it looks, in microseconds: it is called at multiples of it, 1000 is usual."""
        ...

    @property
    def due_us(self) -> int:
        """When it would do something without being sent anything, in microseconds.

        A time that has passed means: in the next tick. `tickrig.wire.instant.NEVER`: not by
        itself. It is not called before, unless a frame arrives.
        """
        ...

    def reset(self) -> None:
        """Lose and get back the power: it boots in the next tick, and keeps what was stored."""

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Do what is to be done.

        Args:
            now_us: time since the beginning in microseconds, a multiple of `tick_us`.
            rx: frames that arrived since the last call, in their order.

        Returns:
            The frames that it sends, in their order.
        """
        ...


SlaveCall = Callable[[int, Frames], Frames]
"""The `tick` of a slave alone, called each millisecond."""

MEMBERS: Final = ("tick", "due_us", "tick_us", "reset")
"""What a `Slave` has."""


def is_slave(node: object) -> TypeGuard[Slave]:
    """Say whether a node has the members of a `Slave`, by `__getattr__` too."""
    return all(hasattr(node, name) for name in MEMBERS)
