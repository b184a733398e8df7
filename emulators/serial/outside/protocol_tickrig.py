"""What pyserial opens for `tickrig://NAME`: it finds the module by this name."""

from __future__ import annotations

from typing import Any, Final, get_args

from serial.serialutil import SerialException

from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import Mismatch
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.host.text.names import near

FORM: Final = "tickrig://NAME or tickrig://NAME?mismatch=refuse"


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

    def open(self) -> None:
        """Find the line and open it.

        Raises:
            SerialException: no rig offers this name; see `SimSerial.open`.
        """
        if not self.is_open and self.port is not None:
            name, self.mismatch = parse_url(self.port)
            try:
                self.side = SERIAL_PORTS.find(name)
            except KeyError:
                hint = near(str(self.port), [f"tickrig://{each}" for each in SERIAL_PORTS.names])
                told = f"could not open port {self.port}: no rig offers it; {hint}"
                raise SerialException(told) from None
        super().open()


def parse_url(url: str) -> tuple[str, Mismatch | None]:
    """Return the name in a URL, and what it says of a setting that differs.

    Args:
        url: such as `tickrig://rrc?mismatch=refuse`.

    Raises:
        SerialException: it is not such a URL.

    >>> parse_url("tickrig://rrc"), parse_url("tickrig://rrc?mismatch=refuse")
    (('rrc', None), ('rrc', 'refuse'))
    """
    scheme, _, rest = url.partition("://")
    name, _, query = rest.partition("?")
    options = {"": None, **{f"mismatch={choice}": choice for choice in get_args(Mismatch)}}
    if scheme.lower() != "tickrig" or not name or query not in options:
        raise SerialException(f"could not open port {url}: expected is {FORM}")
    return name.rstrip("/"), options[query]
