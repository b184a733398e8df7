"""When a rule is in force: after something, before it, or while a condition holds."""

from __future__ import annotations

from tickrig.host.canmon.model.check.expression.event import Event
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames.record import Record


class Scope:
    """Says whether a rule is in force.

    Attributes:
        text: as it is written.
    """

    text = ""

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Take each frame; say whether it is judged."""
        raise NotImplementedError


class After(Scope):
    """From the first frame after an event on."""

    def __init__(self, event: Event) -> None:
        self._event, self._came, self.text = event, False, f"after {event.text}"

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Hold once it came; the event itself is not judged."""
        came = self._came
        if not came:
            self._came = self._event.matches(record, decoded)
        return came


class Before(Scope):
    """Until an event."""

    def __init__(self, event: Event) -> None:
        self._event, self._came, self.text = event, False, f"before {event.text}"

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Hold until it comes; the event itself is not judged."""
        if not self._came:
            self._came = self._event.matches(record, decoded)
        return not self._came


class While(Scope):
    """While a condition on signals holds, by the latest frame of the bus that carries one."""

    def __init__(self, event: Event) -> None:
        self._event, self._carries, self.text = event, event.carriers(), f"while {event.text}"
        self._true: dict[str, bool] = {}

    def holds(self, record: Record, decoded: Decoded) -> bool:
        """Hold from the frame on that makes it true."""
        if self._carries(decoded):
            self._true[record.channel] = self._event.matches(record, decoded)
        return self._true.get(record.channel, False)
