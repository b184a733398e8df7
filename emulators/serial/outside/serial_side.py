"""The host's side of a serial line on a rig, on which a port can be opened."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from serial.serialutil import SerialException

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.port import ByteEnd
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import Looks, OneThread
from tickrig.host.text.log import log_of
from tickrig.host.text.trace import Mark
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import PS_PER_US, Character, UartReceiver, UartSetting


def _ignore(now_us: int) -> None:
    """Do nothing."""


# Characters that a UART received with an error.


@dataclass(slots=True)
class UartErrors:
    """Counters of received characters with errors, as Linux counts them (`TIOCGICOUNT`).

    A character with several errors is counted once.

    Attributes:
        framing: number of characters with a 0 in place of a stop bit.
        parity: number of characters with a wrong parity bit.
        breaks: number of breaks, in which the line was 0 for a whole character.
    """

    framing: int = 0
    parity: int = 0
    breaks: int = 0

    def count(self, character: Character) -> None:
        """Count a character if it has an error.

        Args:
            character: received character.
        """
        if character.line_break:
            self.breaks += 1
        elif character.parity_error:
            self.parity += 1
        elif character.framing_error:
            self.framing += 1


# Modem lines between a host's port and a device.


class ModemLines(Copyable):
    """Modem lines of a host: DTR and RTS, which it sets, and CTS, DSR, RI and CD, which it reads.

    No device of tickrig has such lines. The host reads the same values as from a USB adapter with
    open pins. The values are off, because the inputs of FT232R, CP2102 and CH340 are pulled up. If
    your device has such lines, set the values for the host.

    Attributes:
        dtr: Data Terminal Ready, set by the host. It is off while the port is closed.
        rts: Request To Send, set by the host. It is off while the port is closed.
        dsr: Data Set Ready, read by the host.
        ri: Ring Indicator, read by the host.
        cd: Carrier Detect, read by the host.
        cts_changed: function that is called when `cts` was set, because bytes may wait for it.
    """

    def __init__(self) -> None:
        self.dtr = self.rts = False
        self.dsr = self.ri = self.cd = self._cts = False
        self.cts_changed: Callable[[], None] | None = None

    @property
    def cts(self) -> bool:
        """State of the signal CTS (Clear To Send), which a port with `rtscts` needs for sending."""
        return self._cts

    @cts.setter
    def cts(self, value: bool) -> None:
        self._cts = value
        if self.cts_changed is not None:
            self.cts_changed()


# The receiver of a host, also for a device with another setting.


class HostReceiver(Copyable):
    """Receiving UART of a host, which samples the bytes of an emulated line with its own setting.

    If the settings of host and device differ, the host receives characters that differ from the
    bytes of the device. A received character may end while the device is still sending a byte. The
    host can read such a character when this byte has ended. A character with an error is delivered
    like any other character and counted, as Linux and Windows do for pyserial.

    Args:
        end: the host's end of the line.
        device: setting of the device.
        garbled: function that is called, with the time, when bytes arrive while the settings of
            host and device differ.

    Attributes:
        errors: counters of characters with errors.
    """

    def __init__(
        self, end: ByteEnd, device: UartSetting, garbled: Callable[[int], None] = _ignore
    ) -> None:
        self._end, self._device, self._setting, self._garbled = end, device, device, garbled
        self.errors = UartErrors()
        self._uart: UartReceiver | None = None  # none has the device's setting
        self._sent_ps = 0  # when the latest byte of the device ended
        self._received: deque[Character] = deque()

    def follow(self, device: UartSetting, now_us: int) -> None:
        """Note the new setting with which the device sends; the host keeps its own setting.

        Args:
            device: new setting of the device.
            now_us: present time in microseconds.
        """
        if self._uart is None:
            now_ps = now_us * PS_PER_US
            self._received += [Character(value, now_ps) for value in self._end.poll(now_us)]
            self._uart = UartReceiver(self._setting, now_ps)
        else:
            self._sample(self._uart, now_us)
        self._device = device

    def use(self, setting: UartSetting, now_us: int) -> None:
        """Change the host's setting for receiving; a partly received character is lost.

        Args:
            setting: new setting of the host.
            now_us: present time in microseconds. All characters that arrived earlier have been
                read.
        """
        same, self._setting = setting == self._device, setting
        self._uart = None if same else UartReceiver(setting, now_us * PS_PER_US)
        self._received.clear()

    @property
    def due_us(self) -> int:
        """Time of the next character or the next check."""
        due_us = self._end.due_us
        if self._uart is None:
            return due_us
        if self._received:
            return min(due_us, -(-self._received[0].end_ps // PS_PER_US))
        if due_us == NEVER and self._uart.due_ps < NEVER:
            return self._uart.due_ps // PS_PER_US + 1
        return due_us

    @property
    def coming(self) -> bytes:
        """The bytes in transit that are known to arrive."""
        return self._end.coming if self._uart is None else b""

    def arrival_us(self, count: int) -> int:
        """Return the time at which the host can read `count` characters.

        If this time is not known yet, the result is the time at which to call this method again.

        Args:
            count: number of characters, at least 1.
        """
        return self._end.arrival_us(count) if self._uart is None else self.due_us

    def poll(self, now_us: int) -> bytes:
        """Return the received characters.

        Args:
            now_us: present time in microseconds.
        """
        if self._uart is None:
            return self._end.poll(now_us)
        self._sample(self._uart, now_us)
        now_ps, taken = now_us * PS_PER_US, bytearray()
        while self._received and self._received[0].end_ps <= now_ps:
            character = self._received.popleft()
            self.errors.count(character)
            taken.append(character.value)
        return bytes(taken)

    def _sample(self, uart: UartReceiver, now_us: int) -> None:
        """Sample the line up to now."""
        while (at_us := self._end.due_us) <= now_us:
            if self._setting != self._device:
                self._garbled(at_us)
            self._listen(uart, at_us * PS_PER_US, self._end.poll(at_us))
        if at_us == NEVER:  # else a byte is in transit that started before now
            self._received += uart.push(1, now_us * PS_PER_US)

    def _listen(self, uart: UartReceiver, end_ps: int, data: bytes) -> None:
        """Sample bytes that the device has sent back to back until `end_ps`, to the microsecond."""
        start_ps = end_ps - self._device.duration_ps(len(data))
        if abs(start_ps - self._sent_ps) <= PS_PER_US:
            start_ps = self._sent_ps
        self._received += uart.push(1, start_ps)
        for value in data:
            for level, until_ps in self._device.levels(value, start_ps):
                self._received += uart.push(level, until_ps)
            start_ps += self._device.duration_ps()
        self._sent_ps = start_ps


# The transmitter of a host, also for a device with another setting.

_HELD_BYTES: Final = 4_096
"""Largest number of bytes that wait for CTS."""


class HostTransmitter(Copyable):
    """Sends bytes of a host to a device, which samples them at its own setting.

    Bytes with the device's setting are sent unchanged. All other bytes, and breaks, are sampled.
    The device receives each sampled character at the expected end of its stop bit. The character
    has the sampled value, wrong or not, as most UARTs deliver it. A break is a byte of 0. Errors
    are counted, but not reported to the device.

    Args:
        event_queue: event queue of the rig. Characters arrive between the rig's ticks.
        end: the host's end of the line.
        device: setting of the device.
        lines: modem lines with the CTS that the transmitter may have to wait for.
        garbled: function that is called with the time when bytes are sent that the device samples
            differently.

    Attributes:
        setting: setting of the host for bytes that are sent from now on.
        waits_for_cts: whether sending waits while CTS is off.
        suspended: whether sending waits until the host resumes its output.
        held: bytes that wait for CTS or for the host.
        errors: number of characters that the device received with an error.
    """

    def __init__(
        self,
        event_queue: EventQueue,
        end: ByteEnd,
        device: UartSetting,
        lines: ModemLines,
        garbled: Callable[[int], None] = _ignore,
    ) -> None:
        self._event_queue, self._end, self._device, self._lines = event_queue, end, device, lines
        self._garbled = garbled
        self.setting, self.errors = device, UartErrors()
        self.waits_for_cts = self.suspended = False
        self.held = bytearray()
        self._break_us = NEVER  # since when there is a break
        self._waiting: deque[tuple[int, int, UartSetting]] = deque()  # characters, by their start
        self._begun_ps = self._free_ps = 0  # end of the last one started; end of all
        self._uart = UartReceiver(device)
        self._received: deque[Character] = deque()

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` accepts at `now_us` without loss."""
        if self._holds:
            return _HELD_BYTES - len(self.held)
        return max(0, self._end.room(now_us) - len(self._waiting))

    @property
    def sent_us(self) -> int:
        """Time at which the host's last byte will have been sent.

        It is `NEVER` while bytes are held back by flow control.
        """
        if self.held:
            return NEVER
        sampled_us, line_us = -(-self._free_ps // PS_PER_US), self._end.sent_us
        return max(sampled_us, line_us) if line_us < NEVER else sampled_us

    def unsent(self, now_us: int) -> int:
        """Return how many bytes have not been sent completely yet."""
        begun = self._begun_ps > now_us * PS_PER_US
        return self._end.unsent(now_us) + len(self._waiting) + begun + len(self.held)

    def drop_unsent(self, now_us: int) -> None:
        """Discard the bytes of which no bit has been sent yet."""
        self._end.drop_unsent(now_us)
        self._waiting.clear()
        self.held.clear()
        self._free_ps = self._begun_ps

    def send(self, now_us: int, data: bytes) -> int:
        """Send bytes of the host, after the bytes that are still being sent.

        Args:
            now_us: present time in microseconds.
            data: bytes to send.

        Returns:
            The number of accepted bytes, which is smaller if the buffer is full.
        """
        data = data[: self.room(now_us)]
        if self._holds:
            self.held += data
        elif self._understood:
            self._end.send(now_us, data)
        else:
            self._send_sampled(now_us, data)
        return len(data)

    def follow(self, device: UartSetting, now_us: int) -> None:
        """Change the setting with which the device receives the host's bytes.

        The device loses a partly received character. Bytes on the way are sampled with the new
        setting.

        Args:
            device: new setting of the device.
            now_us: present time in microseconds.
        """
        self._advance(now_us)
        sent = [(start_ps, value, self.setting) for start_ps, value in self._end.withdraw(now_us)]
        self._waiting.extendleft(reversed(sent))
        if sent:
            self._free_ps = max(self._free_ps, sent[-1][0] + self.setting.duration_ps())
        self._device = device
        self._uart = UartReceiver(device, now_us * PS_PER_US)
        self._received.clear()
        self._advance(now_us)

    def release(self, now_us: int) -> None:
        """Send the bytes held back by flow control, if the host may send now.

        The host may not send while its output is suspended or while it waits for CTS.

        Args:
            now_us: present time in microseconds.
        """
        if self.held and not self._stopped:
            held = bytes(self.held)
            self.held.clear()
            self.held += held[self.send(now_us, held) :]

    @property
    def _holds(self) -> bool:
        return bool(self.held) or self._stopped

    @property
    def _stopped(self) -> bool:
        return self.suspended or (self.waits_for_cts and not self._lines.cts)

    def _send_sampled(self, now_us: int, data: bytes) -> None:
        if data and self.setting != self._device:
            self._garbled(now_us)
        self._advance(now_us)
        busy_us = self._end.sent_us if self._end.unsent(now_us) else now_us
        start_ps = max(busy_us * PS_PER_US, self._free_ps)
        for value in data:
            self._waiting.append((start_ps, value, self.setting))
            start_ps += self.setting.duration_ps()
        self._free_ps = start_ps
        self._advance(now_us)

    def set_break(self, now_us: int, *, on: bool) -> None:
        """Start or end a break, during which the line is held at 0.

        Args:
            now_us: present time in microseconds.
            on: true to start the break, false to end it.
        """
        self._advance(now_us)
        self._break_us = now_us if on else NEVER
        self._advance(now_us)

    @property
    def _understood(self) -> bool:
        """Whether bytes can be sent unchanged."""
        sampling = self._waiting or self._received or self._uart.due_ps < NEVER
        return self.setting == self._device and self._break_us == NEVER and not sampling

    def _advance(self, now_us: int) -> None:
        """Sample the line up to now, and deliver the received characters to the device."""
        now_ps = now_us * PS_PER_US
        while self._waiting and self._waiting[0][0] <= now_ps:
            self._begin(*self._waiting.popleft())
        self._listen(self._break_us == NEVER, now_ps)
        while self._received and self._received[0].end_ps <= now_ps:
            self._deliver(self._received.popleft())
        self._come_back(now_us)

    def _begin(self, start_ps: int, value: int, setting: UartSetting) -> None:
        """Put a character on the line; during a break the character is lost."""
        free = self._break_us == NEVER
        self._listen(free, start_ps)
        for level, until_ps in setting.levels(value, start_ps):
            self._listen(free and bool(level), until_ps)
        self._begun_ps = start_ps + setting.duration_ps()

    def _listen(self, level: bool, until_ps: int) -> None:
        self._received += self._uart.push(int(level), until_ps)

    def _deliver(self, character: Character) -> None:
        """Deliver a byte at the time at which the device has received it."""
        self.errors.count(character)
        start_us = (character.end_ps - self._device.duration_ps()) // PS_PER_US
        self._end.send(max(0, start_us), bytes([character.value]))

    def _come_back(self, now_us: int) -> None:
        """Schedule the next call."""
        due_us = NEVER
        if self._waiting:
            due_us = -(-self._waiting[0][0] // PS_PER_US)
        if self._received:
            due_us = min(due_us, -(-self._received[0].end_ps // PS_PER_US))
        if self._uart.due_ps < NEVER:
            due_us = min(due_us, self._uart.due_ps // PS_PER_US + 1)
        if self._break_us == now_us:
            frame_us = -(-self._device.duration_ps() // PS_PER_US)
            due_us = min(due_us, now_us + frame_us)
        if due_us < NEVER:
            self._event_queue.put(self, due_us, self._advance)


# The waits of a host on a rig, and errors for hosts that would wait endlessly.

_LOG = log_of(__name__)

LONGEST_US: Final = 3_600_000_000
"""Longest wait without a timeout (an hour), which then ends with an exception."""

_INSTEAD: Final = "read and write in the thread that made the rig"

NO_ASYNCIO: Final = (
    "a port in virtual time has no file descriptor; hosts that wait on one (asyncio, select) run in"
    " real time: --bench-mode real"
)

_LOOKING: Final = "read with a timeout, or let time.sleep be that of the rig"


class HostWaits(Copyable):
    """Advances a rig while a host waits at a pyserial port.

    Only the thread that made this object may wait.

    Args:
        rig: rig with the emulated line.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._thread = OneThread()
        self._looks = Looks()

    def check_thread(self, name: str) -> None:
        """Raise SerialException if a second thread uses a port. All later calls then raise it, too.

        Args:
            name: name of the port, for the message.
        """
        if threading.current_thread().name.startswith("asyncio"):  # of an event loop's executor
            raise SerialException(f"{name}: {NO_ASYNCIO}")
        if refusal := self._thread.refusal(name, _INSTEAD):
            raise SerialException(refusal)

    def deadline_us(self, timeout_s: float | None) -> int:
        """Return the time in microseconds at which a wait that starts now must end.

        A wait without a timeout lasts at most one hour, then `give_up` raises SerialException.

        Args:
            timeout_s: timeout in seconds, or None if there is no timeout.
        """
        return self.rig.now_us + (LONGEST_US if timeout_s is None else round(timeout_s * 1e6))

    def give_up(self, timeout_s: float | None) -> None:
        """Raise SerialException if a wait without a timeout has lasted one hour.

        Call this method at the time that `deadline_us` has returned. If the wait has a timeout,
        this method does nothing.

        Args:
            timeout_s: timeout in seconds, as for `deadline_us`, or None if there is no timeout.
        """
        if timeout_s is None:
            raise SerialException("nothing came for an hour, and no timeout was given")

    def look(self) -> None:
        """Count a read that returned nothing, to detect a host that polls endlessly.

        Raises:
            SerialException: there were too many such reads at one instant of virtual time.
        """
        if refusal := self._looks.refusal(self.rig.now_us, _LOOKING):
            raise SerialException(refusal)

    def wait(
        self, until_us: int, due_us: Callable[[], int], done: Callable[[], bool] = lambda: False
    ) -> None:
        """Advance the virtual time until an event is due.

        Args:
            until_us: latest end of the wait, in microseconds.
            due_us: function that returns the time of the event, or `NEVER` if the time is unknown.
            done: function that returns true to end the wait at once.
        """
        rig = self.rig
        if rig.now_us >= rig.host_limit.due_us:
            rig.host_limit.count(rig.now_us)
        at_us = due_us()
        if at_us > until_us:
            rig.run_until(lambda: due_us() <= until_us or done(), until_us - rig.now_us)
            at_us = due_us()
        rig.run_until(done, max(0, min(at_us, until_us) - rig.now_us))


Mismatch = Literal["errors", "refuse"]
"""Effect of a host setting that differs from the device's: line errors, or an exception."""


class SerialSide(Copyable):
    """The host's side of a serial line, like an adapter that a program opens as a port.

    The hosts must run in the thread that makes this object. No other thread can advance the time.

    Args:
        rig: the rig that advances while a host waits.
        end: host's end of the line, such as `line.b` or `emulator.host_end`.
        device: setting of the device, by default 115200 8N1. None means that the device has no UART
            (as on USB) and understands a host of any setting.
        mismatch: effect of a different setting. With `"errors"` the host sends and receives wrong
            characters, as with real UARTs. With `"refuse"` an exception is raised at once.

    Attributes:
        setting: setting of the host.
        modem_lines: modem lines of the host.
        receiver: receiver of the host. Its `errors` are the errors of the host's UART.
        transmitter: transmitter of the host. Its `errors` are the errors of the device's UART.
        waits: the waits of the host.
        in_use: whether a port is open here.
        listeners: functions that are called with the time and a text when bytes pass between
            different settings.
    """

    def __init__(
        self,
        rig: Rig,
        end: ByteEnd,
        device: UartSetting | None = UartSetting(),  # noqa: B008 - it is immutable
        *,
        mismatch: Mismatch = "errors",
    ) -> None:
        if mismatch not in ("errors", "refuse"):
            raise ValueError(f"mismatch {mismatch!r}: 'errors' or 'refuse'")
        self.rig, self.device, self.mismatch = rig, device, mismatch
        self.setting: UartSetting = device or UartSetting()
        self.waits = HostWaits(rig)
        self.modem_lines, self.in_use = ModemLines(), False
        self.listeners: list[Callable[[int, str], None]] = []
        self._reported = ""
        self.receiver = HostReceiver(end, self.setting, self._report_mismatch)
        self.transmitter = HostTransmitter(
            rig.event_queue, end, self.setting, self.modem_lines, self._report_mismatch
        )
        self.modem_lines.cts_changed = self._release
        self._changes: deque[tuple[int, UartSetting]] = deque()  # of the device, to come
        end.uart.listeners.append(self._device_changes)
        end.uart.error_listeners.append(self._spoiled)

    def _spoiled(self, mark: Mark, error: str, count: int) -> None:
        """Count characters that a line fault has spoiled; parity errors need a parity bit."""
        if self.device is None or (error == "parity" and self.device.parity == "N"):
            return
        to_device = mark is Mark.TO_DEVICE
        errors = self.transmitter.errors if to_device else self.receiver.errors
        setattr(errors, error, getattr(errors, error) + count)

    def _report_mismatch(self, now_us: int) -> None:
        """Call the listeners, but only once until one of the two settings changes."""
        text = f"the host is set to {self.setting}, the device to {self.device}"
        if text != self._reported:
            self._reported = text
            for listener in self.listeners:
                listener(now_us, text)

    def _device_changes(self, since_us: int, setting: UartSetting) -> None:
        """Apply a change of the device's setting, now or after the data that it still sends."""
        if self.device is None:
            return
        self._changes.append((since_us, setting))
        if since_us <= self.rig.now_us:
            self._follow(self.rig.now_us)
        else:
            self.rig.event_queue.put((self, since_us), since_us, self._follow)

    def _follow(self, now_us: int) -> None:
        while self._changes and self._changes[0][0] <= now_us:
            _, self.device = self._changes.popleft()
        if self.device is not None:
            self.receiver.follow(self.device, now_us)
            self.transmitter.follow(self.device, now_us)

    def _release(self) -> None:
        self.transmitter.release(self.rig.now_us)
