"""The transmitter of a host, and what a device of another setting makes of it."""

from __future__ import annotations

from collections import deque
from typing import Final

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.port import ByteEnd
from tickrig.emulators.serial.outside.modem_lines import ModemLines
from tickrig.emulators.serial.outside.uart_errors import UartErrors
from tickrig.wire.instant import NEVER
from tickrig.wire.serial.uart import PS_PER_US, Character, UartReceiver, UartSetting

HELD_BYTES: Final = 4_096
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

    Attributes:
        setting: the host's, for what is sent from now on.
        waits_for_cts: whether nothing is sent while CTS is off.
        suspended: whether nothing is sent until the host resumes its output.
        held: what waits for either.
        errors: how many characters the device received with an error.
    """

    def __init__(
        self, event_queue: EventQueue, end: ByteEnd, device: UartSetting, lines: ModemLines
    ) -> None:
        self._event_queue, self._end, self._device, self._lines = event_queue, end, device, lines
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
            return HELD_BYTES - len(self.held)
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
