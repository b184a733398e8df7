"""The physical side of a reader: where it is, what disturbs it, and what breaks."""

from __future__ import annotations

from typing import Final

from tickrig.device.physical import InputSignal, OutputSignal, SignalType

FAR_M: Final = 10_000
MOST_MARKERS: Final = 1_000

INPUTS: Final = (
    InputSignal("x_m", "place of the reader", low=-FAR_M, high=FAR_M, unit="m", real=True),
    InputSignal(
        "y_m", "place of it, to the left of x", low=-FAR_M, high=FAR_M, unit="m", real=True
    ),
    InputSignal("heading_rad", "where it looks", low=-1e6, high=1e6, unit="rad", real=True),
    InputSignal("dark_marker", "the marker without supply, from 1; 0 if none", high=MOST_MARKERS),
    InputSignal("dirty_window", "dust: half of the range is left", SignalType.FAULT),
    InputSignal("sunlight", "light that leaves nothing to be heard", SignalType.FAULT),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

GROUPS: Final = {"pose": ("x_m", "y_m", "heading_rad")}

OUTPUTS: Final = (
    OutputSignal("listening", "1 while it listens"),
    OutputSignal("in_view", "markers that it would hear now"),
    OutputSignal("received", "markers heard in the latest round"),
    OutputSignal("rounds", "rounds since power-up"),
    OutputSignal("refused", "lines that were no command, since power-up"),
)
