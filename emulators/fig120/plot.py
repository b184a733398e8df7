"""The curves of the demonstration as a picture; needs matplotlib (the extra `plot`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tickrig.emulators.commands.picture import new_figure, write_figure
from tickrig.emulators.fig120.samples import Sample

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
