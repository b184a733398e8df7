"""The host's side of a serial line on a rig: where a port can be opened."""

from __future__ import annotations

from typing import Literal

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.port import ByteEnd
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.serial.outside.host_receiver import HostReceiver
from tickrig.emulators.serial.outside.host_transmitter import HostTransmitter
from tickrig.emulators.serial.outside.host_waits import HostWaits
from tickrig.emulators.serial.outside.modem_lines import ModemLines
from tickrig.wire.serial.uart import UartSetting

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
        self.receiver = HostReceiver(end, self.setting)
        self.transmitter = HostTransmitter(rig.event_queue, end, self.setting, self.modem_lines)
        self.modem_lines.cts_changed = self._release

    def _release(self) -> None:
        self.transmitter.release(self.rig.now_us)
