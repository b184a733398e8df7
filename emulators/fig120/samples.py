"""What the demonstration looks at while it runs, as a table and as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig.emulators.commands.picture import new_figure, write_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


TITLE: Final = "Fig. 120: a potentiometer on node 16 turns the motor of node 32"


def write_plot(samples: Sequence[Sample], path: Path) -> None:
    """Draw voltage, reference and angle over time into a file, PNG, SVG or HTML.

    Raises:
        OSError: the file cannot be written.
    """
    write_figure(_draw(samples), TITLE, path)


def _draw(samples: Sequence[Sample]) -> Figure:
    figure = new_figure(9, 6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2))
    times = [sample.time_s for sample in samples]
    figure.suptitle(TITLE)
    above.plot(times, [sample.volts for sample in samples], color="tab:orange")
    above.set_ylabel("analogue input 1, V")
    above.set_ylim(-0.2, 5.2)
    references = [sample.reference_deg for sample in samples]
    below.plot(times, references, color="tab:gray", drawstyle="steps-post", label="reference")
    below.plot(times, [sample.angle_deg for sample in samples], color="tab:blue", label="shaft")
    below.set_ylabel("angle, degrees")
    below.set_xlabel("time, s")
    below.legend(loc="upper left")
    for axes in (above, below):
        axes.grid(visible=True, alpha=0.3)
    return figure
