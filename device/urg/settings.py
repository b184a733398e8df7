"""What SS and HS set (SCIP 2.0, sensor commands)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.device.urg.parameters import BIT_RATE
from tickrig.device.urg.texts import BY_DEFAULT
from tickrig.wire.sensors.scip import status

BIT_RATES: Final = (19_200, 38_400, 57_600, 115_200, 250_000, 500_000, 750_000)


@dataclass(slots=True)
class Settings:
    """Bit rate and sensitivity; both are told, and change nothing that is emulated."""

    rate: int = BIT_RATE
    sensitive: bool = False

    @property
    def mode(self) -> str:
        """How it measures, as II tells it."""
        return f"Measuring by {'Sensitive' if self.sensitive else 'Normal'} Mode"

    @property
    def rate_text(self) -> str:
        """The bit rate, as II tells it."""
        return f"{self.rate}[bps]{BY_DEFAULT if self.rate == BIT_RATE else ''}"

    def set_rate(self, text: str) -> str:
        """Set the bit rate; return the status."""
        if not text.isdecimal():
            return "01"
        rate = int(text)
        if rate not in BIT_RATES:
            return "02"
        if rate == self.rate:
            return "03"
        self.rate = rate
        return status.OK

    def set_sensitivity(self, text: str) -> str:
        """Set the sensitivity; return the status."""
        if text not in ("0", "1"):
            return "01"
        sensitive = text == "1"
        if sensitive == self.sensitive:
            return "02"
        self.sensitive = sensitive
        return status.OK
