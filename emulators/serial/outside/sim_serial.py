"""A pyserial port on a rig: waiting makes its virtual time pass."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from serial.serialutil import LF, SerialException, SerialTimeoutException

from tickrig.emulators.serial.outside.serial_ports import FORM, SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.outside.sim_port import SimPort
from tickrig.wire.instant import NEVER
from tickrig.wire.serial.uart import UartSetting

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

INPUT_BYTES: Final = 4_096
"""So many bytes wait here for a host that does not read; more wait in the line, then are lost."""

ROOM_BYTES: Final = 256
"""For so much room, at most, a write waits at once."""


class SimSerial(SimPort):
    """A `serial.Serial` whose device is on a rig.

    Calls, settings and exceptions are pyserial's. What waits makes the rig's time pass: `read`
    until a byte is there, its stop bit too, and exactly its timeout if none comes; `write` until
    the line's buffer takes all; `flush`, a break and `send_break`. Nothing else does.

    Where the systems differ it is as Linux, where pyserial ignores `inter_byte_timeout`. Not
    emulated: XON and XOFF, DSR and DTR as flow control, RS485 modes (the emulated line turns round
    by itself); they can be set and change nothing. With `rtscts` nothing is sent before CTS is on;
    what was sent while it was on goes.

    Args:
        side: the host's side of the line.
        options: as `serial.Serial` takes them: `timeout`, `baudrate`, ... What is not given of
            baud rate and frame is the device's.

    Attributes:
        side: the same.
        mismatch: what a setting is that is not the device's; None as `side` has it.

    Raises:
        SerialException: another port is open there, or the setting is refused.
        ValueError: a setting that no UART has.
    """

    _own: tuple[str | None, SerialSide | None] = None, None  # the line that it was made with

    def __init__(self, side: SerialSide, /, **options: Any) -> None:
        device = side.device or UartSetting()
        own = {
            "baudrate": device.baud,
            "bytesize": device.data_bits,
            "parity": device.parity,
            "stopbits": device.stop_bits,
        }
        name = options.pop("port", None) or "rig"
        self._begin(**{**own, **options})
        self._own = name, side
        self.port = name
        self.open()

    def open(self) -> None:
        """Open the port: the line that it was made with, or that of a `tickrig://` URL.

        Raises:
            SerialException: no rig offers the name; see `SimPort.open`.
        """
        own_name, own_side = self._own
        if not self.is_open and self.port is not None:
            if self.port == own_name:
                self.side, self.mismatch = own_side, None
            elif own_name is None or "://" in self.port:
                self.side, self.mismatch = SERIAL_PORTS.find(self.port)
            else:
                what = f"could not open port {self.port}: this port is on a rig, as {own_name}"
                raise SerialException(f"{what}; others are {FORM}")
            self._read_cancelled = self._write_cancelled = False
        super().open()

    def _begin(self, *positional: Any, **options: Any) -> None:
        self._read_cancelled = self._write_cancelled = False
        super()._begin(*positional, **options)

    # Reading

    @property
    def in_waiting(self) -> int:
        """Bytes that have come and were not read."""
        side = self._side()
        self._receive(side)
        if not self._input:
            side.waits.look()
        return len(self._input)

    def read(self, size: int = 1) -> bytes:
        """Read bytes; time passes until they are there, or the timeout is over.

        Args:
            size: how many at most.

        Returns:
            As many, or fewer after the timeout or `cancel_read`.

        Raises:
            SerialException: the port is closed; nothing came for an hour, and there is no timeout.
        """
        side = self._side()
        if 0 < size <= len(self._input) and not self._read_cancelled:
            return self._take(size)
        until_us = side.waits.deadline_us(self.timeout)
        data = self._read_by(side, size, until_us)
        if len(data) < size and side.rig.now_us >= until_us:
            side.waits.give_up(self.timeout)
        if not data and self.timeout == 0:
            side.waits.look()
        return data

    def _read_by(self, side: SerialSide, size: int, until_us: int) -> bytes:
        """Read up to `size` bytes, and wait for them until a time."""
        data = bytearray()
        waits = not self._read_cancelled
        while waits:
            self._receive(side)
            data += self._take(max(0, size - len(data)))
            if len(data) >= size or side.rig.now_us >= until_us:
                return bytes(data)
            if waits := not self._reading_ended():
                there_us = partial(side.receiver.arrival_us, size - len(data))
                side.waits.wait(until_us, there_us, self._reading_ended)
        self._read_cancelled = False
        return bytes(data)

    def readline(self, size: int | None = -1, /) -> bytes:
        """Read until a line ends; the timeout is that of each byte.

        Args:
            size: how many bytes at most; -1 for any number.
        """
        if size is not None and size >= 0:
            return super().readline(size)
        if not (byte := self.read(1)):
            return b""
        side = self._side()
        self._input[:0] = byte
        self._gather(side, LF, side.waits.deadline_us(self.timeout))
        if end := self._input.find(LF) + 1:
            return self._take(end)
        if self._reading_ended():
            self._read_cancelled = False
            return self._take(len(self._input))
        return super().readline()

    def read_until(self, expected: bytes | str = LF, size: int | None = None) -> bytes:
        """Read until a sequence has come, or the timeout is over.

        Args:
            expected: the sequence; text never comes, as with pyserial.
            size: how many bytes at most.
        """
        side = self._side()
        until_us, data = side.waits.deadline_us(self.timeout), bytearray()
        end = None if isinstance(expected, str) else expected
        while byte := self.read(1):
            data += byte
            full = size is not None and len(data) >= size
            ended = end is not None and data[-len(end) :] == end
            if ended or full or side.rig.now_us >= until_us:
                break
            if size is None and not self._input and end is not None:
                self._gather(side, end, until_us)
                if self._reading_ended() and end not in data + self._input:
                    self._read_cancelled = False
                    data += self._take(len(self._input))
                    break
        return bytes(data)

    def cancel_read(self) -> None:
        """Let a `read` return that waits at present, or the next one; any thread may call it."""
        self._read_cancelled = self.is_open

    def _reading_ended(self) -> bool:
        return self._read_cancelled or not self.is_open

    def _gather(self, side: SerialSide, expected: bytes, until_us: int) -> None:
        """Let all bytes come up to a sequence at once, if they are on their way and in time."""
        coming = side.receiver.coming
        if count := (self._input + coming).find(expected) + 1:
            count += len(expected) - 1 - len(self._input)
            if count > 0 and (at_us := side.receiver.arrival_us(count)) <= until_us:
                side.waits.wait(at_us, lambda: at_us, self._reading_ended)
                self._receive(side)

    def _receive(self, side: SerialSide) -> None:
        """Take what has come into the input buffer, unless that is full."""
        now_us = side.rig.now_us
        if side.receiver.due_us <= now_us and len(self._input) < INPUT_BYTES:
            self._input += side.receiver.poll(now_us)

    def _take(self, size: int) -> bytes:
        """Take bytes out of the input buffer."""
        taken = bytes(self._input[:size])
        del self._input[:size]
        return taken

    # Writing

    @property
    def out_waiting(self) -> int:
        """Bytes that were written and have not left."""
        side = self._side()
        if waiting := side.transmitter.unsent(side.rig.now_us):
            side.waits.look()
        return waiting

    def write(self, data: ReadableBuffer) -> int:
        """Write bytes; time passes until the buffer of the line has taken them.

        Args:
            data: the bytes.

        Returns:
            How many were taken: all, but with a `write_timeout` of 0 or after `cancel_write`.

        Raises:
            SerialTimeoutException: the timeout is over; some may have been taken.
            SerialException: the port is closed; there was no room for an hour.
            TypeError: the data is text.
        """
        side = self._side()
        if isinstance(data, str):
            raise TypeError(f"unicode strings are not supported, please encode to bytes: {data!r}")
        left = bytes(data)
        length, until_us = len(left), side.waits.deadline_us(self.write_timeout)
        while left := left[side.transmitter.send(side.rig.now_us, left) :]:
            if self.write_timeout == 0 or self._writing_ended():
                break
            if side.rig.now_us >= until_us:
                side.waits.give_up(self.write_timeout)
                raise SerialTimeoutException("Write timeout")
            side.waits.wait(until_us, partial(self._room_us, side, len(left)), self._writing_ended)
        self._write_cancelled = False
        return length - len(left)

    def cancel_write(self) -> None:
        """Let a `write` return that waits at present, or the next; any thread may call it."""
        self._write_cancelled = self.is_open

    def flush(self) -> None:
        """Wait until all that was written has left, to its last stop bit."""
        side = self._side()
        until_us = side.waits.deadline_us(None)
        while side.transmitter.unsent(side.rig.now_us):
            if side.rig.now_us >= until_us:
                side.waits.give_up(None)
            side.waits.wait(until_us, lambda: side.transmitter.sent_us)

    def reset_output_buffer(self) -> None:
        """Forget what was written and of which no bit has left."""
        side = self._side()
        side.transmitter.drop_unsent(side.rig.now_us)

    def _room_us(self, side: SerialSide, wanted: int) -> int:
        """Return when there will be room for more, `NEVER` before CTS is on."""
        now_us, transmitter = side.rig.now_us, side.transmitter
        sent_us, unsent = transmitter.sent_us, transmitter.unsent(now_us)
        if not unsent or sent_us == NEVER:
            return NEVER if unsent else max(now_us + 1, side.rig.next_us)
        return now_us + 1 + (sent_us - now_us) * min(wanted, ROOM_BYTES, unsent) // unsent

    def _writing_ended(self) -> bool:
        return self._write_cancelled or not self.is_open

    # Breaks

    def send_break(self, duration: float = 0.25) -> None:
        """Hold the line at 0 for a time, which passes.

        Args:
            duration: how long, in seconds.
        """
        side = self._side()
        self.break_condition = True
        side.rig.run_for(round(duration * 1e6))
        self.break_condition = False

    def _update_break_state(self) -> None:
        """Hold the line at 0 behind what was written, or let it go."""
        side, on = self._side(), bool(self.break_condition)
        if on:
            self.flush()
        if side.device is not None:
            side.transmitter.set_break(side.rig.now_us, on=on)
