"""The search for home: the methods as a table, and which way to go by the switches (CiA 402-2)."""

from __future__ import annotations

from enum import Enum, IntFlag, auto
from typing import Final, NamedTuple

from tickrig.device.twin import Part


class Switch(IntFlag):
    """The switches of an axis, by their bits in 60FDh."""

    NEGATIVE_LIMIT = 1
    POSITIVE_LIMIT = 2
    HOME = 4


class HomingMethod(NamedTuple):
    """Where home is and how it is looked for.

    Attributes:
        switch: whose edge is looked for, None if no edge is.
        first: direction of the search when the switch is not active.
        approach: direction in which the edge, then the index pulse, is crossed at last.
        active: whether the switch is active behind the edge, seen in that direction.
        turns: whether the search turns round at the limit switch of its first direction.
        by_index: whether home is the next index pulse behind the edge.
    """

    switch: Switch | None
    first: int
    approach: int
    active: bool
    turns: bool
    by_index: bool


_NEGATIVE: Final = Switch.NEGATIVE_LIMIT
_POSITIVE: Final = Switch.POSITIVE_LIMIT
_HOME: Final = Switch.HOME

_EDGES: Final = {
    17: (_NEGATIVE, -1, +1, False, False),
    18: (_POSITIVE, +1, -1, False, False),
    19: (_HOME, +1, -1, False, False),
    20: (_HOME, +1, +1, True, False),
    21: (_HOME, -1, +1, False, False),
    22: (_HOME, -1, -1, True, False),
    23: (_HOME, +1, -1, False, True),
    24: (_HOME, +1, +1, True, True),
    25: (_HOME, +1, -1, True, True),
    26: (_HOME, +1, +1, False, True),
    27: (_HOME, -1, +1, False, True),
    28: (_HOME, -1, -1, True, True),
    29: (_HOME, -1, +1, True, True),
    30: (_HOME, -1, -1, False, True),
}
"""Methods that end at an edge, as rows of `HomingMethod`; 16 less goes on to the index pulse."""

METHODS: Final[dict[int, HomingMethod]] = {
    **{number - 16: HomingMethod(*edge, by_index=True) for number, edge in _EDGES.items()},
    **{number: HomingMethod(*edge, by_index=False) for number, edge in _EDGES.items()},
    33: HomingMethod(None, -1, -1, active=False, turns=False, by_index=True),
    34: HomingMethod(None, +1, +1, active=False, turns=False, by_index=True),
    35: HomingMethod(None, 0, 0, active=False, turns=False, by_index=False),
    37: HomingMethod(None, 0, 0, active=False, turns=False, by_index=False),
}
"""By the number in 6098h; 35 and 37 take the present position."""

LIMIT: Final = {-1: Switch.NEGATIVE_LIMIT, 0: Switch(0), +1: Switch.POSITIVE_LIMIT}
"""The limit switch ahead, by direction."""

BOTH_LIMITS: Final = Switch.NEGATIVE_LIMIT | Switch.POSITIVE_LIMIT


class Phase(Enum):
    """What the search is about."""

    SEEK = auto()  # fast, to where the switch is active
    LEAVE = auto()  # fast, back to the side from which the edge is approached
    APPROACH = auto()  # slowly, over the edge
    INDEX = auto()  # slowly, on to the index pulse
    FOUND = auto()
    FAILED = auto()


class HomingSearch(Part):
    """Looks for the home of a method.

    The edge that counts is crossed slowly in every case: an axis that hits the
    switch in the search, or that a narrow switch does not give the room to brake,
    goes back first. So home is the same place from everywhere. An edge counts
    only while the axis moves as demanded.

    Attributes:
        method: what is looked for.
        phase: what it is about.
        direction: where to go, -1 or +1; 0 for nowhere.
    """

    def __init__(self, method: HomingMethod, switches: Switch) -> None:
        self.method, self._before = method, switches
        self.direction = method.first
        self.phase = Phase.SEEK if method.switch else self._behind_the_edge()
        if not self.ended:
            self.step(switches, 0, crawling=True, index=False)

    @property
    def slow(self) -> bool:
        """Whether to go at the speed of 6099h:02 instead of 6099h:01."""
        return self.phase in (Phase.APPROACH, Phase.INDEX)

    @property
    def ended(self) -> bool:
        """Whether home is found or cannot be found."""
        return self.phase in (Phase.FOUND, Phase.FAILED)

    def step(self, switches: Switch, moving: int, *, crawling: bool, index: bool) -> None:
        """Look at the switches of one control step.

        Args:
            switches: those that are active.
            moving: sign of the demanded velocity.
            crawling: whether that is at most the slow speed.
            index: whether the index pulse came since the last step.
        """
        before, self._before = self._before, switches
        wrong_limit = LIMIT[-moving] & switches & ~before
        if switches & BOTH_LIMITS == BOTH_LIMITS or wrong_limit:
            self.phase = Phase.FAILED
            return
        switch = self.method.switch or Switch(0)
        as_demanded = moving == self.direction
        crossed = as_demanded and bool(switch & (switches ^ before))
        self._follow(bool(switch & switches), crossed, crawling, as_demanded and index)
        if not self.ended and LIMIT[self.direction] & switches & ~switch:
            self._meet_limit()

    def _follow(self, active: bool, crossed: bool, crawling: bool, pulse: bool) -> None:
        method = self.method
        match self.phase:
            case Phase.SEEK if active:
                self._turn(Phase.LEAVE if method.active else Phase.APPROACH)
            case Phase.LEAVE if crossed and active is not method.active:
                self._turn(Phase.APPROACH)
            case Phase.APPROACH if crossed and active is method.active and crawling:
                self.phase = self._behind_the_edge()
            case Phase.APPROACH if crossed and active is method.active:
                self._turn(Phase.LEAVE)
            case Phase.INDEX if pulse:
                self.phase = Phase.FOUND
            case _:  # on its way
                return

    def _turn(self, phase: Phase) -> None:
        self.phase = phase
        approach = self.method.approach
        self.direction = -approach if phase is Phase.LEAVE else approach

    def _behind_the_edge(self) -> Phase:
        return Phase.INDEX if self.method.by_index else Phase.FOUND

    def _meet_limit(self) -> None:
        """Turn round once, if the method does; give up otherwise."""
        turns = self.method.turns and self.direction == self.method.first
        if self.phase is Phase.SEEK and turns:
            self.direction = -self.direction
        else:
            self.phase = Phase.FAILED
