"""How a service refuses an SDO access: an exception that the SDO server turns into an abort."""

from __future__ import annotations

from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo.abort import AbortCode


class SdoAbort(Exception):  # noqa: N818 - the standard's word
    """The access is refused; it never leaves the slave but as an abort frame.

    Attributes:
        code: why.
    """

    def __init__(self, code: AbortCode) -> None:
        super().__init__(f"{code.name} (0x{code:08X})")
        self.code = code


def whole_number(value: Value) -> int:
    """Return a value that must be an integer; SdoAbort if the dictionary says otherwise."""
    if not isinstance(value, int):
        raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)
    return value
