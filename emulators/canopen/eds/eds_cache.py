"""Descriptions that were read once, so that many nodes are made of one file fast."""

from __future__ import annotations

from pathlib import Path

from tickrig.emulators.canopen.eds.device_description import DeviceDescription
from tickrig.emulators.canopen.eds.eds import read_eds


class EdsCache:
    """Reads each EDS or DCF once, and again when the file has changed."""

    def __init__(self) -> None:
        self._known: dict[Path, tuple[tuple[int, int], DeviceDescription]] = {}

    def read(self, path: Path) -> DeviceDescription:
        """Return what a file describes.

        Raises:
            OSError: the file cannot be read.
            EdsError: it is malformed.
        """
        status = path.stat()
        version = (status.st_mtime_ns, status.st_size)
        known = self._known.get(path)
        if known is None or known[0] != version:
            known = version, read_eds(path)
            self._known[path] = known
        return known[1]
