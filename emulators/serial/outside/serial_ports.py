"""The names under which pyserial opens lines of rigs: `tickrig://NAME`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, get_args

import serial

from tickrig.emulators.serial.outside.serial_side import Mismatch, SerialSide
from tickrig.host.text.names import near

HANDLERS: Final = "tickrig.emulators.serial.outside"
"""The package in which pyserial finds the module `protocol_tickrig`."""

FORM: Final = "tickrig://NAME or tickrig://NAME?mismatch=refuse"


def register_handler() -> None:
    """Register `tickrig://` with `serial.serial_for_url`; further calls have no effect."""
    if HANDLERS not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(HANDLERS)


class _SerialPorts:
    """The lines that can presently be opened by name.

    pyserial opens a port by a string, so the names must be global to the process. They are kept in
    `SERIAL_PORTS`, the only global state of this package. `offer` adds a name for the duration of a
    `with` block.
    """

    def __init__(self) -> None:
        self._sides: dict[str, SerialSide] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The offered names."""
        return tuple(self._sides)

    @contextmanager
    def offer(self, name: str, side: SerialSide) -> Iterator[SerialSide]:
        """Make an emulated line available to pyserial as `tickrig://NAME`, during a `with` block.

        Args:
            name: name that is valid in a URL: without `?`, `#` and spaces. pyserial keeps upper and
                lower case.
            side: host's side of the line.

        Yields:
            The host's side.

        Raises:
            ValueError: the name is already offered, or not valid in a URL.
        """
        if not name or set(name) & set("?# \t\r\n"):
            raise ValueError(f"{name!r} cannot be in a URL: no spaces, no ? and no #")
        if name in self._sides:
            raise ValueError(f"tickrig://{name} is offered already")
        register_handler()
        self._sides[name] = side
        try:
            yield side
        finally:
            del self._sides[name]

    def find(self, url: str) -> tuple[SerialSide, Mismatch | None]:
        """Return the emulated line that a `tickrig://` URL names, and its option `mismatch`.

        Args:
            url: URL such as `tickrig://rrc?mismatch=refuse`.

        Raises:
            SerialException: the URL is invalid, or no rig offers the name.
        """
        name, mismatch = _parse_url(url)
        if name not in self._sides:
            hint = near(url, [f"tickrig://{each}" for each in self.names])
            raise serial.SerialException(f"could not open port {url}: no rig offers it; {hint}")
        return self._sides[name], mismatch


def _parse_url(url: str) -> tuple[str, Mismatch | None]:
    """Return the name and the `mismatch` in a URL.

    Args:
        url: URL such as `tickrig://rrc?mismatch=refuse`.

    Raises:
        SerialException: the URL is invalid.

    >>> _parse_url("tickrig://rrc"), _parse_url("tickrig://rrc?mismatch=refuse")
    (('rrc', None), ('rrc', 'refuse'))
    """
    scheme, _, rest = url.partition("://")
    name, _, query = rest.partition("?")
    options = {"": None, **{f"mismatch={choice}": choice for choice in get_args(Mismatch)}}
    if scheme.lower() != "tickrig" or not name or query not in options:
        raise serial.SerialException(f"could not open port {url}: expected is {FORM}")
    return name.rstrip("/"), options[query]


SERIAL_PORTS: Final = _SerialPorts()
"""The lines that are offered as `tickrig://NAME`."""
