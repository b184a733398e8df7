"""A slave of a callable: what makes it at each power-on, or what is wrong with that."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from inspect import signature
from typing import Final

from tickrig.emulators.testing.conformance.slave import MEMBERS, TICK_US, SlaveCall, is_slave
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.errors import FieldError

STEP: Final = (0, ())
"""A time and frames."""
EXAMPLE: Final = "what makes the slave at each power-on, as `lambda: Mini(5).step`"


class NoFrames(Exception):  # noqa: N818 - what the slave has returned
    """What a slave has returned cannot go onto a bus; the text says what it was."""


class CalledSlave:
    """A slave of a callable: it is called each millisecond.

    Args:
        make: makes the callable, fresh from power-on; called once more at each power-on.

    Raises:
        ValueError: it makes none.
    """

    tick_us: int = TICK_US

    def __init__(self, make: Callable[[], SlaveCall]) -> None:
        if not callable(make):
            raise ValueError(_no_slave(make))
        if is_step(make):
            raise ValueError(f"{_name(make)} takes a time and frames: give {EXAMPLE}")
        call = make()
        if is_slave(call):
            raise ValueError(f"{_name(make)} makes a slave: give the slave itself")
        if not _takes(call, *STEP):
            given = f"{_name(make)} makes {_name(call)}"
            raise ValueError(f"{given}, which takes no time and frames: give {EXAMPLE}")
        self._make, self._call, self.due_us = make, call, 0

    def reset(self) -> None:
        """Make it anew."""
        self._call, self.due_us = self._make(), 0

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Call it."""
        self.due_us = now_us + self.tick_us
        return self._call(now_us, rx)


def is_step(node: object) -> bool:
    """Say whether it is what is called each millisecond, not what makes it."""
    return not is_slave(node) and _takes(node, *STEP) and not _takes(node)


def checked_frames(sent: object) -> Frames:
    """Return what a slave has sent, if that can go onto a bus.

    Raises:
        NoFrames: it cannot.
    """
    if isinstance(sent, CanFrame | str | bytes) or not isinstance(sent, Iterable):
        raise NoFrames(f"returned {_short(sent)}, not a list of CanFrame")
    frames = tuple(sent)
    for frame in frames:
        if not isinstance(frame, CanFrame):
            raise NoFrames(f"returned {_short(frame)} where a CanFrame should be")
        can_id, data, *_ = tuple[object, ...](frame)
        if not (isinstance(can_id, int) and isinstance(data, bytes | bytearray)):
            raise NoFrames(f"returned {_short(frame)}: can_id is an int, data are bytes")
        try:
            frame.checked()
        except FieldError as error:
            raise NoFrames(f"returned {_short(frame)}: {error}") from None
    return frames


def _takes(call: object, *given: object) -> bool:
    """Say whether it can be called so; of what C has made nobody knows it."""
    if not callable(call):
        return False
    try:
        signature(call).bind(*given)
    except TypeError:
        return False
    except ValueError:
        return bool(given)
    return True


def _no_slave(node: object) -> str:
    has = [name for name in MEMBERS if hasattr(node, name)]
    lacks = ", ".join(name for name in MEMBERS if name not in has)
    what = f"{_name(node)} is no slave: it has no {lacks}"
    return what if has else f"{what}; give {EXAMPLE}"


def _name(thing: object) -> str:
    return str(getattr(thing, "__qualname__", type(thing).__qualname__))


def _short(thing: object) -> str:
    text = repr(thing)
    return text if len(text) <= MOST else f"{text[:MOST]}..."


MOST: Final = 120
"""Characters of what a slave has returned."""
