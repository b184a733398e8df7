"""What pyserial opens for `tickrig://NAME`: it finds the module by this name."""

from __future__ import annotations

from typing import Any

from tickrig.emulators.serial.outside.sim_serial import SimSerial


class Serial(SimSerial):
    """The port of a URL, made by `serial.serial_for_url`.

    Its name is looked up when it is opened. As of any port of pyserial, the settings that are not
    given are 9600 8N1, whatever the device has. `?mismatch=errors` or `?mismatch=refuse` says
    what a setting is that differs; without it whoever offers the name has said.

    Args:
        port: the URL, opened at once; None to open it later.
        options: as `serial.Serial` takes them.
    """

    def __init__(self, port: str | None = None, *args: Any, **options: Any) -> None:
        self._begin(*args, **options)
        self.port = port
        if port is not None:
            self.open()
