"""A CAN link to a real bus, or to any other bus of python-can.

The module also converts between frames and messages of python-can.

>>> to_frame(to_message(CanFrame.parse("00000605#40"))) == CanFrame.parse("00000605#40")
True
"""

from __future__ import annotations

import errno
import logging
import os
import socket
import sys
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from functools import partial
from typing import Any, Final

import can

from tickrig.host.links.link import TRACEBACK, LinkClosed, LinkError, StampedFrames, first_line
from tickrig.host.links.ready import let_wait
from tickrig.host.text.log import log_of
from tickrig.wire.can import (
    BRS,
    CONTROLLER_BYTE,
    ERROR_CLASS_MASK,
    ESI,
    CanFrame,
    ControllerFlag,
    ErrorClass,
    ErrorFrame,
    ErrorState,
    FdFrame,
    Frames,
)

_HINTS: Final = {
    errno.EAFNOSUPPORT: "this kernel has no SocketCAN; udp_multicast needs none",
    errno.ENODEV: "no such CAN interface; a virtual one is made by"
    " 'ip link add dev NAME up type vcan'",
}
_NO_MSGPACK: Final = "msgpack not installed"


def to_message(frame: CanFrame | FdFrame, at_us: int = 0) -> can.Message:
    """Convert a frame to a python-can message, whose time stamp is in seconds."""
    if isinstance(frame, FdFrame):
        return _fd_message(frame, at_us)
    return can.Message(
        timestamp=at_us / 1e6,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=frame.dlc,
        data=None if frame.remote else frame.data,
    )


def _fd_message(frame: FdFrame, at_us: int) -> can.Message:
    return can.Message(
        timestamp=at_us / 1e6,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_fd=True,
        bitrate_switch=frame.brs,
        error_state_indicator=frame.esi,
        dlc=len(frame.data),
        data=frame.data,
    )


def to_frame(message: can.Message) -> CanFrame | None:
    """Convert a python-can message to a CAN frame. For an error or CAN FD frame, return None."""
    if message.is_error_frame or message.is_fd:
        return None
    remote = message.is_remote_frame
    return CanFrame(
        message.arbitration_id,
        b"" if remote else bytes(message.data),
        remote,
        message.is_extended_id,
        message.dlc if remote else 0,
    )


def to_fd_frame(message: can.Message) -> FdFrame | None:
    """Convert a python-can message to a CAN FD frame. For any other frame, return None.

    The frame may be invalid: from an ASC log, python-can reads a CAN FD frame without data as a
    remote frame, although CAN FD has no remote frames.
    """
    if not message.is_fd or message.is_error_frame:
        return None
    flags = BRS * message.bitrate_switch | ESI * message.error_state_indicator
    return FdFrame(message.arbitration_id, bytes(message.data), message.is_extended_id, flags)


def to_error_frame(message: can.Message) -> ErrorFrame | None:
    """Convert a message to an error frame. Return None for other messages."""
    if not message.is_error_frame:
        return None
    data = bytes(message.data)[:8].ljust(8, b"\0")
    return ErrorFrame(message.arbitration_id & ERROR_CLASS_MASK, data)


_DRIFT: Final = 5_000
"""Reciprocal of the largest drift between two clocks, which is 200 ppm."""


class StampClock:
    """Converter from time stamps of a CAN driver to arrival times on the clock of this host.

    The clock of the driver starts at an unknown time (1970, or power-on) and drifts, so the
    converter estimates the offset between the two clocks. The difference between the reading time
    and the time stamp of a frame contains the offset and a delay. Therefore the smallest difference
    is used as the offset.

    A frame cannot have arrived before the last poll that found no frame, so this poll limits the
    result. If the time stamps are wrong, or the clock of the driver jumps, the results are
    therefore wrong only while the host is late.

    >>> clock = StampClock()
    >>> clock.at_us(7.0, 0, 100), clock.at_us(7.3, 100, 900_000)  # stopped for 0.9 s
    (100, 300160)
    >>> clock.at_us(0.0, 900_000, 910_000)  # a driver without stamps
    910000
    """

    def __init__(self) -> None:
        self._ahead_us = 0
        self._stamp_us: int | None = None

    def at_us(self, stamp_s: float, polled_us: int, now_us: int) -> int:
        """Return the arrival time of a frame on the host's clock, in microseconds.

        Args:
            stamp_s: time stamp of the driver in seconds, or 0 if it gives none.
            polled_us: time of the last poll that found no frame. The frame arrived later, so the
                result is not less than this time.
            now_us: time at which the frame was read.
        """
        stamp_us = round(stamp_s * 1e6)
        if stamp_us <= 0:
            return now_us
        # The smallest of these differences is the one of the frame that was read soonest.
        ahead_us = now_us - stamp_us
        if self._stamp_us is not None and stamp_us >= self._stamp_us:
            least_us = self._ahead_us + (stamp_us - self._stamp_us) // _DRIFT
            ahead_us = min(ahead_us, least_us)
        self._stamp_us, self._ahead_us = stamp_us, ahead_us
        return max(polled_us, stamp_us + ahead_us)


INTERFACE: Final = "udp_multicast"
_IP_MULTICAST_ALL: Final = 49
_IPV6_MULTICAST_ALL: Final = 29


_SO_RCVBUFFORCE: Final = 33
_RECEIVE_BYTES: Final = 4 << 20
"""Requested size of the kernel's queue, which is some 10 000 frames. Without root, the size is
limited to net.core.rmem_max.
"""


def _receive(recv: Callable[[float], can.Message | None], timeout_s: float) -> can.Message | None:
    """Return the next message of a bus, or None after the timeout.

    python-can measures a wait by the wall clock. If the wall clock is set back by an hour, the wait
    is an hour longer. This function uses the monotonic clock.

    Args:
        recv: method `recv` of the bus. A `recv` that is not python-can's own is called unchanged.
        timeout_s: longest wait in seconds. 0 only polls.
    """
    # A bus that has a `recv` of its own waits in its own way: leave it.
    if getattr(recv, "__func__", None) is not can.BusABC.recv:
        return recv(timeout_s)
    bus: can.BusABC = recv.__self__  # type: ignore[attr-defined] # a bound method has it
    until_s = time.monotonic() + timeout_s
    left_s = timeout_s
    while True:
        message, filtered = bus._recv_internal(left_s)
        if message and (filtered or bus._matches_filters(message)):
            return message
        left_s = until_s - time.monotonic()
        if left_s <= 0:
            return None


def _enlarge_queue(sock: socket.socket) -> None:
    """Enlarge the kernel's queue, so that no frame is lost while this process is delayed.

    300 frames take 40 ms.
    """
    try:
        sock.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _RECEIVE_BYTES)
    except OSError:  # PermissionError, and no such option beside Linux
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BYTES)


def prepare_bus(bus: can.BusABC, interface: str) -> None:
    """Set up a python-can bus: enlarge its receive queue, and filter out foreign multicast groups.

    On Linux, a socket of `udp_multicast` also receives the data of every other group that a program
    on this machine has joined on the same port (ip(7), IP_MULTICAST_ALL). This function switches
    that off.

    The driver of socketcand logs each exception that it raises, with a traceback. These log
    messages are dropped, because the reader of the bus reports the exceptions.
    """
    let_wait(bus)
    if interface == "socketcand":
        logging.getLogger("can.interfaces.socketcand.socketcand").addFilter(_has_no_traceback)
    if sys.platform == "linux" and interface in (INTERFACE, "socketcan"):
        with socket.socket(fileno=os.dup(bus.fileno())) as sock:
            _enlarge_queue(sock)
            if interface == INTERFACE:
                _keep_to_group(sock)
                with suppress(BlockingIOError):
                    while True:  # what came before
                        sock.recv(1, socket.MSG_DONTWAIT)


def _has_no_traceback(record: logging.LogRecord) -> bool:
    return TRACEBACK not in record.getMessage()


def _keep_to_group(sock: socket.socket) -> None:
    with suppress(OSError):  # IPv6 before Linux 4.20
        if sock.family == socket.AF_INET6:
            sock.setsockopt(socket.IPPROTO_IPV6, _IPV6_MULTICAST_ALL, 0)
        else:
            sock.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)


MOST_FAULTS: Final = 100
FAULTY_S: Final = 1.0
"""Number of failed reads in a row, and their minimum duration, after which a bus is given up."""

_TRIES: Final = 16
"""Number of failed reads after which a read returns nothing, so that it does not block."""

GONE: Final = (errno.ENODEV, errno.ENXIO, errno.ENETDOWN)
"""Errors of the kernel for an adapter that was unplugged or switched off."""

_SOCKETCAND_BUFFER: Final = "_SocketCanDaemonBus__receive_buffer"
"""Buffer of python-can's socketcand, which keeps an unreadable frame and earlier frames."""

_log = log_of(__name__)


class BusReceiver:
    """A reader of a bus of python-can, which continues after exceptions of its driver.

    The driver of a serial adapter raises IndexError for a line with a lost byte, and accepts a line
    with too few data bytes as a frame. Other drivers raise errors of their own. All these faults
    are counted. The 1st, the 10th, the 100th fault and so on are reported.

    Args:
        bus: open bus without other readers.
        name: name of the bus for messages.
        ends: error codes. An OSError or CanError with one of these codes ends the reading at once.
        gone: function that makes the exception to raise when reading ends. Its argument is the
        message.
        raises: errors that are re-raised.
        read: function that reads the bus. By default, it is `recv` of the bus.

    Attributes:
        faults: number of failed reads and of truncated frames.
        last: the latest fault, empty after a successful read.
        closed: whether the reader has closed the bus.
        on_fault: function that is called with each report, which is one line. By default, the
            report is logged as a warning.
    """

    def __init__(  # noqa: PLR0913 - how a bus is read, by keyword
        self,
        bus: can.BusABC,
        name: str,
        *,
        ends: Collection[int] = GONE,
        gone: Callable[[str], Exception] = LinkClosed,
        raises: tuple[type[Exception], ...] = (),
        read: Callable[[float | None], can.Message | None] | None = None,
    ) -> None:
        self._bus, self._name, self._ends, self._gone = bus, name, ends, gone
        self._raises, self._read = raises, read or bus.recv
        self.faults, self.last, self.closed = 0, "", False
        self.on_fault: Callable[[str], object] = partial(_log.warning, "%s")
        self._row, self._since_s = 0, 0.0

    def receive(self, timeout_s: float | None) -> can.Message | None:
        """Return the next python-can message.

        The result is None if no message arrives in time. A read fails if the driver raises an error
        or the message is not a valid frame. After a failed read, the method reads again. The result
        is also None if 16 reads of one call fail in a row.

        Args:
            timeout_s: longest wait in seconds, or None to wait without limit.

        Raises:
            LinkClosed: the connection to the bus is lost. The error is also raised if at least 100
                reads in a row have failed, in any number of calls, and the first of these reads
                failed at least 1 s ago.
        """
        begun_s, wait_s = time.monotonic(), timeout_s
        for _ in range(_TRIES):
            try:
                message = self._read(None) if wait_s is None else _receive(self._read, wait_s)
            except Exception as error:  # drivers raise what they like
                self._fail(error)
            else:
                if message is None:
                    self.last = ""
                    return None
                if not (odd := _odd(message)):
                    self._row, self.last = 0, ""
                    return message
                self._fail(ValueError(odd))
            if timeout_s is not None:
                wait_s = max(0.0, begun_s + timeout_s - time.monotonic())
        time.sleep(_AGAIN_S if wait_s is None else min(wait_s, _AGAIN_S))
        return None

    def check(self, error: Exception | None = None) -> None:
        """Raise LinkClosed if the last 100 reads have failed.

        Args:
            error: the latest error.
        """
        if self.last and self._row >= MOST_FAULTS:
            text = f"the last {self._row} reads have failed: {self.last}"
            self.faults -= self._row  # these were no frames
            raise self._gone(f"{self._name}: {text}") from error

    def _fail(self, error: Exception) -> None:
        """Count a failed read. Stop reading after too many failed reads."""
        if isinstance(error, self._raises):
            raise error
        now_s = time.monotonic()
        if not self._row:
            self._since_s = now_s
        self._row, self.faults = self._row + 1, self.faults + 1
        self.last = reason_of(error)
        ends = self.closed or isinstance(error.__cause__, LinkError)
        if ends or error_code(error) in self._ends:
            raise self._gone(f"{self._name}: {self.last}") from error
        if now_s - self._since_s >= FAULTY_S:
            self.check(error)
        if self.faults in _TOLD:
            many = "a read has" if self.faults == 1 else f"{self.faults} reads have"
            self.on_fault(f"{self._name}: {many} failed: {self.last}; what came is lost")
        self._recover(error)

    def _recover(self, error: Exception) -> None:
        """Make a driver drop unreadable data, which it would otherwise read again."""
        # slcan keeps the line that it could not decode in its buffer and fails with it for
        # ever.
        if isinstance(error.__cause__ or error, UnicodeError) and hasattr(self._bus, "flush"):
            with suppress(can.CanError):
                self._bus.flush()  # of slcan
        if hasattr(self._bus, _SOCKETCAND_BUFFER):
            setattr(self._bus, _SOCKETCAND_BUFFER, "")


_TOLD: Final = frozenset(10**power for power in range(10))


def _odd(message: can.Message) -> str:
    """Return why a message is not a valid frame, empty if it is valid."""
    if message.is_error_frame:
        return ""
    if message.arbitration_id >> (29 if message.is_extended_id else 11):
        return f"{message.arbitration_id:X}h is no CAN-ID"
    most, size = 64 if message.is_fd else 8, len(message.data)
    # DLC 9 to 15 stands for 8 bytes in a classic frame.
    whole = message.is_remote_frame or min(message.dlc, most) <= size <= most
    return "" if whole else f"{size} of {message.dlc} bytes came"


def reason_of(error: Exception) -> str:
    """Describe an exception of a CAN driver in one line. Name its type unless it is a bus error."""
    text, kind = first_line(error), type(error).__name__
    return text if isinstance(error, can.CanError | OSError) or text == kind else f"{kind}: {text}"


def error_code(error: Exception) -> int | None:
    """Return the errno of an exception of a CAN driver, or None if it has none."""
    code = getattr(error, "error_code", None) or getattr(error, "errno", None)
    return code if isinstance(code, int) else None


def close_bus(bus: can.BusABC) -> None:
    """Close a bus. Log exceptions of the driver if the bus is gone."""
    try:
        bus.shutdown()
    except Exception as error:  # drivers raise what they like
        _log.info("closing %s: %s", bus.channel_info, reason_of(error))


_SEND_TIMEOUT_US: Final = 1_000_000
_AGAIN_S: Final = 0.001
"""Retry period for a full queue. The queue of SocketCAN has ten places."""
_PASSIVE = ControllerFlag.RECEIVE_PASSIVE | ControllerFlag.TRANSMIT_PASSIVE


class CanLink:
    """`StampedLink` to a CAN bus over python-can, for any of its interfaces.

    Received CAN FD frames are ignored. Error frames only report the state of the controller.

    Args:
        bus: open python-can bus, from which no other code reads.
        name: name of the bus for messages.
        drops: whether to drop a frame at once if the bus does not accept it.

    Attributes:
        lost: number of frames that were dropped because the bus did not accept them.
        reads: reader of the bus, which also counts the frames that the driver could not read.
        on_error_frame: function that is called with each error frame of the driver, or None.
        on_error_state: function that is called with each error state of the controller that the
            driver reports, or None.
    """

    def __init__(self, bus: can.BusABC, name: str, *, drops: bool = False) -> None:
        self._bus, self._name, self._drops, self.lost = bus, name, drops, 0
        self.reads = BusReceiver(
            bus, name, gone=lambda text: LinkClosed(f"cannot read from {text}")
        )
        self.on_error_frame: Callable[[ErrorFrame], object] = lambda frame: None
        self.on_error_state: Callable[[ErrorState], None] | None = None
        self._stamps, self._polled_us = StampClock(), self.now_us

    @classmethod
    def open(cls, channel: str, interface: str, bit_rate: int | None = None) -> CanLink:
        """Open a CAN bus with python-can, and return a link to it.

        Args:
            channel: name of the bus at this interface, such as `can0`.
            interface: python-can's name for the adapter type, such as `socketcan`.
            bit_rate: bit rate in bit/s, or None to leave it unchanged. It is used if the interface
                can set the bit rate.

        Returns:
            A link that owns the bus. Close the link after use.

        Raises:
            LinkClosed: the bus cannot be opened.
        """
        name = f"{interface}:{channel}"
        try:
            given: dict[str, Any] = {} if bit_rate is None else {"bitrate": bit_rate}
            bus = can.Bus(channel=channel, interface=interface, **given)
            prepare_bus(bus, interface)
            return cls(bus, name)
        except (can.CanError, OSError, ValueError, ImportError, AttributeError) as error:
            raise LinkClosed(f"cannot open {name}: {first_line(error)}") from error

    @property
    def now_us(self) -> int:
        """Time of the machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def send(self, traffic: Frames, /) -> None:
        """Send frames to the bus.

        Args:
            traffic: frames in the order of sending.

        Raises:
            LinkClosed: the connection to the bus is lost, or the bus accepted no frame for 1 s.
        """
        for frame in traffic:
            deadline_us = self.now_us + _SEND_TIMEOUT_US
            while not self._sent(frame, deadline_us):
                time.sleep(_AGAIN_S)

    def _sent(self, frame: CanFrame, deadline_us: int) -> bool:
        """Send a frame. Return False if the queue of the driver is full."""
        try:
            self._bus.send(to_message(frame), 0 if self._drops else _SEND_TIMEOUT_US / 1e6)
        except Exception as error:  # drivers raise what they like
            if self._drops and _is_full(error):
                self.lost += 1
            elif _has_no_room(error) and self.now_us < deadline_us:
                return False
            else:
                raise LinkClosed(f"cannot send on {self._name}: {reason_of(error)}") from error
        return True

    def receive(self, timeout_us: int, /) -> Frames:
        """Wait for the next frame, then return all frames that have been received.

        Args:
            timeout_us: longest wait in microseconds. 0 does not wait.

        Returns:
            The frames, or an empty tuple after the timeout.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Wait for the next frame, then return all received frames with their arrival times.

        The returned time is the time just before the last poll of the bus. Use it as the present
        time when you check whether a node is silent. The clock may be far ahead, because the
        operating system may suspend the process after the poll.

        Args:
            timeout_us: longest wait in microseconds. 0 does not wait.

        Returns:
            A time, and the frames that had arrived by then, each with its arrival time.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        deadline_us = self.now_us + timeout_us
        received: list[tuple[int, CanFrame]] = []
        while True:
            now_us = self.now_us
            wait_us = 0 if received else max(0, deadline_us - now_us)
            message = self.reads.receive(wait_us / 1e6)
            if message is not None:
                received += self._take(message)
            elif not wait_us:
                self._polled_us = now_us
                return now_us, tuple(received)

    def close(self) -> None:
        """Close the bus."""
        self.reads.closed = True
        close_bus(self._bus)

    def _take(self, message: can.Message) -> StampedFrames:
        if (error := to_error_frame(message)) is not None:
            self.on_error_frame(error)
            state = _error_state(message)
            if state is not None and self.on_error_state is not None:
                self.on_error_state(state)
        if (frame := to_frame(message)) is None:
            return ()
        return ((self._stamps.at_us(message.timestamp, self._polled_us, self.now_us), frame),)


def _is_full(error: Exception) -> bool:
    """Return whether earlier frames are still unsent.

    Possible reasons are: no other node is on the bus, the cable is unplugged, or the controller is
    bus-off.
    """
    if isinstance(error, can.CanOperationError):
        return error.error_code in (None, errno.ENOBUFS, errno.EAGAIN)
    return isinstance(error, OSError) and error.errno in (errno.ENOBUFS, errno.EAGAIN)


def _has_no_room(error: Exception) -> bool:
    """Return whether the queue of the driver is full."""
    return error_code(error) in (errno.ENOBUFS, errno.EAGAIN)


def _error_state(message: can.Message) -> ErrorState | None:
    """Return the error state in an error frame of SocketCAN, or None if it has none."""
    # Bits 0 to 8: the classes of linux/can/error.h that were there from the beginning.
    error = ErrorClass(message.arbitration_id & 0x1FF)
    if ErrorClass.BUS_OFF in error:
        return ErrorState.BUS_OFF
    if ErrorClass.RESTARTED in error:
        return ErrorState.ACTIVE
    if ErrorClass.CONTROLLER not in error or len(message.data) <= CONTROLLER_BYTE:
        return None
    flags = ControllerFlag(message.data[CONTROLLER_BYTE] & 0x7F)
    # 20000004#0020...: byte 1 of a controller problem, 10h receiver, 20h transmitter
    # passive.
    if flags & _PASSIVE:
        return ErrorState.PASSIVE
    return ErrorState.ACTIVE if ControllerFlag.ACTIVE in flags else None


def bus_reason(error: BaseException) -> str:
    """Return in one line why a CAN bus cannot be opened, with a remedy if one is known."""
    number = getattr(error, "errno", None) or getattr(error, "error_code", None)
    hint = _HINTS.get(number) if isinstance(number, int) else None
    if _NO_MSGPACK in str(error):
        hint = "pip install 'python-can[multicast]'"
    return f"{first_line(error)} ({hint})" if hint else first_line(error)
