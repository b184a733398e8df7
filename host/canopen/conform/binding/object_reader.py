"""Reads objects of a node, each once, and notes what contradicts their descriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.host.canopen.conform.bus.sdo_client import number_of
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoTimeout
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo.abort import AbortCode, describe_abort

Upload = Callable[[int, int], bytes]
"""Reads an object by index and sub-index; raises SdoAborted or SdoTimeout."""

PATIENCE: Final = 3
"""So many requests in a row without an answer: the node is gone."""

ABSENT: Final = (AbortCode.NO_OBJECT, AbortCode.NO_SUBINDEX)
BROKEN: Final = (AbortCode.TOGGLE_BIT, AbortCode.COMMAND_SPECIFIER)
"""With these an upload ends that went wrong, from whichever side."""


class ObjectReader:
    """Reads what is asked for, and remembers it.

    Args:
        upload: reads an object.

    Attributes:
        findings: descriptions that the node contradicts, one a line.
    """

    def __init__(self, upload: Upload) -> None:
        self._upload = upload
        self._known: dict[tuple[int, int], bytes | SdoFailed] = {}
        self._silent = 0
        self.findings: list[str] = []

    def read(self, entry: EntryDescription) -> bytes | None:
        """Return what a described object holds, None where it cannot be read or has another size.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        new = (entry.index, entry.sub) not in self._known
        answer = self.try_read(entry.index, entry.sub)
        wrong = _contradiction(entry, answer)
        if wrong and new:
            self.findings.append(f"{entry.index:04X}h:{entry.sub:02X} {entry.name} {wrong}")
        return answer if isinstance(answer, bytes) and not wrong else None

    def number(self, index: int, sub: int) -> int | None:
        """Return an unsigned number of at most 32 bits, None where there is none.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        answer = self.try_read(index, sub)
        return number_of(answer) if isinstance(answer, bytes) else None

    def has_nothing(self, index: int, sub: int) -> bool:
        """Return whether the node refuses to read a place, with whatever code.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        return isinstance(self.try_read(index, sub), SdoAborted)

    def try_read(self, index: int, sub: int) -> bytes | SdoFailed:
        """Return what the node answers to an upload.

        Raises:
            SdoTimeout: the node has stopped answering.
        """
        at = (index, sub)
        if at not in self._known:
            try:
                self._known[at] = self._upload(index, sub)
                self._silent = 0
            except SdoTimeout as error:
                self._silent += 1
                if self._silent == PATIENCE:
                    raise
                self._known[at] = error
            except SdoFailed as error:
                self._known[at], self._silent = error, 0
        return self._known[at]


def _contradiction(entry: EntryDescription, answer: bytes | SdoFailed) -> str:
    """Return how an answer differs from a description, empty if it does not."""
    match answer:
        case SdoAborted() if answer.code in ABSENT and entry.sub in {0, 1}:
            return f"is described, and the node does not have it: {describe_abort(answer.code)}"
        case SdoAborted() if answer.code in BROKEN:
            return f"cannot be read: {describe_abort(answer.code)}"
        case SdoTimeout():
            return "was not answered"
        case bytes() if entry.size and len(answer) != entry.size:
            return f"is described as {entry.data_type.name}, and the node sends {len(answer)} bytes"
    return ""
