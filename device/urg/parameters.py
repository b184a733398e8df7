"""What a sensor is like: a URG-04LX unless said otherwise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.device.twin import Immutable
from tickrig.wire.sensors.scip.description import Specification

URG_04LX: Final = Specification(
    "URG-04LX(Hokuyo Automatic Co.,Ltd.)", 20, 5_600, 1_024, 44, 725, 384, 600
)
"""As one tells of itself (URG network, status information)."""

LAST_STEP: Final = 768
"""The highest step that may be asked for (SCIP 2.0, measurement direction and points)."""

BIT_RATE: Final = 19_200
"""Of RS-232C after power-up; on USB it means nothing."""


PROTOCOLS: Final = ("1.1", "2.0")
"""What sensors speak after power-up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UrgParameters(Immutable):
    """A sensor.

    Attributes:
        serial: its serial number, letters and digits.
        noise: share of the accuracy of 10 mm below 1 m and 1 % above, 0..1.
        seed: of the noise.
        scip: the protocol after power-up. 1.1 is that of the URG-04LX, whose laser is on then;
            2.0 that of sensors such as the URG-04LX-UG01, whose laser is off.

    Raises:
        ValueError: a value that cannot be.
    """

    serial: str = "H0614967"
    noise: float = 0.0
    seed: int = 0
    scip: str = "1.1"

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        if not (self.serial.isascii() and self.serial.isalnum()):
            raise ValueError(f"serial {self.serial!r} is not letters and digits")
        if not 0 <= self.noise <= 1:
            raise ValueError(f"noise {self.noise} is not in 0..1")
        if self.scip not in PROTOCOLS:
            raise ValueError(f"scip {self.scip!r} is not one of {', '.join(PROTOCOLS)}")
