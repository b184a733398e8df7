"""Buses of python-can as a source.

The kernel counts the frames that it drops because the queue of a socket is full. The kernel passes
this count with each frame that is read (socket(7), SO_RXQ_OVFL). The kernel passes CAN FD and CAN
XL frames only to sockets that enable them (linux, networking/can). This source enables both types.
It reads CAN FD frames, and only counts CAN XL frames.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, Final

import can
from can.util import load_config

from tickrig.host.canmon.model.frames import EXTENDED, REMOTE, Record
from tickrig.host.canmon.model.logs.can_log import channel_name, to_record
from tickrig.host.canmon.model.logs.log_file import CAN_XL, LogTally
from tickrig.host.canmon.sources.live_source import LiveSource, Reader
from tickrig.host.canmon.sources.source import INTERFACES, BusSpec, parse_source
from tickrig.host.cli.can_options import UNNAMED, BusOptions, open_raw
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.links.can_link import BusReceiver, close_bus, reason_of, to_message
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.ready import ready
from tickrig.wire.can import BRS, ERROR_CLASS_MASK, ERROR_FLAG, ESI, CanFrame, ErrorFrame, FdFrame

# A SocketCAN bus, read from its socket: with the frames that the kernel dropped.


_SO_RXQ_OVFL: Final = 40
SO_TIMESTAMPNS: Final = 35
_SOL_CAN_RAW: Final = 101
_CAN_RAW_FD_FRAMES: Final = 5
_CAN_RAW_XL_FRAMES: Final = 7


_STANDARD_MASK: Final = 0x7FF
_FRAME: Final = struct.Struct("=IB3x8s")  # struct can_frame, linux/can.h
_FD_FRAME: Final = struct.Struct("=IBB2x64s")  # struct canfd_frame
_FD_BYTES: Final = _FD_FRAME.size  # a frame of CAN XL is cut to as many
_FLAGS_AT: Final = 4  # flags of struct canxl_frame, where others have a length below
_XL_FLAG: Final = 0x80
_STAMP: Final = struct.Struct("@ll")
_COUNT: Final = struct.Struct("@I")
_ANCILLARY_BYTES: Final = 128
"""Size of the buffer for time and count with their headers. CMSG_SPACE would give 56 bytes."""

_MSG_CONFIRM: Final = 0x800


class SocketReader:
    """Reader of frames from a SocketCAN bus, directly from the socket that python-can opened.

    Args:
        bus: open bus of python-can. No other code may read from it.
        name: name of the bus in the records.

    Attributes:
        lost: number of frames that the kernel dropped because its queue was full.
        tally: counts of items that were not returned as frames, such as unreadable frames.
        stepped: always False, because a SocketCAN bus runs in real time. The readers of emulated
            buses in virtual time have the value True.
    """

    stepped = False

    def __init__(self, bus: Any, name: str) -> None:
        self._bus, self.name = bus, name
        self._socket: Any = bus.socket  # on Windows a socket has no recvmsg, and no such bus
        self.lost, self.tally = 0, LogTally()
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        _let_fd(bus)
        with suppress(OSError):  # older kernels have no such frames
            self._socket.setsockopt(_SOL_CAN_RAW, _CAN_RAW_XL_FRAMES, 1)
        self._socket.setblocking(False)

    def read(self, timeout_us: int, /) -> list[Record]:
        """Wait for frames, and return them. Raise LinkClosed if the bus is gone."""
        records: list[Record] = []
        ready([self._socket], wait_s=timeout_us / 1e6)
        try:
            while len(records) < _BATCH:
                records += self._records(*self._socket.recvmsg(_FD_BYTES, _ANCILLARY_BYTES))
        except BlockingIOError:
            pass
        except OSError as error:
            if not records:
                raise LinkClosed(f"{self.name}: {error.strerror}") from error
        return records

    def close(self) -> None:
        """Close the bus."""
        close_bus(self._bus)

    def _records(
        self, data: bytes, ancillary: list[tuple[int, int, bytes]], flags: int, address: Any
    ) -> tuple[Record, ...]:
        at_us = 0
        for _, kind, said in ancillary:
            if kind == SO_TIMESTAMPNS:
                seconds, nanos = _STAMP.unpack(said)
                at_us = seconds * 1_000_000 + nanos // 1_000
            elif kind == _SO_RXQ_OVFL:
                self.lost = _COUNT.unpack(said)[0]
        sent = bool(flags & _MSG_CONFIRM)  # by this very socket (linux, networking/can)
        if len(data) == _FRAME.size:
            return (Record(at_us, self.name, _frame(*_FRAME.unpack(data)), sent),)
        if data[_FLAGS_AT] & _XL_FLAG or len(data) != _FD_BYTES:
            self.tally.pass_over(CAN_XL)
            return ()
        return (Record(at_us, self.name, _fd_frame(*_FD_FRAME.unpack(data)), sent),)


def _let_fd(bus: Any) -> None:
    """Make a SocketCAN bus send and receive CAN FD frames, if the kernel supports them."""
    with suppress(OSError):
        bus.socket.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FD_FRAMES, 1)


def _fd_frame(flagged: int, length: int, flags: int, data: bytes) -> FdFrame:
    extended = bool(flagged & EXTENDED)
    can_id = flagged & (ERROR_CLASS_MASK if extended else _STANDARD_MASK)
    return FdFrame(can_id, data[:length], extended, flags & (BRS | ESI)).checked()


def _frame(flagged: int, length: int, data: bytes) -> CanFrame | ErrorFrame:
    if flagged & ERROR_FLAG:
        return ErrorFrame(flagged & ERROR_CLASS_MASK, data)
    extended, remote = bool(flagged & EXTENDED), bool(flagged & REMOTE)
    can_id = flagged & (ERROR_CLASS_MASK if extended else _STANDARD_MASK)
    if remote:
        return CanFrame(can_id, b"", True, extended, min(length, 8))
    return CanFrame(can_id, data[:length], False, extended)


_BATCH: Final = 1_024
"""Largest number of frames of one read, so that a busy bus cannot block its reader."""

_DEFAULT: Final = "socketcan"
"""Default interface if neither the command line nor a configuration names one."""

_UNREADABLE: Final = "frames that the driver could not read"

_STEPPED: Final = ("tickrig",)
"""Interfaces whose time passes while they are read."""


def open_bus(options: BusOptions) -> tuple[can.BusABC, str, str]:
    """Open a CAN bus with python-can.

    The interface comes from the options. If the options name none, it comes from the configuration
    of python-can, and otherwise it has a default.

    Returns:
        The bus, its interface, and the name of its channel.

    Raises:
        Refused: python-can does not know an option.
        SourceFailed: the bus cannot be opened.
    """
    bus, interface, channel = open_raw(_with_interface(options))
    if interface == _DEFAULT:
        _let_fd(bus)
    return bus, interface, channel_name(interface if channel is None else channel)


def _with_interface(options: BusOptions) -> BusOptions:
    if options.interface is None:
        try:
            load_config()
        except can.CanInterfaceNotImplementedError as error:
            if UNNAMED in str(error):
                return replace(options, interface=_DEFAULT)
    return options


class BusReader:
    """Reader of frames from any CAN bus that python-can supports.

    Args:
        bus: open bus of python-can. No other code may read from it.
        interface: name of the python-can interface.
        name: name of the bus in the records.

    Attributes:
        reads: object that reads single frames, and counts frames that the driver could not read.
        lost: number of lost frames, which is always 0 because python-can does not report losses.
        tally: counts of items that were not returned as frames, such as unreadable frames.
        stepped: whether virtual time passes only while the bus is read.
    """

    def __init__(self, bus: can.BusABC, interface: str, name: str) -> None:
        self._bus, self.name, self.stepped = bus, name, interface in _STEPPED
        self.lost, self.tally = 0, LogTally()
        self.reads = BusReceiver(bus, name)

    def read(self, timeout_us: int, /) -> list[Record]:
        """Wait for frames, and return them. Raise LinkClosed if the bus is gone."""
        records: list[Record] = []
        faults, wait_us = self.reads.faults, timeout_us
        try:
            while (message := self.reads.receive(wait_us / 1e6)) is not None:
                one = to_record(message, self.name, self.tally)
                records += (one,) if one else ()
                if len(records) >= _BATCH:
                    break
                wait_us = 0
        except LinkClosed:
            if not records:
                raise
        finally:
            if self.reads.faults != faults:
                self.tally.passed_over[_UNREADABLE] += self.reads.faults - faults
        return records

    def close(self) -> None:
        """Close the bus."""
        self.reads.closed = True
        close_bus(self._bus)


BusSource = LiveSource[Record]
"""A source of one or more buses, in which all items are frames."""


def _reader_of(bus: can.BusABC, interface: str, name: str) -> Reader[Record]:
    """Return a reader for an open bus."""
    return SocketReader(bus, name) if interface == "socketcan" else BusReader(bus, interface, name)


class OpenBus:
    """A CAN bus that was opened from a SOURCE word and options, and can be opened again later.

    Args:
        word: SOURCE word of the bus.
        options: options of the bus on the command line.

    Attributes:
        bus: open bus of python-can. The method `open_again` replaces it by a new one.
        name: name of the bus.

    Raises:
        Refused: python-can does not know an option.
        SourceFailed: the bus cannot be opened.
    """

    def __init__(self, word: BusSpec, options: BusOptions) -> None:
        self._options = merged(word, options)
        self.bus, self._interface, self.name = open_bus(self._options)

    @property
    def reader(self) -> Reader[Record]:
        """Reader of the bus."""
        return _reader_of(self.bus, self._interface, self.name)

    def open_again(self) -> Reader[Record]:
        """Open the bus again. The previous user has closed it."""
        self.bus, _, _ = open_bus(self._options)
        try:
            return self.reader
        except OSError:
            close_bus(self.bus)
            raise


def merged(word: BusSpec, options: BusOptions) -> BusOptions:
    """Combine the SOURCE word of a bus with the options of the command.

    If the word and an option both give a bit rate, the word has priority. The words `udp` and `sim`
    give the interface, even if the option `-i` gives another one.

    If there is an option `-i`, it gives the interface for any other word. Bit rates at the end of
    the word, such as `@500k`, do not belong to the channel. The channel is one of these:

    - If the word begins with the name of this interface and a colon, the channel is the text after
      the colon.
    - Otherwise, the channel is the whole text, even if it contains colons.

    Raises:
        Refused: the word and -c name different channels.
    """
    interface, channel = word.interface, word.channel
    if word.prefix and options.interface not in (None, interface):
        interface, channel = options.interface, f"{word.prefix}:{channel or ''}"
    if channel is not None and options.channel not in (None, channel):
        raise Refused(f"BUS {channel} and -c {options.channel} name two channels; give one")
    return replace(
        options,
        interface=interface or options.interface,
        channel=channel or options.channel,
        bitrate=word.bitrate or options.bitrate,
        bus_kwargs=(*_local(interface if word.interface else None), *options.bus_kwargs),
        fd=options.fd or word.data_bitrate is not None,
        data_bitrate=word.data_bitrate or options.data_bitrate,
    )


def _local(interface: str | None) -> tuple[str, ...]:
    """Return options that keep frames on this machine, unless the command line overrides them."""
    return ("hop_limit=0",) if interface == INTERFACES["udp"] else ()


# A bus that a verb sends on, and hears where it wants to.


_FD_WITHOUT_ASKING: Final = ("socketcan", "tickrig", "udp_multicast", "virtual")
"""Interfaces that accept CAN FD without an option, or that report that they do not support it."""

_SEND_TIMEOUT_S: Final = 1
"""Longest time that a queue of the driver may stay full."""


class Transmitter:
    """An open CAN bus on which a command, such as `canmon send`, sends frames.

    Args:
        word: SOURCE word that names the bus, or None if the options name it.
        options: options of the bus on the command line.
        receives: whether received frames are kept for `poll`. Otherwise, they are discarded.

    Attributes:
        name: name of the bus.

    Raises:
        Refused: the word does not name a bus.
        SourceFailed: the bus cannot be opened.
    """

    def __init__(self, word: str | None, options: BusOptions, *, receives: bool = False) -> None:
        bus_word = BusSpec() if word is None else parse_source(word)
        if not isinstance(bus_word, BusSpec):
            raise Refused(f"{word!r} is no bus; frames are sent on can0 or slcan:/dev/ttyACM0@500k")
        whole = merged(bus_word, options)
        self._bus, interface, self.name = open_bus(whole)
        self._takes_fd = whole.fd or interface in _FD_WITHOUT_ASKING
        self._source: BusSource | None = None
        self._reads: BusReceiver | None = None
        if receives:
            reader = _reader_of(self._bus, interface, self.name)
            self._source = BusSource([reader], [bus_word.chosen])
            self._reads = reader.reads if isinstance(reader, BusReader) else None

    def send(self, frame: CanFrame | FdFrame) -> None:
        """Send a frame.

        Raises:
            SourceFailed: the bus is gone, accepted no frame for 1 s, or does not support CAN FD.
        """
        if isinstance(frame, FdFrame) and not self._takes_fd:
            raise SourceFailed(f"cannot send {frame} on {self.name}: CAN FD wants --fd")
        send_on(self._bus, self.name, frame)

    def poll(self, timeout_us: int) -> list[Record]:
        """Wait at most `timeout_us` for a frame, and return all frames that have arrived.

        Raises:
            SourceFailed: the bus is gone.
        """
        assert self._source is not None, "it was opened to hear"
        records = self._source.poll(timeout_us)
        if not records and self._source.failed:
            raise SourceFailed(self._source.failed)
        return records

    def check_reads(self) -> None:
        """Raise SourceFailed if the last 100 reads of the bus failed."""
        try:
            if self._reads is not None:
                self._reads.check()
        except LinkClosed as error:
            raise SourceFailed(str(error)) from None

    def close(self) -> None:
        """Close the bus."""
        if self._source is None:
            close_bus(self._bus)
        else:
            self._source.close()


def send_on(bus: can.BusABC, name: str, frame: CanFrame | FdFrame) -> None:
    """Send a frame on a bus of python-can.

    Args:
        bus: open bus.
        name: name of the bus for the error message.
        frame: frame to send.

    Raises:
        SourceFailed: the bus is gone, or accepted no frame for 1 s.
    """
    try:
        bus.send(to_message(frame), _SEND_TIMEOUT_S)
    except Exception as error:  # drivers raise what they like
        raise SourceFailed(f"cannot send on {name}: {reason_of(error)}") from error


@contextmanager
def transmitters(
    words: Sequence[str | None], options: BusOptions, *, receives: bool = False
) -> Iterator[list[Transmitter]]:
    """Open buses, and close them after the block."""
    opened: list[Transmitter] = []
    try:
        for word in words:
            opened.append(Transmitter(word, options, receives=receives))
        yield opened
    finally:
        for one in opened:
            one.close()
