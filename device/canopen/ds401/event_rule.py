"""When an analogue input is an event: limits and deltas (CiA 401, 6421h to 642Dh)."""

from __future__ import annotations

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.families import find_number
from tickrig.device.canopen.ds401.quantity import quantity


class EventRule:
    """The limits and deltas of one channel, as integers or as REAL32.

    Each bit of the interrupt trigger selection (6421h) is an event of its own:

    | bit | event                                               |
    |-----|-----------------------------------------------------|
    | 0   | the value was below the upper limit and is no more  |
    | 1   | the value was at the lower limit or above and is below |
    | 2   | it differs from what was sent last by more than the delta |
    | 3   | it is below what was sent last by more than the negative delta |
    | 4   | it is above what was sent last by more than the positive delta |

    A limit is an event when it is crossed, not as long as it is exceeded. A limit
    that the device has no object for is none, a delta is 0.

    Args:
        dictionary: the objects of the device.
        number: of the channel.
        index: of the upper limit; the other four follow.
        entry: the value that is judged.

    Attributes:
        there: whether the device has one of the five objects for the channel.
    """

    def __init__(self, dictionary: Dictionary, number: int, index: int, entry: Entry) -> None:
        objects = [find_number(dictionary, index + offset, number) for offset in range(5)]
        self._upper, self._lower, *self._deltas = objects
        self.settings = [found for found in objects if found is not None]
        self._entry = entry
        self._sent = self._seen = quantity(entry)

    def begin(self) -> None:
        """Take the value as sent."""
        self._sent = self._seen = quantity(self._entry)

    def sent(self) -> None:
        """Hear that the value is on the bus."""
        self._sent = quantity(self._entry)

    def judge(self, trigger: int) -> bool:
        """Say whether the value is an event."""
        now, before = quantity(self._entry), self._seen
        self._seen = now
        change = now - self._sent
        delta, negative, positive = (quantity(entry) for entry in self._deltas)
        events = (
            self._upper is not None and before < quantity(self._upper) <= now,
            self._lower is not None and before >= quantity(self._lower) > now,
            abs(change) > delta,
            -change > negative,
            change > positive,
        )
        return any(event and trigger >> bit & 1 for bit, event in enumerate(events))
