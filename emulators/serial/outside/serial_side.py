"""The host's side of a serial line on a rig: where a port can be opened."""

from __future__ import annotations

import logging
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
from tickrig.host.text.trace import Mark
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import PS_PER_US, Character, UartReceiver, UartSetting


def _ignore(now_us: int) -> None:
    """Do nothing."""


# Characters that a UART received with an error.


@dataclass(slots=True)
class UartErrors:
    """How many characters were wrong, each counted once, as Linux does (`TIOCGICOUNT`).

    Attributes:
        framing: the line was 0 where a stop bit should have been.
        parity: the parity bit was wrong.
        breaks: the line was 0 for a whole character.
    """

    framing: int = 0
    parity: int = 0
    breaks: int = 0

    def count(self, character: Character) -> None:
        """Count a character if it is wrong.

        Args:
            character: as it was received.
        """
        if character.line_break:
            self.breaks += 1
        elif character.parity_error:
            self.parity += 1
        elif character.framing_error:
            self.framing += 1


# Modem lines between a host's port and a device.


class ModemLines(Copyable):
    """DTR and RTS of a host, and what it reads of CTS, DSR, RI and CD.

    No device here has such lines: its host reads what a USB adapter reads whose pins are open
    (the inputs of FT232R, CP2102 and CH340 are pulled up, which is off). Whoever has a device
    with such lines sets what the host is to read.

    Attributes:
        dtr: Data Terminal Ready, set by the host; off while its port is closed.
        rts: Request To Send, set by the host; off while its port is closed.
        dsr: Data Set Ready, read by the host.
        ri: Ring Indicator, read by the host.
        cd: Carrier Detect, read by the host.
        cts_changed: called when `cts` was set: bytes may wait for it.
    """

    def __init__(self) -> None:
        self.dtr = self.rts = False
        self.dsr = self.ri = self.cd = self._cts = False
        self.cts_changed: Callable[[], None] | None = None

    @property
    def cts(self) -> bool:
        """Clear To Send, read by the host; a port with `rtscts` sends only while it is on."""
        return self._cts

    @cts.setter
    def cts(self, value: bool) -> None:
        self._cts = value
        if self.cts_changed is not None:
            self.cts_changed()


# The receiver of a host, and what it makes of a device of another setting.


class HostReceiver(Copyable):
    """Takes bytes of a device from a line, as a UART of the host's setting samples them.

    Of another setting than the device's, a character is there when the device's byte has passed
    in which it ends. A character with an error is a byte like any other and is counted: so Linux
    delivers it to pyserial, and Windows.

    Args:
        end: the host's end of the line.
        device: the device's setting.
        garbled: called with the time when bytes of another setting are sampled.

    Attributes:
        errors: how many characters were wrong.
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
        """Let the device send with another setting from now on; the host's stays as it is.

        Args:
            device: the new setting.
            now_us: the present.
        """
        if self._uart is None:
            now_ps = now_us * PS_PER_US
            self._received += [Character(value, now_ps) for value in self._end.poll(now_us)]
            self._uart = UartReceiver(self._setting, now_ps)
        else:
            self._sample(self._uart, now_us)
        self._device = device

    def use(self, setting: UartSetting, now_us: int) -> None:
        """Receive at a setting from now on; a character that is half received is lost.

        Args:
            setting: the host's.
            now_us: the present; all that had come has been taken.
        """
        same, self._setting = setting == self._device, setting
        self._uart = None if same else UartReceiver(setting, now_us * PS_PER_US)
        self._received.clear()

    @property
    def due_us(self) -> int:
        """When there will be something to take, or to look at."""
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
        """What is on its way and was not taken, as far as it is known to arrive."""
        return self._end.coming if self._uart is None else b""

    def arrival_us(self, count: int) -> int:
        """Return when so many characters will be there, or when to look again.

        Args:
            count: how many, at least 1.
        """
        return self._end.arrival_us(count) if self._uart is None else self.due_us

    def poll(self, now_us: int) -> bytes:
        """Take the characters that have been received.

        Args:
            now_us: the present.
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
        if at_us == NEVER:  # else a byte is on its way that has begun before now
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


# The transmitter of a host, and what a device of another setting makes of it.

_HELD_BYTES: Final = 4_096
"""So many bytes wait for CTS."""


class HostTransmitter(Copyable):
    """Sends bytes of a host to a device, which samples them at its own setting.

    Bytes of the device's setting go on the line as they are. All else, a break too, is sampled:
    the device receives each character when its own stop bit should have passed, with the value
    that was sampled, wrong or not, as most UARTs deliver it; a break is a byte of 0. Errors are
    counted, and the device does not see them.

    Args:
        event_queue: of the rig: characters arrive between its ticks.
        end: the host's end of the line.
        device: the device's setting.
        lines: with the CTS that it may have to wait for.
        garbled: called with the time when bytes are sent that the device samples otherwise.

    Attributes:
        setting: the host's, for what is sent from now on.
        waits_for_cts: whether nothing is sent while CTS is off.
        suspended: whether nothing is sent until the host resumes its output.
        held: what waits for either.
        errors: how many characters the device received with an error.
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
        self._begun_ps = self._free_ps = 0  # when the last that has begun ends; when all have
        self._uart = UartReceiver(device)
        self._received: deque[Character] = deque()

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` takes at `now_us` without loss."""
        if self._holds:
            return _HELD_BYTES - len(self.held)
        return max(0, self._end.room(now_us) - len(self._waiting))

    @property
    def sent_us(self) -> int:
        """When the last byte will have passed; past or `NEVER` if it has."""
        if self.held:
            return NEVER
        sampled_us, line_us = -(-self._free_ps // PS_PER_US), self._end.sent_us
        return max(sampled_us, line_us) if line_us < NEVER else sampled_us

    def unsent(self, now_us: int) -> int:
        """Return how many bytes have not passed yet."""
        begun = self._begun_ps > now_us * PS_PER_US
        return self._end.unsent(now_us) + len(self._waiting) + begun + len(self.held)

    def drop_unsent(self, now_us: int) -> None:
        """Forget the bytes of which no bit is on the line yet."""
        self._end.drop_unsent(now_us)
        self._waiting.clear()
        self.held.clear()
        self._free_ps = self._begun_ps

    def send(self, now_us: int, data: bytes) -> int:
        """Send bytes behind those that are being sent.

        Args:
            now_us: the present.
            data: the bytes.

        Returns:
            How many there was room for.
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
        """Let the device receive with another setting from now on.

        The device loses the character that it has half received. What is on its way is sampled.

        Args:
            device: the new setting.
            now_us: the present.
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
        """Send what was held, unless the output is suspended or still waits for CTS.

        Args:
            now_us: the present.
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
        """Let the line be 0, or be free again.

        Args:
            now_us: the present.
            on: whether there is a break.
        """
        self._advance(now_us)
        self._break_us = now_us if on else NEVER
        self._advance(now_us)

    @property
    def _understood(self) -> bool:
        """Whether bytes can go on the line as they are."""
        sampling = self._waiting or self._received or self._uart.due_ps < NEVER
        return self.setting == self._device and self._break_us == NEVER and not sampling

    def _advance(self, now_us: int) -> None:
        """Sample the line up to now, and let the device have what it has received."""
        now_ps = now_us * PS_PER_US
        while self._waiting and self._waiting[0][0] <= now_ps:
            self._begin(*self._waiting.popleft())
        self._listen(self._break_us == NEVER, now_ps)
        while self._received and self._received[0].end_ps <= now_ps:
            self._deliver(self._received.popleft())
        self._come_back(now_us)

    def _begin(self, start_ps: int, value: int, setting: UartSetting) -> None:
        """Put a character on the line; in a break nobody hears it."""
        free = self._break_us == NEVER
        self._listen(free, start_ps)
        for level, until_ps in setting.levels(value, start_ps):
            self._listen(free and bool(level), until_ps)
        self._begun_ps = start_ps + setting.duration_ps()

    def _listen(self, level: bool, until_ps: int) -> None:
        self._received += self._uart.push(int(level), until_ps)

    def _deliver(self, character: Character) -> None:
        """Let a byte arrive at the time at which the device has received it."""
        self.errors.count(character)
        start_us = (character.end_ps - self._device.duration_ps()) // PS_PER_US
        self._end.send(max(0, start_us), bytes([character.value]))

    def _come_back(self, now_us: int) -> None:
        """Be called when there is something to do next."""
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


# The waits of a host on a rig, and what it is told that would wait for ever.

_LOG = logging.getLogger(__name__)

LONGEST_US: Final = 3_600_000_000
"""A wait without a timeout ends with an exception after an hour."""

_INSTEAD: Final = "read and write in the thread that made the rig"

NO_ASYNCIO: Final = (
    "a port in virtual time has no file descriptor; hosts that wait on one (asyncio, select) run in"
    " real time: --bench-mode real"
)

_LOOKING: Final = "read with a timeout, or let time.sleep be that of the rig"


class HostWaits(Copyable):
    """Steps a rig while a host waits, in the thread that made it and in no other.

    Args:
        rig: the rig.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._thread = OneThread()
        self._looks = Looks()

    def check_thread(self, name: str) -> None:
        """Raise SerialException, now and ever after, if a second thread uses a port.

        Args:
            name: the port.
        """
        if threading.current_thread().name.startswith("asyncio"):  # of an event loop's executor
            raise SerialException(f"{name}: {NO_ASYNCIO}")
        if refusal := self._thread.refusal(name, _INSTEAD):
            raise SerialException(refusal)

    def deadline_us(self, timeout_s: float | None) -> int:
        """Return when a timeout that begins now ends; without one, when `give_up` says so.

        Args:
            timeout_s: the timeout in seconds, None if there is none.
        """
        return self.rig.now_us + (LONGEST_US if timeout_s is None else round(timeout_s * 1e6))

    def give_up(self, timeout_s: float | None) -> None:
        """Raise SerialException if there was no timeout: the host would wait for ever.

        Args:
            timeout_s: the timeout that is over.
        """
        if timeout_s is None:
            raise SerialException("nothing came for an hour, and no timeout was given")

    def look(self) -> None:
        """Count a look that found nothing.

        Raises:
            SerialException: there were too many at one instant: the host would wait for ever.
        """
        if refusal := self._looks.refusal(self.rig.now_us, _LOOKING):
            raise SerialException(refusal)

    def wait(
        self, until_us: int, due_us: Callable[[], int], done: Callable[[], bool] = lambda: False
    ) -> None:
        """Let time pass until something is due.

        Args:
            until_us: until when at most.
            due_us: returns when it will be, `NEVER` if that is not known.
            done: returns whether the wait is to end at once.
        """
        rig = self.rig
        at_us = due_us()
        if at_us > until_us:
            rig.run_until(lambda: due_us() <= until_us or done(), until_us - rig.now_us)
            at_us = due_us()
        rig.run_until(done, max(0, min(at_us, until_us) - rig.now_us))


Mismatch = Literal["errors", "refuse"]
"""What a host has of a setting that is not the device's: errors, as on a line, or an exception."""


class SerialSide(Copyable):
    """The host's side of a serial line: the adapter that a program opens as a port.

    The thread that makes it is the one in which its hosts run: no other can make time pass.

    Args:
        rig: the rig that is stepped while a host waits.
        end: the host's end of the line, such as `line.b` or `emulator.host_end`.
        device: the device's setting, 115200 8N1 unless given; None if it has no UART, as behind
            USB, and understands a host of any setting.
        mismatch: `"errors"` if a host of another setting sends and receives what UARTs make of
            it; `"refuse"` if that raises at once.

    Attributes:
        setting: the host's.
        modem_lines: DTR and RTS of the host, and what it reads of the others.
        receiver: what the host receives; its `errors` are those that the host's UART sees.
        transmitter: what the host sends; its `errors` are those that the device's UART sees.
        waits: the waits of the host.
        in_use: whether a port is open here.
        listeners: called with the time and a text, when bytes pass between two settings.
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
        """Count what a fault of the line has spoiled; without a parity bit none is wrong."""
        if self.device is None or (error == "parity" and self.device.parity == "N"):
            return
        to_device = mark is Mark.TO_DEVICE
        errors = self.transmitter.errors if to_device else self.receiver.errors
        setattr(errors, error, getattr(errors, error) + count)

    def _report_mismatch(self, now_us: int) -> None:
        """Call the listeners, once until one of both settings changes."""
        text = f"the host is set to {self.setting}, the device to {self.device}"
        if text != self._reported:
            self._reported = text
            for listener in self.listeners:
                listener(now_us, text)

    def _device_changes(self, since_us: int, setting: UartSetting) -> None:
        """Note that the device changes its setting, now or behind what it still sends."""
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
