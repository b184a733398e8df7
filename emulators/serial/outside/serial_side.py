"""The host's side of a serial line on a rig: where a port can be opened, and where it waits."""

from __future__ import annotations

import logging
from collections.abc import Callable
from threading import get_ident
from typing import Any, Final, Literal

from serial.serialutil import SerialException

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.port import ByteEnd
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.serial.outside.host_receiver import HostReceiver
from tickrig.emulators.serial.outside.host_transmitter import HostTransmitter
from tickrig.emulators.serial.outside.modem_lines import ModemLines
from tickrig.wire.instant import NEVER
from tickrig.wire.serial.uart import UartSetting

LOG = logging.getLogger(__name__)

LONGEST_US: Final = 3_600_000_000
"""A wait without a timeout ends with an exception after an hour."""

MOST_LOOKS: Final = 10_000
"""Looks that a host takes at one instant before it is told that it will wait for ever."""

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
        in_use: whether a port is open here.
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
        self.setting = device or UartSetting()
        self.modem_lines, self.in_use = ModemLines(), False
        self.receiver = HostReceiver(end, self.setting)
        self.transmitter = HostTransmitter(rig.event_queue, end, self.setting, self.modem_lines)
        self.modem_lines.cts_changed = self._release
        self._thread, self._wrong_thread = get_ident(), ""
        self._looks, self._looked_us = 0, NEVER

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Go on in the thread in which it is copied."""
        vars(self).update(state, _thread=get_ident())

    def _release(self) -> None:
        self.transmitter.release(self.rig.now_us)

    def check_thread(self, name: str) -> None:
        """Raise SerialException, now and ever after, if a second thread uses a port.

        Args:
            name: the port.
        """
        if get_ident() != self._thread and not self._wrong_thread:
            self._wrong_thread = (
                f"{name}: a second thread cannot make virtual time pass; read and write in the"
                " thread that made the rig, or run in real time"
            )
            LOG.error(self._wrong_thread)
        if self._wrong_thread:
            raise SerialException(self._wrong_thread)

    def use(self, name: str, setting: UartSetting, mismatch: Mismatch | None = None) -> None:
        """Let the host send and receive at a setting.

        Args:
            name: the port.
            setting: the host's.
            mismatch: what it is that they differ; None as all here.

        Raises:
            SerialException: it is not the device's, and that is refused.
        """
        if self.device is not None:
            if setting != self.device:
                what = f"{name} is set to {setting}, the device has {self.device}"
                if (mismatch or self.mismatch) == "refuse":
                    raise SerialException(what)
                LOG.warning("%s: each samples what the other sends, perhaps wrongly", what)
            self.transmitter.setting = setting
            self.receiver.use(setting, self.rig.now_us)
        self.setting = setting

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
        if self._looked_us != self.rig.now_us:
            self._looks, self._looked_us = 0, self.rig.now_us
        self._looks += 1
        if self._looks > MOST_LOOKS:
            raise SerialException(
                f"looked {MOST_LOOKS} times at {self._looked_us / 1e6:.6f} s: looking makes no"
                " time pass; read with a timeout, or let time.sleep be that of the rig"
            )

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
