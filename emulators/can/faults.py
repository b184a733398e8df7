"""Faults of a CAN bus: drop, corrupt, duplicate, delay, babble, short."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from tickrig.device.chance import Chance, threshold_of
from tickrig.device.twin import Part
from tickrig.emulators.rig.faults import FaultForm, FaultTally, bind_arguments

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
        "each frame is acknowledged and then taken by nobody, at this rate",
        verdict=FaultVerdict.DROPPED,
    ),
    "corrupt": CanFaultType(
        "a bit of each frame is turned over, at this rate", verdict=FaultVerdict.CORRUPTED
    ),
    "duplicate": CanFaultType(
        "each frame is sent again, its sender saw the last bit wrong, at this rate",
        verdict=FaultVerdict.DUPLICATED,
    ),
    "delay": CanFaultType("each time a node sends, it is held for 10 ms, at this rate"),
    "babble": CanFaultType("a broken node sends 000# without a pause", rated=False),
    "short": CanFaultType("the lines touch: nobody can send", rated=False),
}


class CanFaults(Part):
    """The faults of one bus; those with a rate have a chance of their own.

    Chance is drawn once for each frame on the bus, and once for each time a
    node sends, so it is the same in every run.

    Args:
        seed: seed of all chance in it.
        changed: called with each fault that begins (True) or ends (False).

    Attributes:
        seed: seed of all chance in it; a new one counts for what was not drawn yet.
        fault_types: the faults that can be armed, by name.
        active: whether any is armed.
        place: a number from which the place of a turned bit is taken.
    """

    fault_types = CAN_FAULTS

    def __init__(self, seed: int, changed: Callable[[str, bool], None]) -> None:
        self.seed, self._changed = seed, changed
        self._armed: dict[str, int] = {}
        self._tallies: dict[str, FaultTally] = {}
        self._chances: dict[str, Chance] = {}
        self._verdict: FaultVerdict | None = None
        self.active, self.place = False, 0

    @property
    def armed(self) -> tuple[str, ...]:
        """Names of the faults that are armed."""
        return tuple(self._armed)

    def check(self, name: str, *arguments: str) -> None:
        """Raise ValueError unless the fault can be armed like this."""
        bind_arguments(name, self.fault_types[name], arguments)

    def arm(self, name: str, *arguments: str) -> None:
        """Let a fault begin, at the time the bus has reached; one of the same name is replaced.

        Raises:
            KeyError: no fault has this name.
            ValueError: an argument that it does not take, or out of range.
        """
        bound = bind_arguments(name, self.fault_types[name], arguments)
        self.clear(name)
        self._armed[name] = threshold_of(bound.rate)
        self._tallies[name] = FaultTally(bound.count)
        self.active = True
        self._changed(name, True)

    def clear(self, name: str) -> None:
        """Let a fault end; clearing one that is not armed is no error."""
        if self._armed.pop(name, None) is not None:
            self._verdict, self.active = None, bool(self._armed)
            self._changed(name, False)

    def judge(self) -> FaultVerdict:
        """Say what becomes of the next frame on the bus; the same until `spend`."""
        if self._verdict is None:
            self._verdict = FaultVerdict.SENT
            for name in self._armed:
                verdict = self.fault_types[name].verdict
                if verdict and self._hits(name, name) and self._verdict is FaultVerdict.SENT:
                    self._verdict = verdict
            self.place = self._chance("place").draw()
        return self._verdict

    def spend(self) -> None:
        """Note that the frame judged last has been on the bus."""
        self._verdict = None

    def delay_us(self, number: int) -> int:
        """Draw how long a node that sends is held."""
        return _DELAY_US if "delay" in self._armed and self._hits("delay", f"delay {number}") else 0

    def _hits(self, name: str, stream: str) -> bool:
        hit = self._chance(stream).hit(self._armed[name])
        return hit and bool(self._tallies[name].allow())

    def acted(self, name: str) -> int:
        """Return how often a fault has acted since it was armed last."""
        return self._tallies[name].acted if name in self._tallies else 0

    def _chance(self, stream: str) -> Chance:
        return self._chances.setdefault(stream, Chance(self.seed, stream))

    @property
    def drawn(self) -> bool:
        """Whether anything was drawn by chance."""
        return bool(self._chances)
