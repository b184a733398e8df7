"""EDS, DCF, XDD and XDC files of any project, read as far as they are sound."""

from __future__ import annotations

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


def read_sound(path: Path) -> tuple[EdsDevice, tuple[Finding, ...]]:
    """Read what is sound in such a file, for a host that looks at a device or manages it.

    Returns:
        The device without the objects that cannot be used, and all that is wrong in the file.

    Raises:
        OSError: the file cannot be read.
        EdsError: it has no object that can be used, or is too large.
    """
    file = open_eds(path)
    device = read_device(file)
    if not device.entries:
        raise EdsError(file.errors)
    return device, (*file.errors, *file.warnings)
