"""Slaves for the conformance tester in virtual time, which get the time as argument."""

from __future__ import annotations

import linecache
from collections.abc import Callable, Iterable, Iterator
from inspect import signature
from pathlib import Path
from traceback import walk_tb
from typing import Final, Protocol, TypeGuard

from tickrig.host.canopen.conform.bus.exchange import Disturbed, NotAllowed, StepFailed
from tickrig.host.canopen.conform.check import Stimulus
from tickrig.host.canopen.conform.conform_run import Crash
from tickrig.wire.can import MAX_DATA_BYTES, STANDARD_MAX, CanFrame, Frames
from tickrig.wire.errors import FieldError

TICK_US: Final = 1_000


class Slave(Protocol):
    """Interface of a CANopen slave under test: `tick` gets the time and frames, and returns frames.

    The slaves of `tickrig.device` have this interface. To test your own slave, write a class with
    this interface. The class may wrap a C library.
    """

    @property
    def tick_us(self) -> int:
        """Period in microseconds, usually 1000; the slave is called at multiples of the period."""
        ...

    @property
    def due_us(self) -> int:
        """Time in microseconds at which the slave must be called even if no frame arrives.

        The slave is not called earlier, unless a frame arrives. A time in the past means the next
        tick. `tickrig.wire.instant.NEVER` means that the slave acts only on received frames.
        """
        ...

    def reset(self) -> None:
        """Switch the supply of the slave off and on.

        The slave boots in the next tick, and keeps stored parameters.
        """

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Run one tick of the slave: process the received frames, and return frames to send.

        Args:
            now_us: time since the start in microseconds, a multiple of `tick_us`.
            rx: frames that have arrived since the last call, in their order.

        Returns:
            The frames that the slave sends, in their order.
        """
        ...


SlaveCall = Callable[[int, Frames], Frames]
"""Function `tick` of a slave, which is called each millisecond."""

_MEMBERS: Final = ("tick", "due_us", "tick_us", "reset")
"""Members of a `Slave`."""


def is_slave(node: object) -> TypeGuard[Slave]:
    """Return whether a node has the members of a `Slave`; `__getattr__` may provide them."""
    return all(hasattr(node, name) for name in _MEMBERS)


# A slave from a callable: its factory for each power-on, and error messages.

_STEP: Final = (0, ())
"""Example arguments: a time and frames."""
_EXAMPLE: Final = "what makes the slave at each power-on, as `lambda: Mini(5).step`"


class _NoFrames(Exception):  # noqa: N818 - what the slave has returned
    """The result of a slave cannot be sent on a bus; the message describes it."""


class CalledSlave:
    """A slave for the conformance tester, made from a function that is called each millisecond.

    Args:
        make: function without arguments. It returns the function that is called each millisecond.
            `make` is called again at each power-on, and the slave then starts in its initial state.

    Raises:
        ValueError: `make` does not return such a function.
    """

    tick_us: int = TICK_US

    def __init__(self, make: Callable[[], SlaveCall]) -> None:
        if not callable(make):
            raise ValueError(_no_slave(make))
        if is_step(make):
            raise ValueError(f"{_name(make)} takes a time and frames: give {_EXAMPLE}")
        call = make()
        if is_slave(call):
            raise ValueError(f"{_name(make)} makes a slave: give the slave itself")
        if not _takes(call, *_STEP):
            given = f"{_name(make)} makes {_name(call)}"
            raise ValueError(f"{given}, which takes no time and frames: give {_EXAMPLE}")
        self._make, self._call, self.due_us = make, call, 0

    def reset(self) -> None:
        """Make a new callable."""
        self._call, self.due_us = self._make(), 0

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Call the callable."""
        self.due_us = now_us + self.tick_us
        return self._call(now_us, rx)


def is_step(node: object) -> bool:
    """Return whether an object can be called with a time and frames, but not without arguments.

    Such an object cannot be the argument `make` of `CalledSlave`, because `CalledSlave` calls
    `make` without arguments.
    """
    return not is_slave(node) and _takes(node, *_STEP) and not _takes(node)


def checked_frames(sent: object) -> Frames:
    """Return the frames that a slave's function has returned, if they can be sent on a CAN bus.

    Raises:
        _NoFrames: the value is not a tuple of frames that can be sent.
    """
    if type(sent) is tuple:
        for frame in sent:
            if type(frame) is not CanFrame or frame.remote or frame.extended:
                break
            number, payload, *_ = tuple[object, ...](frame)
            if type(number) is not int or type(payload) is not bytes or frame.remote_length:
                break
            if not 0 <= number <= STANDARD_MAX or len(payload) > MAX_DATA_BYTES:
                break
        else:
            return sent  # 11-bit data frames, which need no further check
    if isinstance(sent, CanFrame | str | bytes) or not isinstance(sent, Iterable):
        raise _NoFrames(f"returned {_short(sent)}, not a list of CanFrame")
    frames = tuple(sent)
    for frame in frames:
        if not isinstance(frame, CanFrame):
            raise _NoFrames(f"returned {_short(frame)} where a CanFrame should be")
        can_id, data, *_ = tuple[object, ...](frame)
        if not (isinstance(can_id, int) and isinstance(data, bytes | bytearray)):
            raise _NoFrames(f"returned {_short(frame)}: can_id is an int, data are bytes")
        try:
            frame.checked()
        except FieldError as error:
            raise _NoFrames(f"returned {_short(frame)}: {error}") from None
    return frames


def _takes(call: object, *given: object) -> bool:
    """Return whether a callable accepts the arguments; a guess for C functions."""
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
    has = [name for name in _MEMBERS if hasattr(node, name)]
    lacks = ", ".join(name for name in _MEMBERS if name not in has)
    what = f"{_name(node)} is no slave: it has no {lacks}"
    return what if has else f"{what}; give {_EXAMPLE}"


def _name(thing: object) -> str:
    return str(getattr(thing, "__qualname__", type(thing).__qualname__))


def _short(thing: object) -> str:
    text = repr(thing)
    return text if len(text) <= _MOST else f"{text[:_MOST]}..."


_MOST: Final = 120
"""Largest number of characters shown of a slave's result."""


# Exceptions of a slave's program or its stimuli, in one line, with their place.

_OURS: Final = "tickrig."


class Crashes:
    """Collects the exceptions of a tested program until a callback is set that receives them.

    Args:
        who: owner of the program, for messages, such as `your slave`.
    """

    def __init__(self, who: str) -> None:
        self._who, self._kept = who, list[tuple[str, list[str]]]()
        self._report: Crash = lambda reason, where: self._kept.append((reason, where))

    def __call__(self, error: Exception) -> None:
        """Record an exception."""
        self._report(_crash_text(error, self._who), _crash_lines(error))

    def watch(self, report: Crash) -> None:
        """Report the recorded exceptions now, and later exceptions when they occur."""
        self._report = report
        for reason, where in self._kept:
            report(reason, where)


def guarded(stimulus: Stimulus) -> Stimulus:
    """Return a stimulus whose unexpected exceptions make a check inconclusive."""

    def act(*words: str) -> str:
        try:
            return stimulus(*words)
        except (ValueError, NotAllowed, StepFailed, Disturbed):
            raise
        except Exception as error:
            raise Disturbed(_crash_text(error, "the stimulus")) from error

    return act


def _crash_text(error: Exception, who: str) -> str:
    """Return an exception as one line.

    >>> _crash_text(KeyError("x"), "your slave")
    "your slave raised KeyError: 'x'"
    """
    if isinstance(error, _NoFrames):
        return f"{who} {error}"
    kind = type(error)
    name = kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"
    text = " ".join(str(error).split())
    return f"{who} raised {name}: {text}" if text else f"{who} raised {name}"


def _crash_lines(error: Exception) -> list[str]:
    """Return the traceback lines, outermost first, without lines of tickrig before the user's."""
    if isinstance(error, _NoFrames):
        return []
    return list(_lines(error, _OURS)) or list(_lines(error, "no module"))


def _lines(error: Exception, but_for: str) -> Iterator[str]:
    for frame, line in walk_tb(error.__traceback__):
        if not str(frame.f_globals.get("__name__", "")).startswith(but_for):
            code = frame.f_code
            text = linecache.getline(code.co_filename, line, frame.f_globals).strip()
            yield f"{Path(code.co_filename).name}:{line} in {code.co_name}: {text}"
