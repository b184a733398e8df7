"""How the boot-up of a slave ended (CiA 302-2, error status of the boot slave process).

>>> BootStatus("D").text
'1018h:01 vendor-ID is another than expected, or cannot be read'
"""

from __future__ import annotations

from enum import Enum
from typing import Final


class BootStatus(Enum):
    """The error status by its letter; `BOOTED` has none."""

    BOOTED = ""
    NOT_LISTED = "A"
    NO_ANSWER = "B"
    DEVICE_TYPE = "C"
    VENDOR = "D"
    NO_HEARTBEAT = "E"
    NO_GUARD_ANSWER = "F"
    NO_PROGRAM_OBJECTS = "G"
    UPDATE_NOT_ALLOWED = "H"
    UPDATE_FAILED = "I"
    CONFIGURATION = "J"
    NO_FIRST_HEARTBEAT = "K"
    WAS_OPERATIONAL = "L"
    PRODUCT = "M"
    REVISION = "N"
    SERIAL = "O"

    @property
    def text(self) -> str:
        """What it means, in words."""
        return _TEXTS[self]

    @property
    def good(self) -> bool:
        """Whether the slave is at work: it has booted, or had been Operational all along."""
        return self in (BootStatus.BOOTED, BootStatus.WAS_OPERATIONAL)


_TEXTS: Final = {
    BootStatus.BOOTED: "booted",
    BootStatus.NOT_LISTED: "no slave of this master (1F81h)",
    BootStatus.NO_ANSWER: "1000h device type cannot be read",
    BootStatus.DEVICE_TYPE: "1000h device type is another than expected",
    BootStatus.VENDOR: "1018h:01 vendor-ID is another than expected, or cannot be read",
    BootStatus.NO_HEARTBEAT: "to be kept alive, but no heartbeat came, or no boot-up after a reset",
    BootStatus.NO_GUARD_ANSWER: "to be kept alive, but node guarding was not answered",
    BootStatus.NO_PROGRAM_OBJECTS: "1F56h:01 software identification cannot be read",
    BootStatus.UPDATE_NOT_ALLOWED: "other software than expected, and no leave to update it",
    BootStatus.UPDATE_FAILED: "other software than expected, and its update failed",
    BootStatus.CONFIGURATION: "the configuration was not taken",
    BootStatus.NO_FIRST_HEARTBEAT: "no heartbeat within the consumer heartbeat time",
    BootStatus.WAS_OPERATIONAL: "had been Operational and was left so",
    BootStatus.PRODUCT: "1018h:02 product code is another than expected, or cannot be read",
    BootStatus.REVISION: "1018h:03 revision number is another than expected, or cannot be read",
    BootStatus.SERIAL: "1018h:04 serial number is another than expected, or cannot be read",
}
