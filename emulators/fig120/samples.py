"""What the demonstration looks at while it runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

FULL_SCALE: Final = 32_767
FULL_SCALE_DEG: Final = 180.0


class Sample(NamedTuple):
    """One look at both devices.

    Attributes:
        time_s: seconds since the potentiometer was first turned.
        volts: at the analogue input of the palette.
        reference: what the PDO 290h brought last, 6411h:01 of the motor core unit.
        angle_deg: of the motor's shaft.
    """

    time_s: float
    volts: float
    reference: int
    angle_deg: float

    @property
    def reference_deg(self) -> float:
        """The reference in degrees, at the full scale that 2010h:01 has at power-on."""
        return self.reference * FULL_SCALE_DEG / FULL_SCALE


HEAD: Final = "  time s   potentiometer V   290h    reference deg   shaft deg"


def row(sample: Sample) -> str:
    """Write a sample as a line of the table.

    >>> row(Sample(0.35, 2.5, 16384, 90.0021))
    '   0.350             2.500   00 40         90.0027     90.0021'
    """
    data = sample.reference.to_bytes(2, "little", signed=True).hex(" ").upper()
    return (
        f"{sample.time_s:8.3f}  {sample.volts:16.3f}   {data}"
        f"  {sample.reference_deg:14.4f}  {sample.angle_deg:10.4f}"
    )


def thin(samples: Sequence[Sample], period_s: float) -> list[Sample]:
    """Keep the first sample of each period."""
    kept: list[Sample] = []
    for sample in samples:
        if not kept or sample.time_s // period_s > kept[-1].time_s // period_s:
            kept.append(sample)
    return kept
