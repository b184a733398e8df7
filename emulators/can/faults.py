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
"""How long a delayed node sends nothing."""


class FaultVerdict(Enum):
    """What becomes of a frame on the bus."""

    SENT = auto()
    DROPPED = auto()
    CORRUPTED = auto()
    DUPLICATED = auto()


@dataclass(frozen=True, slots=True)
class CanFaultType(FaultForm):
    """A fault that can be armed by name.

    Attributes:
        verdict: what it makes of a frame that it hits.
    """

    verdict: FaultVerdict | None = None


CAN_FAULTS: Final[Mapping[str, CanFaultType]] = {
    "drop": CanFaultType(
        "each frame is acknowledged, and received by no node",
        verdict=FaultVerdict.DROPPED,
    ),
    "corrupt": CanFaultType(
        "a bit of each frame is turned over: an error frame, and it is sent again",
        verdict=FaultVerdict.CORRUPTED,
    ),
    "duplicate": CanFaultType(
        "each frame is sent again, because its sender saw the last bit wrong",
        verdict=FaultVerdict.DUPLICATED,
    ),
    "delay": CanFaultType("each time a node sends, it is held for 10 ms"),
    "babble": CanFaultType("a broken node sends 000# without a pause", rated=False),
    "short": CanFaultType("the lines touch: no node can send", rated=False),
}


NARROWED: Final = ("drop", "corrupt", "duplicate", "delay")
"""Those of a bus that can hit the frames of one node alone."""


class _ArmedFault(Copyable):
    """A fault of a bus that is armed, for all nodes or for one.

    Attributes:
        number: of the node whose frames it hits; None for all.
        hits: whether it hits the frame that is planned; None until somebody asks.
    """

    __slots__ = ("hits", "number", "tally", "threshold", "verdict")

    def __init__(
        self, verdict: FaultVerdict | None, number: int | None, arguments: FaultArguments
    ) -> None:
        self.verdict, self.number = verdict, number
        self.threshold, self.tally = threshold_of(arguments.rate), FaultTally(arguments.count)
        self.hits: bool | None = None

    def concerns(self, senders: Sequence[int]) -> bool:
        """Say whether it can hit frames of these nodes."""
        return self.number is None or self.number in senders


class CanFaults(Copyable):
    """The faults of one bus; those with a rate have a chance of their own.

    Chance is drawn once for each frame on the bus, and once for each time a
    node sends, so it is the same in every run. A fault of one node draws for
    its frames alone.

    Args:
        seed: seed of all chance in it.
        changed: called with each fault that begins (True) or ends (False).

    Attributes:
        seed: seed of all chance in it; a new one counts for what was not drawn yet.
        fault_types: the faults that can be armed, by name.
        active: whether any is armed.
        place: a number from which the place of a turned bit is taken.
        listeners: called with the time and each frame that no node takes.
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
        """Raise ValueError unless the fault can be armed like this."""
        bind_arguments(name, self.fault_types[name], arguments)

    def arm(self, name: str, *arguments: str, number: int | None = None) -> None:
        """Let a fault begin, at the time the bus has reached; one of the same name is replaced.

        Args:
            name: which.
            *arguments: as people write them behind `NAME=`, split at commas.
            number: of the node's end whose frames alone it hits, for one of `NARROWED`.

        Raises:
            KeyError: no fault has this name.
            ValueError: an argument that it does not take, or out of range.
        """
        fault_type, key = self.fault_types[name], _key(name, number)
        bound = bind_arguments(name, fault_type, arguments)
        self.clear(name, number)
        armed = self._armed[key] = _ArmedFault(fault_type.verdict, number, bound)
        self._tallies[key] = armed.tally
        self.active = True
        self._changed(key, True)

    def clear(self, name: str, number: int | None = None) -> None:
        """Let a fault end; clearing one that is not armed is no error."""
        key = _key(name, number)
        if self._armed.pop(key, None) is not None:
            self.active = bool(self._armed)
            self._forget(self._planned or ())
            self._changed(key, False)

    def acted(self, name: str, number: int | None = None) -> int:
        """Return how often a fault has acted since it was armed last."""
        key = _key(name, number)
        return self._tallies[key].acted if key in self._tallies else 0

    def judge(self, senders: Sequence[int]) -> FaultVerdict:
        """Say what becomes of the next frame of these nodes; the same until `spend`."""
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
        """Note that the frame judged last has been on the bus."""
        if self._hitting is not None:
            self._hitting.tally.allow()
        self._forget(self._planned or ())

    def _forget(self, senders: Sequence[int]) -> None:
        self._planned = self._hitting = None
        for one in self._armed.values():
            if one.concerns(senders):
                one.hits = None

    def delay_us(self, number: int) -> int:
        """Draw how long a node that sends is held."""
        for key, stream in (("delay", f"delay {number}"), (_key("delay", number),) * 2):
            one = self._armed.get(key)
            if one and self.chance(stream).hit(one.threshold) and one.tally.allow():
                return _DELAY_US
        return 0

    def chance(self, stream: str) -> Chance:
        """Return the chance of a name; what it draws is the same in every run."""
        return self._chances.setdefault(stream, Chance(self.seed, stream))

    @property
    def drawn(self) -> bool:
        """Whether anything was drawn by chance."""
        return bool(self._chances)


def _key(name: str, number: int | None) -> str:
    return name if number is None else f"{name} of {number}"
