"""The receiver of a host, and what it makes of a device of another setting."""

from __future__ import annotations

from collections import deque

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.port import ByteEnd
from tickrig.emulators.serial.outside.uart_errors import UartErrors
from tickrig.wire.instant import NEVER
from tickrig.wire.serial.uart import PS_PER_US, Character, UartReceiver, UartSetting


class HostReceiver(Copyable):
    """Takes bytes of a device from a line, as a UART of the host's setting samples them.

    Of another setting than the device's, a character is there when the device's byte has passed
    in which it ends. A character with an error is a byte like any other and is counted: so Linux
    delivers it to pyserial, and Windows.

    Args:
        end: the host's end of the line.
        device: the device's setting.

    Attributes:
        errors: how many characters were wrong.
    """

    def __init__(self, end: ByteEnd, device: UartSetting) -> None:
        self._end, self._device = end, device
        self.errors = UartErrors()
        self._uart: UartReceiver | None = None  # none has the device's setting
        self._sent_ps = 0  # when the latest byte of the device ended
        self._received: deque[Character] = deque()

    def use(self, setting: UartSetting, now_us: int) -> None:
        """Receive at a setting from now on; a character that is half received is lost.

        Args:
            setting: the host's.
            now_us: the present; all that had come has been taken.
        """
        same = setting == self._device
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
        while (at_us := self._end.due_us) <= now_us:
            self._listen(self._uart, at_us * PS_PER_US, self._end.poll(at_us))
        now_ps = now_us * PS_PER_US
        if at_us == NEVER:  # else a byte is on its way that has begun before now
            self._received += self._uart.push(1, now_ps)
        taken = bytearray()
        while self._received and self._received[0].end_ps <= now_ps:
            character = self._received.popleft()
            self.errors.count(character)
            taken.append(character.value)
        return bytes(taken)

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
