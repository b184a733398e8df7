"""Modem lines between a host's port and a device."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.device.twin import Copyable


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
