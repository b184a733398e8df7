"""What the SDO servers of a slave put up with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

TIMEOUT_US: Final = 5_000_000
MEMORY_BYTES: Final = 64 << 20


@dataclass(frozen=True, slots=True)
class SdoLimits:
    """What CiA 301 leaves to the device.

    Attributes:
        timeout_us: silence of the client after which a transfer is aborted, at least 1.
        memory_bytes: what all strings and domains of the slave hold together; what an
            object itself may hold stands in its description.
    """

    timeout_us: int = TIMEOUT_US
    memory_bytes: int = MEMORY_BYTES

    def __post_init__(self) -> None:
        if self.timeout_us < 1:
            raise ValueError(f"an SDO time-out of {self.timeout_us} us is less than 1 us")
        if self.memory_bytes < 0:
            raise ValueError(f"a memory of {self.memory_bytes} bytes is less than 0")


USUAL: Final = SdoLimits()
