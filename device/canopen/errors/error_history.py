"""The pre-defined error field 1003h (CiA 301, object dictionary)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo.abort import AbortCode

PRE_DEFINED_ERROR_FIELD: Final = 0x1003


class ErrorHistory:
    """Keeps the latest errors, the newest at sub-index 1.

    Sub-index 0 counts them; 0 written to it forgets them all, other values are
    refused with 0609 0030h. A sub-index without an error is answered with
    0800 0024h. A field is the error code with the first two manufacturer-specific
    bytes above it. That an error is gone is not noted.

    Args:
        dictionary: with or without 1003h.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._count = dictionary.find(PRE_DEFINED_ERROR_FIELD)
        self._fields = dictionary.elements(PRE_DEFINED_ERROR_FIELD)
        if self._count is not None:
            self._count.guard = _only_zero
            for field in self._fields:
                field.source = _reader(field, self._count)

    def note(self, code: int, text: bytes) -> None:
        """Put an error at the top; the oldest one falls out when all fields are full."""
        if self._count is None or not self._fields:
            return
        count = min(self._count.number + 1, len(self._fields))
        for sub in reversed(range(1, count)):
            self._fields[sub].assign(self._fields[sub - 1].data)
        self._fields[0].assign(code.to_bytes(2, "little") + text[:2].ljust(2, b"\0"))
        self._count.assign(bytes([count]))


def _reader(field: Entry, count: Entry) -> Callable[[], bytes]:
    def read() -> bytes:
        if field.sub > count.number:
            raise SdoAbort(AbortCode.NO_DATA)
        return field.data

    return read


def _only_zero(value: Value) -> None:
    if value != 0:
        raise SdoAbort(AbortCode.VALUE_RANGE)
