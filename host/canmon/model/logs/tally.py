"""What a log holds beside frames: counted, so that nothing is lost in silence."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from tickrig.host.text.values import counted

KEPT: Final = 5
"""Bad lines that are kept; the others are counted."""

SHOWN: Final = 60
"""Characters of a bad line that are shown."""


BAD_FRAMES: Final = "frames that CAN cannot have"
CAN_XL: Final = "CAN XL frames"
SERIAL_LINES: Final = "lines of a serial port"
ERRORS_COUNTED: Final = "that error frames were counted"
COUNTERS_TOLD: Final = "that error counters are above 0"
OTHER_LINES: Final = "lines with other events"
OTHER_OBJECTS: Final = "objects that are no frames"
NO_TIME: Final = "frames with what is no time"
BAD_PACKETS: Final = "packets that are no frames"
OTHER_PACKETS: Final = "packets of other links"
NO_FRAMES: Final = (SERIAL_LINES, OTHER_LINES, OTHER_OBJECTS, OTHER_PACKETS)
"""What a log may hold beside frames."""


FOREIGN: Final = {
    "***BUSMASTER": "a log of BUSMASTER",
    "Microchip Technology": "a log of Microchip's CAN BUS Analyzer",
    "GVRET-PC Reverse": "a CRTD log",
    "ID,Data Bytes": "a list of frames without times",
    "@ TEXT @": "a trace of CARBUS Analyzer",
}
"""Words among the first lines of other programs' logs, and whose they are."""


@dataclass(slots=True)
class BadLines:
    """Lines that are none of their log.

    Attributes:
        count: how many.
        first: number and text of the first few.
    """

    count: int = 0
    first: list[tuple[int, str]] = field(default_factory=list)

    def add(self, number: int, line: str) -> None:
        """Count a line."""
        self.count += 1
        if len(self.first) < KEPT:
            self.first.append((number, line))

    def messages(self, name: str) -> list[str]:
        """Say it to people, one line each; nothing if there are none."""
        texts = [line for _, line in self.first]
        for begin, program in FOREIGN.items():
            if any(begin in text for text in texts):
                hint = "SavvyCAN saves it as GVRET, which is read"
                return [f"{name}: {program} is not read ({self.count} lines); {hint}"]
        said = [
            f"{name}: line {number} is no frame: {line!a:.{SHOWN}}" for number, line in self.first
        ]
        if self.count > len(self.first):
            said.append(f"{name}: {self.count} lines are no frames; the first {KEPT} are shown")
        return said


@dataclass(slots=True)
class Tally:
    """What was not returned as a frame.

    Attributes:
        bad_lines: lines that are none of the log.
        passed_over: kinds of frames that are not read, as CAN XL, and of what is no
            frame at all (`NO_FRAMES`), and how many.
        lost: frames that the recorder says it lost.
        untimed: frames that have no time in the log; they got that of the frame before.
        undated: dates that could not be read; times count from 0 there.
        shifted_us: what was added to the times of the log.
        errors_told: what lines and objects that are no frames say of errors on the bus, and how
            many do.
        without_errors: why the log has no error frames whatever happened; empty if it may.
    """

    bad_lines: BadLines = field(default_factory=BadLines)
    passed_over: Counter[str] = field(default_factory=Counter)
    lost: int = 0
    untimed: int = 0
    undated: int = 0
    shifted_us: int = 0
    errors_told: Counter[str] = field(default_factory=Counter)
    without_errors: str = ""

    @property
    def unread(self) -> int:
        """Lines and frames that came and were not returned."""
        frames = sum(n for what, n in self.passed_over.items() if what not in NO_FRAMES)
        return self.bad_lines.count + frames

    def messages(self, name: str) -> list[str]:
        """Say it to people, one line each; nothing if all was returned."""
        return self.losses(name) + self.remarks(name)

    def losses(self, name: str) -> list[str]:
        """Say what was lost or could not be taken."""
        said = self.bad_lines.messages(name) + self._passed_over(name, no_frames=False)
        return said + ([f"{name}: its recorder lost {self.lost} frames"] if self.lost else [])

    def remarks(self, name: str) -> list[str]:
        """Say what else there is to know of the log."""
        said = [f"{name}: {self.untimed} frames have no time"] if self.untimed else []
        said += [f"{name}: its date cannot be read: times begin at 0"] if self.undated else []
        if self.shifted_us:
            why = "they begin below 0, or their counter overflows"
            said.append(f"{name}: {self.shifted_us} us were added to its times: {why}")
        return self._passed_over(name, no_frames=True) + said

    def errors(self, name: str) -> list[str]:
        """Say what the log tells of errors beside its error frames, one line each."""
        told = self.errors_told.items()
        return [f"{name}: it says {text}: {counted(count, 'time')}" for text, count in told]

    def _passed_over(self, name: str, *, no_frames: bool) -> list[str]:
        return [
            f"{name}: {count} {what} passed over"
            for what, count in self.passed_over.items()
            if count and (what in NO_FRAMES) is no_frames
        ]
