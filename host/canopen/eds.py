"""EDS, DCF, XDD and XDC files of any project, read as far as they are sound."""

from __future__ import annotations

from pathlib import Path

from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, Finding, decode_text


def open_eds(path: Path) -> EdsFile:
    """Return the sections of a file; OSError if it cannot be read."""
    return EdsFile(str(path), decode_text(path.read_bytes()))


def read_sound(path: Path) -> tuple[EdsDevice, tuple[Finding, ...]]:
    """Read what is sound in such a file, for a host that looks at a device or manages it.

    Returns:
        The device without the objects that cannot be used, and all that is wrong in the file.

    Raises:
        OSError: the file cannot be read.
        EdsError: it has no object that can be used.
    """
    file = open_eds(path)
    device = read_device(file)
    if not device.entries:
        raise EdsError(file.errors)
    return device, (*file.errors, *file.warnings)
