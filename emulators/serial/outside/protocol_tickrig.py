"""The pyserial handler of `tickrig://NAME`, which pyserial finds by this module name."""

from __future__ import annotations

from typing import Any

from tickrig.emulators.serial.outside.sim_serial import SimSerial


class Serial(SimSerial):
    """pyserial port for a URL `tickrig://NAME`, which `serial.serial_for_url` opens.

    The name in the URL is looked up when the port is opened. As with any pyserial port, the default
    setting is 9600 8N1, whatever the device uses. The option `mismatch` of the URL selects what
    happens if the settings of port and device differ. With `?mismatch=errors` characters arrive
    wrong, and with `?mismatch=refuse` an exception is raised. The default is the `mismatch` of the
    `SerialSide` that was offered under the name.

    Args:
        port: URL, which is opened at once, or None to open the port later.
        options: options of `serial.Serial`.
    """

    def __init__(self, port: str | None = None, *args: Any, **options: Any) -> None:
        self._begin(*args, **options)
        self.port = port
        if port is not None:
            self.open()
