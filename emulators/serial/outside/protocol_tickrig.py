"""The pyserial handler of `tickrig://NAME`, which pyserial finds by this module name."""

from __future__ import annotations

from typing import Any

from tickrig.emulators.serial.outside.sim_serial import SimSerial


class Serial(SimSerial):
    """pyserial port for a URL `tickrig://NAME`, which `serial.serial_for_url` opens.

    The name in the URL is looked up when the port is opened. As with any pyserial port, the default
    setting is 9600 8N1, whatever the device uses. If the settings of port and device differ, the
    option `?mismatch=errors` or `?mismatch=refuse` of the URL selects what happens. For a URL
    without this option, the `mismatch` applies that was chosen when the name was offered to hosts.

    Args:
        port: URL, which is opened at once, or None to open the port later.
        options: options of `serial.Serial`.
    """

    def __init__(self, port: str | None = None, *args: Any, **options: Any) -> None:
        self._begin(*args, **options)
        self.port = port
        if port is not None:
            self.open()
