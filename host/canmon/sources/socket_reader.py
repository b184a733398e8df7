"""A SocketCAN bus, read from its socket: with the frames that the kernel dropped.

The kernel counts frames for which a socket's queue had no room, and tells the
count with each frame that is read (socket(7), SO_RXQ_OVFL). Frames of CAN FD and
CAN XL it shows to sockets alone that want them (linux, networking/can). Here all is
asked for; CAN FD is read, and CAN XL is counted.
"""

from __future__ import annotations

import socket
import struct
from contextlib import suppress
from typing import Any, Final

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.mark import CAN_XL, LogTally
from tickrig.host.links.can_link import close_bus
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.ready import ready
from tickrig.wire.can import BRS, ERROR_CLASS_MASK, ERROR_FLAG, ESI, CanFrame, ErrorFrame, FdFrame

_SO_RXQ_OVFL: Final = 40
SO_TIMESTAMPNS: Final = 35
_SOL_CAN_RAW: Final = 101
_CAN_RAW_FD_FRAMES: Final = 5
_CAN_RAW_XL_FRAMES: Final = 7

_BATCH: Final = 1_024

_EXTENDED: Final = 0x8000_0000
_REMOTE: Final = 0x4000_0000
_STANDARD_MASK: Final = 0x7FF
_FRAME: Final = struct.Struct("=IB3x8s")  # struct can_frame, linux/can.h
_FD_FRAME: Final = struct.Struct("=IBB2x64s")  # struct canfd_frame
_FD_BYTES: Final = _FD_FRAME.size  # a frame of CAN XL is cut to as many
_FLAGS_AT: Final = 4  # flags of struct canxl_frame, where others have a length below
_XL_FLAG: Final = 0x80
_STAMP: Final = struct.Struct("@ll")
_COUNT: Final = struct.Struct("@I")
_ANCILLARY_BYTES: Final = 128
"""Room for time and count with their heads; CMSG_SPACE would say 56, where there is one."""

_MSG_CONFIRM: Final = 0x800


class SocketReader:
    """The socket of an open SocketCAN bus of python-can.

    Args:
        bus: the bus; nobody else reads from it.
        name: what it is called in what is heard.

    Attributes:
        lost: frames that the kernel dropped because its queue was full.
        tally: what was no frame.
        stepped: never.
    """

    stepped = False

    def __init__(self, bus: Any, name: str) -> None:
        self._bus, self.name = bus, name
        self._socket: Any = bus.socket  # on Windows a socket has no recvmsg, and no such bus
        self.lost, self.tally = 0, LogTally()
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        let_fd(bus)
        with suppress(OSError):  # older kernels have no such frames
            self._socket.setsockopt(_SOL_CAN_RAW, _CAN_RAW_XL_FRAMES, 1)
        self._socket.setblocking(False)

    def read(self, timeout_us: int, /) -> list[Record]:
        """Wait for a first frame; LinkClosed if the bus is gone."""
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
            self.tally.passed_over[CAN_XL] += 1
            return ()
        return (Record(at_us, self.name, _fd_frame(*_FD_FRAME.unpack(data)), sent),)


def let_fd(bus: Any) -> None:
    """Have a bus of SocketCAN send and hear CAN FD frames, where the kernel has them."""
    with suppress(OSError):
        bus.socket.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FD_FRAMES, 1)


def _fd_frame(flagged: int, length: int, flags: int, data: bytes) -> FdFrame:
    extended = bool(flagged & _EXTENDED)
    can_id = flagged & (ERROR_CLASS_MASK if extended else _STANDARD_MASK)
    return FdFrame(can_id, data[:length], extended, flags & (BRS | ESI)).checked()


def _frame(flagged: int, length: int, data: bytes) -> CanFrame | ErrorFrame:
    if flagged & ERROR_FLAG:
        return ErrorFrame(flagged & ERROR_CLASS_MASK, data)
    extended, remote = bool(flagged & _EXTENDED), bool(flagged & _REMOTE)
    can_id = flagged & (ERROR_CLASS_MASK if extended else _STANDARD_MASK)
    if remote:
        return CanFrame(can_id, b"", True, extended, min(length, 8))
    return CanFrame(can_id, data[:length], False, extended)
