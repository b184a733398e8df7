"""How much a download in segments or blocks may bring."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.wire.canopen.sdo.abort import AbortCode

if TYPE_CHECKING:
    from tickrig.device.canopen.core.entry import Entry
    from tickrig.device.canopen.sdo.sdo_server import SdoServer


class DownloadSize:
    """Judges the size that a client announces, and that of what comes.

    Args:
        server: knows the memory of the slave.
        entry: what is written.
        announced: bytes that the client is going to send, None if it does not say.

    Raises:
        SdoAbort: the entry cannot be written, or what is announced does not fit.

    Attributes:
        announced: as given.
    """

    def __init__(self, server: SdoServer, entry: Entry, announced: int | None) -> None:
        entry.check_writable()
        self.announced = announced
        self._most = entry.size or entry.max_bytes
        self._free = entry.size or server.free_bytes(entry)
        if announced is not None:
            entry.check_size(announced)
            self.check(announced)
            self._most = announced

    def check(self, size: int) -> None:
        """Raise SdoAbort if so many bytes are more than was announced, or than fits."""
        if size > self._most:
            raise SdoAbort(AbortCode.TOO_LONG)
        if size > self._free:
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)
