"""EDS, DCF, XDD and XDC files of any project, read as far as they are sound."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final

from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, Finding, decode_text

MOST_BYTES: Final = 32_000_000
"""A larger file is no EDS."""


def read_eds_bytes(path: Path) -> bytes:
    """Read a file; OSError if it cannot be read, EdsError if it is too large for an EDS."""
    with path.open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise EdsError([Finding(str(path), "", f"more than {MOST_BYTES:,} bytes: no EDS")])
    return data


def open_eds(path: Path) -> EdsFile:
    """Return the sections of a file; OSError if it cannot be read, EdsError if it is too large."""
    return EdsFile(str(path), decode_text(read_eds_bytes(path)))


def read_sheet(path: Path) -> tuple[EdsFile, EdsDevice]:
    """Return the sections of a file and the device that they describe, of unchanged bytes once.

    Both are shared: read them, but do not add findings to the file.

    Raises:
        OSError: the file cannot be read.
        EdsError: it is too large for an EDS.
    """
    return _sheet_of(str(path), read_eds_bytes(path))


@lru_cache(maxsize=16)  # all nodes of a bus, and each test of a bench, have the same few files
def _sheet_of(name: str, data: bytes) -> tuple[EdsFile, EdsDevice]:
    file = EdsFile(name, decode_text(data))
    return file, read_device(file)


def read_sound(path: Path) -> tuple[EdsDevice, tuple[Finding, ...]]:
    """Read what is sound in such a file, for a host that looks at a device or manages it.

    Returns:
        The device without the objects that cannot be used, and all that is wrong in the file.

    Raises:
        OSError: the file cannot be read.
        EdsError: it has no object that can be used, or is too large.
    """
    file, device = read_sheet(path)
    if not device.entries:
        raise EdsError(file.errors)
    return device, (*file.errors, *file.warnings)
