"""Read EDS, DCF, XDD and XDC files of any project, skipping invalid parts."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final

from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, Finding, decode_text
from tickrig.wire.canopen.eds.eds_value import parse_number, plain_numbers

MOST_BYTES: Final = 32_000_000
"""The size above which a file is not an EDS."""


def read_eds_bytes(path: Path) -> bytes:
    """Read an EDS file as bytes, up to the largest size that an EDS may have.

    Raises:
        OSError: the file cannot be read.
        EdsError: the file is too large for an EDS.
    """
    with path.open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise EdsError([Finding(str(path), "", f"more than {MOST_BYTES:,} bytes: not an EDS")])
    return data


_OTHER_FILES: Final = {
    ".yml": "YAML, not an EDS; for a bus.yml use: tickrig check",
    ".yaml": "YAML, not an EDS; for a bus.yml use: tickrig check",
    ".toml": "TOML, not an EDS; for a rig file use: tickrig check",
    ".dbc": "a DBC file, not an EDS; use: canmon dump LOG --dbc",
}
"""Suffixes of files that users pass in place of an EDS, with the command that accepts them."""


def _check_kind(path: Path, data: bytes) -> None:
    """Raise EdsError if the name of a file indicates another kind and its sections are no EDS."""
    other = _OTHER_FILES.get(path.suffix.lower())
    if other and b"[deviceinfo]" not in data.lower():
        raise EdsError([Finding(str(path), "", f"{other} {path}")])


def open_eds(path: Path) -> EdsFile:
    """Read an EDS, DCF, XDD or XDC file, and return its sections.

    Raises:
        OSError: the file cannot be read.
        EdsError: the file is too large for an EDS, or has another format.
    """
    data = read_eds_bytes(path)
    _check_kind(path, data)
    return EdsFile(str(path), decode_text(data))


def read_sheet(path: Path) -> tuple[EdsFile, EdsDevice]:
    """Read an EDS, DCF, XDD or XDC file. Return its sections and the device that they describe.

    Files with equal bytes are parsed only once, so several callers may get the same two objects. Do
    not change these objects, for example by adding findings to the `EdsFile`.

    Raises:
        OSError: the file cannot be read.
        EdsError: the file is too large for an EDS, or has another format.
    """
    data = read_eds_bytes(path)
    _check_kind(path, data)
    return sheet_of(str(path), data)


@lru_cache(maxsize=16)  # all nodes of a bus, and each test of a bench, have the same few files
def sheet_of(name: str, data: bytes) -> tuple[EdsFile, EdsDevice]:
    """Return the sections of these bytes and the device they describe; see `read_sheet`."""
    file = EdsFile(name, decode_text(data))
    return file, read_device(file)


def read_sound(path: Path) -> tuple[EdsDevice, tuple[Finding, ...]]:
    """Read the valid parts of an EDS, for a host that displays or manages the device.

    Returns:
        The device without its unusable objects, and the list of all findings in the file.

    Raises:
        OSError: the file cannot be read.
        EdsError: the file has no valid object, or is too large.
    """
    file, device = read_sheet(path)
    if not device.entries:
        raise EdsError(file.errors)
    return device, (*file.errors, *file.warnings)


def eds_number(text: str) -> int | None:
    """Return the number that a value in an EDS represents, or None if it is not a number."""
    try:
        return parse_number(plain_numbers(text))
    except ValueError:
        return None
