"""Monitored links and pyserial ports of hosts."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from time import monotonic_ns
from typing import Any, Final, Generic

import serial

from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.host.links.link import Link, LinkClosed, StampedFrames, StampedLink, W
from tickrig.host.links.ready import let_wait
from tickrig.host.links.serial_link import explain_open_error
from tickrig.host.text.trace import Mark
from tickrig.wire.can import CanFrame, ErrorFrame, Frames

# Reports of the connections of a bench about their hosts.

Seen = tuple[CanFrame | ErrorFrame, ...]
"""Frames of a bus connection."""


def _now_us() -> int:
    return monotonic_ns() // 1_000


class HostPace:
    """Measures how much longer a host has waited at a connection than it requested.

    The connection calls the methods when the host waits, sends or receives. A subclass can override
    `passed` to get the traffic of the connection.

    Attributes:
        late_us: largest delay up to now, in microseconds.
    """

    def __init__(self, now_us: Callable[[], int] = _now_us) -> None:
        self._now_us, self.late_us = now_us, 0

    def used(self) -> None:
        """Called before the host sends or waits; an exception raised here prevents that."""

    def passed(self, mark: Mark, traffic: Any) -> None:
        """Called with bytes or frames that the host has sent or received."""

    def waited(self, wanted_us: int, took_us: int) -> None:
        """Record a wait without result: the requested and the actual duration."""
        self.late_us = max(self.late_us, took_us - wanted_us)

    def sending(self, traffic: Any) -> AbstractContextManager[object]:
        """Return a context manager for sending bytes or frames; other connections may see them."""
        return nullcontext()

    @contextmanager
    def waiting(self, wanted_us: int) -> Iterator[None]:
        """Measure the wait inside the block, and record it by `waited`."""
        begun_us = self._now_us()
        yield
        self.waited(wanted_us, self._now_us() - begun_us)


class LinkGone(PortGone, LinkClosed):
    """Raised by a link whose port is gone; hosts that handle `LinkClosed` handle this, too."""


class WatchedLink(Generic[W]):
    """Wrapper of a host's `Link` that reports the traffic and the waits of the host to a monitor.

    Args:
        link: the wrapped link.
        watch: monitor that gets the reports.
    """

    def __init__(self, link: Link[W], watch: HostPace) -> None:
        self._link, self._watch, self._closed = link, watch, False

    @property
    def now_us(self) -> int:
        """The time of the monitored link."""
        return self._link.now_us

    def send(self, traffic: W, /) -> None:
        """Send traffic.

        Raises:
            LinkGone: the port is gone.
            LinkClosed: the link was closed.
        """
        self._watch.used()
        with self._told_if_gone(), self._watch.sending(traffic):
            self._link.send(traffic)
        self._watch.passed(Mark.TO_DEVICE, traffic)

    def receive(self, timeout_us: int, /) -> W:
        """Return the traffic that has arrived, or empty traffic after the time-out.

        Args:
            timeout_us: longest wait in microseconds.

        Raises:
            LinkGone: the port is gone.
            LinkClosed: the link was closed.
        """
        self._watch.used()
        begun_us = self.now_us
        with self._told_if_gone():
            traffic = self._link.receive(timeout_us)
        self._took(timeout_us, begun_us, traffic)
        return traffic

    def close(self) -> None:
        """Close the monitored link."""
        self._closed = True
        self._link.close()

    def _took(self, wanted_us: int, begun_us: int, traffic: W) -> None:
        if traffic:
            self._watch.passed(Mark.FROM_DEVICE, traffic)
        else:
            self._watch.waited(wanted_us, self.now_us - begun_us)

    @contextmanager
    def _told_if_gone(self) -> Iterator[None]:
        """Distinguish a lost port from a line that the host has closed."""
        try:
            yield
        except LinkClosed as error:
            if self._closed:
                raise
            raise LinkGone(str(error)) from error


class WatchedFrameLink(WatchedLink[Frames]):
    """Wrapper of a host's `StampedLink` to a CAN bus, for a monitor of the host.

    The monitor gets the frames of the host and the durations of the host's waits.

    Args:
        link: the wrapped link.
        watch: monitor that gets the reports.
    """

    def __init__(self, link: StampedLink, watch: HostPace) -> None:
        super().__init__(link, watch)
        self._stamped = link

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Wait for CAN frames; return a time, and all frames that had arrived by this time.

        Args:
            timeout_us: longest wait in microseconds.

        Raises:
            LinkGone: the bus is gone.
            LinkClosed: the link was closed.
        """
        self._watch.used()
        begun_us = self.now_us
        with self._told_if_gone():
            now_us, received = self._stamped.receive_stamped(timeout_us)
        self._took(timeout_us, begun_us, tuple(frame for _, frame in received))
        return now_us, received


# A monitored pyserial port.


class SerialGone(PortGone, serial.SerialException):
    """A port is gone; hosts can catch it as an error of pyserial."""


class WatchedPort(serial.SerialBase):
    """Monitoring added to a port class."""

    _watch: HostPace

    def read(self, size: int = 1) -> bytes:
        """Read from the port, and record data and delay."""
        self._watch.used()
        wanted_s, begun_ns = self.timeout, monotonic_ns()
        try:
            data = super().read(size)
        except serial.PortNotOpenError:
            raise
        except serial.SerialException as error:
            raise SerialGone(f"{self.port}: {error}") from error
        if data:
            self._watch.passed(Mark.FROM_DEVICE, data)
        if len(data) < size and wanted_s is not None:
            took_us = (monotonic_ns() - begun_ns) // 1_000
            self._watch.waited(round(wanted_s * 1e6), took_us)
        return data

    def write(self, data: Any) -> int | None:
        """Write to the port, and record the data."""
        self._watch.used()
        try:
            written = super().write(data)
        except (serial.PortNotOpenError, serial.SerialTimeoutException):
            raise
        except serial.SerialException as error:
            raise SerialGone(f"{self.port}: {error}") from error
        self._watch.passed(Mark.TO_DEVICE, bytes(data))
        return written


def open_watched_serial(url: str, watch: HostPace, options: dict[str, Any]) -> serial.SerialBase:
    """Open a pyserial port that reports its traffic and its waits to a monitor.

    Args:
        url: URL of the port for `serial.serial_for_url`.
        watch: monitor that gets the reports.
        options: options of `serial.Serial`.

    Raises:
        SerialGone: the port cannot be opened.
        ValueError: an option is out of range.
    """
    try:
        port = serial.serial_for_url(url, do_not_open=True, **options)
        kind = type(port)
        port.__class__ = type(kind.__name__, (WatchedPort, kind), {"_watch": watch})
        port.open()
        let_wait(port)
    except (serial.SerialException, OSError) as error:
        raise SerialGone(f"cannot open {url!r}: {explain_open_error(url, error)}") from error
    return port


# How late a bench was, and how long its threads had to wait for a processor.

# How late a bench was: in real time a device can be judged only by one that keeps up.

_LATE_US: Final = 5_000
"""Largest delay for a valid verdict: half a period of the RRC."""


def too_slow(**late_us: int) -> str:
    """Return a message if a part of the bench was too late for a valid test result, otherwise "".

    Args:
        late_us: largest delay of each part in microseconds, by name of the part.

    >>> too_slow(host=1_000, emulator=57_400)
    'the machine was too slow: host up to 1 ms, emulator up to 57 ms late'
    """
    if max(late_us.values()) <= _LATE_US:
        return ""
    times = ", ".join(f"{name} up to {us / 1_000:.0f} ms" for name, us in late_us.items())
    return f"the machine was too slow: {times} late"


# How long the threads of this process had to wait for a processor, as Linux counts it.

_TASKS: Final = Path("/proc/self/task")
_LOOK_US: Final = 10_000
"""Shortest time over which waits are added up. Sleeping threads wait a little at each wake-up."""

_LONG_US: Final = 20 * _LOOK_US
"""Longest time over which waits are added up, so that short waits are no large delay."""


class CpuWaits:
    """Measures how long the threads of this process had to wait for a processor.

    A thread waits for a processor when it could run, but other threads run instead. The waiting
    time is the second number in `schedstat` of each thread (Linux,
    Documentation/scheduler/sched-stats). On systems without this count the result is 0.

    Args:
        tasks: path of the folder with the threads.
        spares_looker: whether to omit the thread that calls `look`, because it measures its own
            delay.

    Attributes:
        worst_us: longest waiting time that a thread has collected between two updates, in
            microseconds. The method `look` makes the updates.
    """

    def __init__(self, tasks: Path = _TASKS, *, spares_looker: bool = False) -> None:
        self._tasks, self._spares_looker, self.worst_us = tasks, spares_looker, 0
        self._waited_ns: dict[str, int] = {}
        self._seen_us, self._own = -_LOOK_US, ""

    def look(self, now_us: int) -> None:
        """Update `worst_us` with the waits of all threads since the last update.

        Nothing is done if the last update is less than `_LOOK_US` ago. If it is more than
        `_LONG_US` ago, the waits since then are ignored. In such a long time, many short waits
        would add up and look like one long wait.

        Args:
            now_us: present time in microseconds.
        """
        passed_us, before = now_us - self._seen_us, self._waited_ns
        if passed_us < _LOOK_US:
            return
        if self._spares_looker and not self._own:
            self._own = str(threading.get_native_id())
        self._seen_us, self._waited_ns = now_us, self._read()
        if passed_us > _LONG_US:
            return
        for thread, waited_ns in self._waited_ns.items():
            longer_us = (waited_ns - before.get(thread, waited_ns)) // 1_000
            self.worst_us = max(self.worst_us, longer_us)

    def _read(self) -> dict[str, int]:
        waited_ns = {}
        with suppress(OSError):
            for thread in os.listdir(self._tasks):
                if thread == self._own:
                    continue
                with suppress(OSError, IndexError, ValueError):  # it has ended, or nobody counts
                    text = (self._tasks / thread / "schedstat").read_bytes()
                    waited_ns[thread] = int(text.split()[1])
        return waited_ns
