"""Faults of a CAN bus: drop, corrupt, duplicate, delay, babble, short."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from tickrig.device.chance import Chance, threshold_of
from tickrig.device.twin import Copyable, Listeners
from tickrig.emulators.rig.faults import FaultArguments, FaultForm, FaultTally, bind_arguments
from tickrig.wire.can import CanFrame

_DELAY_US: Final = 10_000
"""Time for which a delayed node does not send."""


class FaultVerdict(Enum):
    """Effect of a fault on a frame."""

    SENT = auto()
    DROPPED = auto()
    CORRUPTED = auto()
    DUPLICATED = auto()


@dataclass(frozen=True, slots=True)
class _CanFaultType(FaultForm):
    """A fault that can be armed by name.

    Attributes:
        verdict: effect of the fault on a frame that it hits.
    """

    verdict: FaultVerdict | None = None


CAN_FAULTS: Final[Mapping[str, _CanFaultType]] = {
    "drop": _CanFaultType(
        "each frame is acknowledged, and received by no node", verdict=FaultVerdict.DROPPED
    ),
    "corrupt": _CanFaultType(
        "a bit of each frame is inverted: an error frame follows, and the frame is sent again",
        verdict=FaultVerdict.CORRUPTED,
    ),
    "duplicate": _CanFaultType(
        "each frame is sent twice, because its sender sees the last bit wrong",
        verdict=FaultVerdict.DUPLICATED,
    ),
    "delay": _CanFaultType("each time a node sends, it is delayed by 10 ms"),
    "babble": _CanFaultType("a broken node sends 000# without a pause", rated=False),
    "short": _CanFaultType("the lines are shorted: no node can send", rated=False),
}


NARROWED: Final = ("drop", "corrupt", "duplicate", "delay")
"""Bus faults that can be limited to the frames of one node."""


class _ArmedFault(Copyable):
    """An armed fault of a bus, for all nodes or for one.

    Attributes:
        number: number of the node whose frames the fault hits, or None for all nodes.
        hits: whether the fault hits the planned frame, or None until a random number is drawn.
    """

    __slots__ = ("hits", "number", "tally", "threshold", "verdict")

    def __init__(
        self, verdict: FaultVerdict | None, number: int | None, arguments: FaultArguments
    ) -> None:
        self.verdict, self.number = verdict, number
        self.threshold, self.tally = threshold_of(arguments.rate), FaultTally(arguments.count)
        self.hits: bool | None = None

    def concerns(self, senders: Sequence[int]) -> bool:
        """Return whether the fault can hit frames of the nodes."""
        return self.number is None or self.number in senders


class CanFaults(Copyable):
    """The faults of one bus; each fault with a rate draws independently.

    One random number is drawn for each frame on the bus, and one random number each time a node
    sends. Every run is therefore the same. A fault of one node draws only for the frames of that
    node.

    Args:
        seed: seed of the random numbers.
        changed: function that is called with each fault that starts (True) or ends (False).

    Attributes:
        seed: seed of the random numbers. A new seed applies to later draws.
        fault_types: the faults that can be armed, by name.
        active: whether any fault is armed.
        place: a number that determines the position of the inverted bit.
        listeners: functions that are called with the time and each frame that no node receives
            because of a fault.
    """

    fault_types = CAN_FAULTS

    def __init__(self, seed: int, changed: Callable[[str, bool], None]) -> None:
        self.seed, self._changed = seed, changed
        self._armed: dict[str, _ArmedFault] = {}
        self._tallies: dict[str, FaultTally] = {}
        self._chances: dict[str, Chance] = {}
        self._planned: Sequence[int] | None = None
        self._hitting: _ArmedFault | None = None
        self.active, self.place = False, 0
        self.listeners: Listeners[Callable[[int, CanFrame], None]] = Listeners()

    @property
    def armed(self) -> tuple[str, ...]:
        """Names of the faults of the whole bus that are armed."""
        return tuple(name for name, one in self._armed.items() if one.number is None)

    def check(self, name: str, *arguments: str) -> None:
        """Raise ValueError unless the fault can be armed with these arguments."""
        bind_arguments(name, self.fault_types[name], arguments)

    def arm(self, name: str, *arguments: str, number: int | None = None) -> None:
        """Switch a fault on at the present time of the bus. It replaces a fault of the same name.

        Args:
            name: name of the fault.
            *arguments: texts after `NAME=`, split at commas.
            number: number of a node on the bus (`CanEnd.number`). The fault then hits only frames
                from this node. Only the faults in `NARROWED` can be limited to a node. With None
                the fault hits all frames of the bus.

        Raises:
            KeyError: no fault has this name.
            ValueError: an argument is unknown, or a value is out of range.
        """
        fault_type, key = self.fault_types[name], _key(name, number)
        bound = bind_arguments(name, fault_type, arguments)
        self.clear(name, number)
        armed = self._armed[key] = _ArmedFault(fault_type.verdict, number, bound)
        self._tallies[key] = armed.tally
        self.active = True
        self._changed(key, True)

    def clear(self, name: str, number: int | None = None) -> None:
        """Clear a fault; do nothing if the fault is not armed."""
        key = _key(name, number)
        if self._armed.pop(key, None) is not None:
            self.active = bool(self._armed)
            self._forget(self._planned or ())
            self._changed(key, False)

    def acted(self, name: str, number: int | None = None) -> int:
        """Return how often a fault has acted since it was last armed."""
        key = _key(name, number)
        return self._tallies[key].acted if key in self._tallies else 0

    def judge(self, senders: Sequence[int]) -> FaultVerdict:
        """Decide whether a fault hits the next frame on the bus, and which fault.

        The decision for this frame stays the same until `spend` is called.

        Args:
            senders: the nodes that send the frame, each as the number of its connection
                (`CanEnd.number`).

        Returns:
            What happens to the frame.
        """
        if self._planned is None:
            self.place = self.chance("place").draw()
        self._planned, self._hitting = senders, None
        for key, one in self._armed.items():
            if one.verdict is None or not one.concerns(senders):
                continue
            if one.hits is None:
                one.hits = self.chance(key).hit(one.threshold) and one.tally.left > 0
            if one.hits and self._hitting is None:
                self._hitting = one
        verdict = self._hitting and self._hitting.verdict
        return verdict or FaultVerdict.SENT

    def spend(self) -> None:
        """Record that the latest judged frame has been on the bus."""
        if self._hitting is not None:
            self._hitting.tally.allow()
        self._forget(self._planned or ())

    def _forget(self, senders: Sequence[int]) -> None:
        self._planned = self._hitting = None
        for one in self._armed.values():
            if one.concerns(senders):
                one.hits = None

    def delay_us(self, number: int) -> int:
        """Draw the delay of a node that sends."""
        for key, stream in (("delay", f"delay {number}"), (_key("delay", number),) * 2):
            one = self._armed.get(key)
            if one and self.chance(stream).hit(one.threshold) and one.tally.allow():
                return _DELAY_US
        return 0

    def chance(self, stream: str) -> Chance:
        """Return the random generator of a fault, which is made at the first call.

        Each name has an independent stream of numbers, which is the same in every run.
        """
        return self._chances.setdefault(stream, Chance(self.seed, stream))

    @property
    def drawn(self) -> bool:
        """Whether any random number was drawn."""
        return bool(self._chances)


def _key(name: str, number: int | None) -> str:
    return name if number is None else f"{name} of {number}"
