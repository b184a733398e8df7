"""Waiting for any number of descriptors, because `select` supports only descriptors below 1024.

>>> import os
>>> reader, writer = os.pipe()
>>> ready([reader], [writer], 0.0) == ([], [writer])
True
"""

from __future__ import annotations

import errno
import math
import os
import select
import sys
import time
from collections import deque
from collections.abc import Iterable, Sequence
from contextlib import suppress
from queue import Empty
from threading import TIMEOUT_MAX, Lock
from time import monotonic
from types import SimpleNamespace
from typing import Any, Final, Generic, Protocol, TypeVar

SELECTABLE: Final = 1_024
"""FD_SETSIZE, above which `select` does not support descriptors."""

_SPARE: Final = 8
"""Spare descriptors, because a port opens several."""

_FOREIGN: Final = (
    *("serial.serialposix", "serial.urlhandler.protocol_socket"),
    *("can.interfaces.socketcan.socketcan", "can.interfaces.udp_multicast.bus"),
)
"""Modules of other packages that wait with `select`."""


class _HasDescriptor(Protocol):
    """An object with a descriptor, such as a socket."""

    def fileno(self) -> int:
        """Return the descriptor."""
        ...


_Read = TypeVar("_Read", bound="int | _HasDescriptor")
_Written = TypeVar("_Written", bound="int | _HasDescriptor")


def ready(
    readers: Iterable[_Read], writers: Iterable[_Written] = (), wait_s: float | None = None
) -> tuple[list[_Read], list[_Written]]:
    """Wait until at least one file descriptor can be read or written, as `select` does.

    Args:
        readers: descriptors to read from, or objects with a descriptor.
        writers: descriptors to write to, or objects with a descriptor.
        wait_s: longest wait in seconds, or None to wait without limit.

    Returns:
        The descriptors that can be read, and the descriptors that can be written. Both lists
        include broken descriptors.

    Raises:
        OSError: a descriptor is closed.
    """
    readers, writers = list(readers), list(writers)
    if sys.platform != "win32":
        if max(map(_number, (*readers, *writers)), default=0) >= SELECTABLE:
            return _polled(readers, writers, wait_s)
    can_be_read, can_be_written, _ = select.select(readers, writers, [], wait_s)
    return can_be_read, can_be_written


if sys.platform != "win32":

    def _polled(
        readers: Sequence[_Read], writers: Sequence[_Written], wait_s: float | None
    ) -> tuple[list[_Read], list[_Written]]:
        """Wait with `poll`, which counts in whole milliseconds."""
        wanted: dict[int, int] = {}
        for sources, event in ((readers, select.POLLIN), (writers, select.POLLOUT)):
            for source in sources:
                wanted[_number(source)] = wanted.get(_number(source), 0) | event
        poll = select.poll()
        for number, events in wanted.items():
            poll.register(number, events)
        # Rounded down, and the rest slept: rounded up, each wait of a paced host would
        # be up to a millisecond late.
        whole_ms = None if wait_s is None else math.floor(max(0.0, wait_s) * 1e3)
        came = dict(poll.poll(whole_ms))
        if not came and wait_s is not None and (rest_s := wait_s - (whole_ms or 0) / 1e3) > 0:
            time.sleep(rest_s)
            came = dict(poll.poll(0))
        if any(events & select.POLLNVAL for events in came.values()):
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        # `select` calls what is broken ready for both, and whoever reads or writes then
        # finds the error; `poll` has events of its own for it.
        broken = select.POLLERR | select.POLLHUP
        return (
            [one for one in readers if came.get(_number(one), 0) & (select.POLLIN | broken)],
            [one for one in writers if came.get(_number(one), 0) & (select.POLLOUT | broken)],
        )


def _number(source: int | _HasDescriptor) -> int:
    return source if isinstance(source, int) else source.fileno()


def let_wait(opened: _HasDescriptor) -> None:
    """Make pyserial and python-can able to wait for descriptors with high numbers."""
    try:
        number = opened.fileno()
    except (OSError, AttributeError, NotImplementedError):  # it has none
        return
    if sys.platform != "win32" and number >= SELECTABLE - _SPARE:
        for name in _FOREIGN:
            module: Any = sys.modules.get(name)
            if getattr(module, "select", None) is select:
                module.select = SimpleNamespace(**{**vars(select), "select": _select})


def _select(
    readers: Sequence[Any], writers: Sequence[Any], broken: Sequence[Any], wait_s: Any = None
) -> tuple[list[Any], list[Any], list[Any]]:
    """Wait like `select.select`, with broken descriptors among the others."""
    return *ready(readers, writers, wait_s), []


# A queue whose waits end on time.

_T = TypeVar("_T")


class WaitingQueue(Generic[_T]):
    """Queue from which one thread reads and to which any threads write, safe against signals.

    A signal cannot block this queue. The queues of Python may block: after a signal,
    `queue.SimpleQueue` (CPython 3.11) may wait without end although it has a timeout, and
    `queue.Queue` may keep a lock acquired.
    """

    def __init__(self) -> None:
        self._items: deque[_T] = deque()
        self._nothing_new = Lock()
        self._nothing_new.acquire()

    def put(self, item: _T) -> None:
        """Append an item without blocking."""
        self._items.append(item)
        with suppress(RuntimeError):  # something else is new, too
            self._nothing_new.release()

    def get(self, wait_s: float | None = None) -> _T:
        """Remove the first item from the queue and return it. Wait for an item if there is none.

        Args:
            wait_s: longest wait in seconds, or None to wait without limit.

        Raises:
            Empty: no item arrived in time.
        """
        deadline_s = None if wait_s is None else monotonic() + wait_s
        while True:
            with suppress(IndexError):
                return self._items.popleft()
            left_s = (
                -1 if deadline_s is None else min(max(0, deadline_s - monotonic()), TIMEOUT_MAX)
            )
            if not self._nothing_new.acquire(timeout=left_s):
                raise Empty

    def clear(self) -> None:
        """Remove all items."""
        self._items.clear()
