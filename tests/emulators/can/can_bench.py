"""What the tests of the CAN bus share."""

from __future__ import annotations

from hypothesis import strategies as st

from tickrig.emulators.can.wire import CanWire
from tickrig.wire.can import CanFrame, ErrorFrame, Frames


def frames(text: str) -> Frames:
    """Read frames in candump's notation."""
    return tuple(CanFrame.parse(word) for word in text.split())


class Log:
    """Hears a wire, and writes down what it heard."""

    def __init__(self, wire: CanWire) -> None:
        self.heard: list[tuple[int, CanFrame | ErrorFrame]] = []
        wire.observers.append(lambda at_us, heard: self.heard.append((at_us, heard)))

    @property
    def text(self) -> str:
        return " ".join(str(heard) for _, heard in self.heard)

    @property
    def times_us(self) -> list[int]:
        return [at_us for at_us, _ in self.heard]

    @property
    def lines(self) -> list[str]:
        return [f"{at_us} {heard}" for at_us, heard in self.heard]


@st.composite
def some_frames(draw: st.DrawFn) -> CanFrame:
    """Draw frames with few CAN-IDs, so that they meet."""
    extended = draw(st.booleans())
    can_id = draw(st.sampled_from((0x0, 0x1, 0x100, 0x181, 0x7FF))) << (18 if extended else 0)
    if draw(st.integers(0, 4)) == 0:
        return CanFrame(can_id, b"", True, extended, draw(st.integers(0, 8)))
    return CanFrame(can_id, draw(st.binary(max_size=8)), extended=extended)
