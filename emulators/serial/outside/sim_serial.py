"""A pyserial port on a rig: waiting advances the virtual time."""

from __future__ import annotations

import copyreg
import io
import warnings
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NoReturn, cast

from serial.serialutil import (
    LF,
    XOFF,
    XON,
    PortNotOpenError,
    SerialBase,
    SerialException,
    SerialTimeoutException,
)

from tickrig.device.twin import twin
from tickrig.emulators.serial.outside.serial_ports import FORM, SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import (
    NO_ASYNCIO,
    Mismatch,
    ModemLines,
    SerialSide,
)
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import Parity, UartSetting

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


# A pyserial port on a rig: opened and closed, its settings, its modem lines.

_LOG = log_of(__name__)


class _SimPort(SerialBase):
    """Base of `SimSerial` without the transfer of bytes.

    Attributes:
        side: host's side of the line, as soon as it is known.
        mismatch: effect of a different setting, or None to use the `mismatch` of `side`.
    """

    side: SerialSide | None = None
    mismatch: Mismatch | None = None
    is_open = False

    def _begin(self, *positional: Any, **options: Any) -> None:
        """Make a port with settings, which is not open yet."""
        self._input = bytearray()
        super().__init__(None, *positional, **options)

    def __reduce_ex__(self, protocol: object, /) -> tuple[Any, ...]:
        """Copy the port with its rig, as `rig.fork(port)` does."""
        return copyreg.__newobj__, (type(self),), vars(self)  # type: ignore[attr-defined]

    def __deepcopy__(self, memo: dict[int, Any]) -> _SimPort:
        """Return a port on a twin of the rig."""
        return twin(self, memo)

    def open(self) -> None:
        """Open the port, switch DTR and RTS on, and discard earlier input.

        Raises:
            SerialException: the port is already open, or another port is open on the line. It is
                also raised if the bit rate or frame differs from that of the device and `mismatch`
                is `refuse`.
        """
        if self.is_open:
            raise SerialException("Port is already open.")
        if self.port is None or self.side is None:
            raise SerialException("Port must be configured before it can be used.")
        side = self.side
        side.waits.check_thread(self.port)
        if side.in_use:
            raise SerialException(f"could not open port {self.port}: another host has it open")
        self.is_open = True
        try:
            self._reconfigure_port()
        except (ValueError, SerialException):
            self.is_open = False
            raise
        side.in_use, lines = True, side.modem_lines
        lines.dtr, lines.rts = bool(self.dsrdtr or self.dtr), bool(self.rtscts or self.rts)
        self.reset_input_buffer()

    def close(self) -> None:
        """Close the port. DTR and RTS go off, a break ends, and bytes already sent still arrive."""
        if not self.is_open or self.side is None:
            return
        self.is_open = self.side.in_use = False
        self.side.modem_lines.dtr = self.side.modem_lines.rts = False
        self.side.transmitter.held.clear()
        self.side.transmitter.suspended = False
        if self.break_condition:
            self.side.transmitter.set_break(self.side.rig.now_us, on=False)

    def reset_input_buffer(self) -> None:
        """Discard received data that were not read."""
        side = self._side()
        side.receiver.poll(side.rig.now_us)
        self._input.clear()

    def _side(self) -> SerialSide:
        """Return the line; raise SerialException if it cannot be used."""
        if not self.is_open or self.side is None:
            raise PortNotOpenError
        self.side.waits.check_thread(str(self.port))
        return self.side

    def _reconfigure_port(self) -> None:
        """Apply the settings from pyserial's properties."""
        side = self._side()
        if self.baudrate == 0:
            raise ValueError("Invalid baud rate: 0")
        parity = cast(Parity, self.parity)  # pyserial has checked it
        setting = UartSetting(self.baudrate, self.bytesize, parity, self.stopbits)
        if setting != side.setting or not side.in_use:
            self._input += side.receiver.poll(side.rig.now_us)
            self._use(side, setting)
        side.transmitter.waits_for_cts = bool(self.rtscts)
        side.transmitter.release(side.rig.now_us)

    def _use(self, side: SerialSide, setting: UartSetting) -> None:
        """Send and receive at a setting; raise SerialException if it is refused."""
        if side.device is not None:
            if setting != side.device:
                what = f"{self.port} is set to {setting}, the device has {side.device}"
                if (self.mismatch or side.mismatch) == "refuse":
                    raise SerialException(what)
                _LOG.warning("%s: each samples what the other sends, perhaps wrongly", what)
            side.transmitter.setting = setting
            side.receiver.use(setting, side.rig.now_us)
        side.setting = setting

    def _update_dtr_state(self) -> None:
        self._side().modem_lines.dtr = bool(self.dtr)

    def _update_rts_state(self) -> None:
        self._side().modem_lines.rts = bool(self.rts)

    @property
    def cts(self) -> bool:
        """Clear To Send."""
        return self._modem_lines().cts

    @property
    def dsr(self) -> bool:
        """Data Set Ready."""
        return self._modem_lines().dsr

    @property
    def ri(self) -> bool:
        """Ring Indicator."""
        return self._modem_lines().ri

    @property
    def cd(self) -> bool:
        """Carrier Detect."""
        return self._modem_lines().cd

    def _modem_lines(self) -> ModemLines:
        side = self._side()
        side.waits.look()
        return side.modem_lines

    def set_output_flow_control(self, enable: bool = True) -> None:
        """Suspend or resume sending. Bytes that are written in the meantime are sent later.

        Args:
            enable: true to send, false to suspend.
        """
        side = self._side()
        side.transmitter.suspended = not enable
        side.transmitter.release(side.rig.now_us)

    def set_input_flow_control(self, enable: bool = True) -> None:
        """Send XON or XOFF to the device, so that it resumes or pauses sending.

        Args:
            enable: true to send XON, false to send XOFF.
        """
        side = self._side()
        side.transmitter.send(side.rig.now_us, XON if enable else XOFF)

    def nonblocking(self) -> None:
        """Warn without any effect, as pyserial ports do."""
        warnings.warn("nonblocking() has no effect", DeprecationWarning, stacklevel=2)

    def set_low_latency_mode(self, low_latency_settings: bool) -> None:
        """Do nothing, because a byte is available as soon as its stop bit has passed.

        Args:
            low_latency_settings: mode, as in pyserial.
        """
        self._side()

    def fileno(self) -> NoReturn:
        """Raise an exception, because `select` has nothing to wait for."""
        raise io.UnsupportedOperation(f"{self.port}: {NO_ASYNCIO}")


_INPUT_BYTES: Final = 4_096
"""Size of the input buffer for a host that does not read. More bytes wait in the line, and are then
lost."""

_ROOM_BYTES: Final = 256
"""Largest room in the buffer for which a write waits at once."""


class SimSerial(_SimPort):
    """A `serial.Serial` whose device is on a rig.

    Calls, settings and exceptions are pyserial's. Calls that wait advance the rig's time:

    - `read` until a byte and its stop bit have arrived, or by exactly its timeout;
    - `write` until the line's buffer has accepted all bytes;
    - `flush`, a break and `send_break`.

    Other calls take no time. If operating systems differ, the port behaves as on Linux, where
    pyserial ignores `inter_byte_timeout`. With `rtscts` no bytes are sent before CTS is on; data
    that were accepted while CTS was on are still sent.

    Not emulated: XON and XOFF, DSR and DTR as flow control, RS485 modes (the emulated line turns
    round automatically). These settings can be set, without effect.

    Args:
        side: the host's side of the line.
        options: options of `serial.Serial`: `timeout`, `baudrate`, ... The defaults of baud rate
            and frame are those of the device.

    Attributes:
        side: host's side of the line.
        mismatch: effect of a different setting, or None to use the `mismatch` of `side`.

    Raises:
        SerialException: another port is open on the line, or the setting is refused.
        ValueError: no UART has the setting.
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
        """Open the port. If `port` is a `tickrig://` URL, the URL names the line.

        Otherwise the port opens on the line with which this object was made.

        Raises:
            SerialException: no rig offers the name in the URL, the port is already open, or another
                port is open on the line. It is also raised if the bit rate or frame differs from
                that of the device and `mismatch` is `refuse`.
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
        """Number of received bytes that were not read."""
        side = self._side()
        self._receive(side)
        if not self._input:
            side.waits.look()
        return len(self._input)

    def read(self, size: int = 1) -> bytes:
        """Read bytes. The virtual time advances until they have arrived or the timeout has expired.

        Args:
            size: largest number of bytes.

        Returns:
            The bytes, which are fewer than `size` after the timeout or `cancel_read`.

        Raises:
            SerialException: the port is closed, or there is no timeout and no byte arrived for an
                hour.
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
        """Read a line up to its line feed; the timeout applies to each byte, as in pyserial.

        Args:
            size: largest number of bytes, or -1 for any number.
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
        """Read bytes until a sequence has arrived or the timeout has expired.

        Args:
            expected: sequence of bytes that ends the read. A `str` never matches, as with pyserial.
            size: largest number of bytes, or None for any number.
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
        """Make the waiting or the next `read` return; any thread may call it."""
        self._read_cancelled = self.is_open

    def _reading_ended(self) -> bool:
        return self._read_cancelled or not self.is_open

    def _gather(self, side: SerialSide, expected: bytes, until_us: int) -> None:
        """Receive all bytes up to a sequence at once, if they are in transit and in time."""
        coming = side.receiver.coming
        if count := (self._input + coming).find(expected) + 1:
            count += len(expected) - 1 - len(self._input)
            if count > 0 and (at_us := side.receiver.arrival_us(count)) <= until_us:
                side.waits.wait(at_us, lambda: at_us, self._reading_ended)
                self._receive(side)

    def _receive(self, side: SerialSide) -> None:
        """Move received data to the input buffer, unless it is full."""
        now_us = side.rig.now_us
        if side.receiver.due_us <= now_us and len(self._input) < _INPUT_BYTES:
            self._input += side.receiver.poll(now_us)

    def _take(self, size: int) -> bytes:
        """Remove bytes from the input buffer."""
        taken = bytes(self._input[:size])
        del self._input[:size]
        return taken

    # Writing

    @property
    def out_waiting(self) -> int:
        """Number of written bytes that have not been sent."""
        side = self._side()
        if waiting := side.transmitter.unsent(side.rig.now_us):
            side.waits.look()
        return waiting

    def write(self, data: ReadableBuffer) -> int:
        """Write bytes. The virtual time advances until the buffer of the line has accepted them.

        Args:
            data: bytes to send.

        Returns:
            The number of accepted bytes. All bytes are accepted, except with a `write_timeout` of 0
            or after `cancel_write`.

        Raises:
            SerialTimeoutException: the timeout has expired. Some bytes may have been accepted.
            SerialException: the port is closed, or the buffer was full for an hour.
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
        """Make the waiting or the next `write` return; any thread may call it."""
        self._write_cancelled = self.is_open

    def flush(self) -> None:
        """Wait until all written bytes have been sent, to the last stop bit."""
        side = self._side()
        until_us = side.waits.deadline_us(None)
        while side.transmitter.unsent(side.rig.now_us):
            if side.rig.now_us >= until_us:
                side.waits.give_up(None)
            side.waits.wait(until_us, lambda: side.transmitter.sent_us)

    def reset_output_buffer(self) -> None:
        """Discard written bytes of which no bit has been sent."""
        side = self._side()
        side.transmitter.drop_unsent(side.rig.now_us)

    def _room_us(self, side: SerialSide, wanted: int) -> int:
        """Return the time at which there will be more room, or `NEVER` before CTS is on."""
        now_us, transmitter = side.rig.now_us, side.transmitter
        sent_us, unsent = transmitter.sent_us, transmitter.unsent(now_us)
        if not unsent or sent_us == NEVER:
            return NEVER if unsent else max(now_us + 1, side.rig.next_us)
        return now_us + 1 + (sent_us - now_us) * min(wanted, _ROOM_BYTES, unsent) // unsent

    def _writing_ended(self) -> bool:
        return self._write_cancelled or not self.is_open

    # Breaks

    def send_break(self, duration: float = 0.25) -> None:
        """Send a break: hold the line at 0 for a duration of virtual time.

        Args:
            duration: duration of the break in seconds.
        """
        side = self._side()
        self.break_condition = True
        until_us = side.rig.now_us + round(duration * 1e6)
        side.waits.wait(until_us, lambda: until_us)
        self.break_condition = False

    def _update_break_state(self) -> None:
        """Hold the line at 0 after the written bytes, or release it."""
        side, on = self._side(), bool(self.break_condition)
        if on:
            self.flush()
        if side.device is not None:
            side.transmitter.set_break(side.rig.now_us, on=on)
