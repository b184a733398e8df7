"""A frame that is sent again and again."""

from __future__ import annotations

from dataclasses import dataclass, field

from tickrig.host.monitor.transmit.frame_fields import FrameFields
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER


@dataclass(slots=True)
class Cyclic:
    """Sends a frame each period; the deadlines are absolute, so it does not drift.

    A period that has passed whole is not made up for, it is counted.

    Args:
        frame: what is sent.
        period_us: at least 1.
        due_us: when it is first sent.
        count: how often it is sent, 0 for ever.
        fields: what changes in it each time.

    Attributes:
        sent: how often it was.
        missed: how many periods passed without it.

    Raises:
        ValueError: a period below 1 us, or a field that is not in the frame.
    """

    frame: CanFrame
    period_us: int
    due_us: int = 0
    count: int = 0
    fields: FrameFields = field(default_factory=FrameFields)
    sent: int = field(default=0, init=False)
    missed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Check the arguments."""
        if self.period_us < 1:
            raise ValueError(f"a period of {self.period_us} us; 1 us is the least")
        self.fields.check(len(self.frame.data))

    def tick(self, now_us: int) -> Frames:
        """Return the frame if it is due."""
        if now_us < self.due_us:
            return ()
        late = (now_us - self.due_us) // self.period_us
        self.missed += late
        self.due_us += (late + 1) * self.period_us
        data = self.fields.put(self.frame.data, self.sent)
        self.sent += 1
        if self.sent == self.count:
            self.due_us = NEVER
        return (self.frame._replace(data=data),)
