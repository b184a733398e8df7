"""The search for home: which way to go, by what the switches say."""

from __future__ import annotations

from enum import Enum, auto
from typing import Final

from tickrig.device.canopen.ds402.modes.homing_methods import LIMIT, HomingMethod, Switch

BOTH_LIMITS: Final = Switch.NEGATIVE_LIMIT | Switch.POSITIVE_LIMIT


class Phase(Enum):
    """What the search is about."""

    SEEK = auto()  # fast, to where the switch is active
    LEAVE = auto()  # fast, back to the side from which the edge is approached
    APPROACH = auto()  # slowly, over the edge
    INDEX = auto()  # slowly, on to the index pulse
    FOUND = auto()
    FAILED = auto()


class HomingSearch:
    """Looks for the home of a method.

    The edge that counts is crossed slowly in every case: an axis that hits the
    switch in the search, or that a narrow switch does not give the room to brake,
    goes back first. So home is the same place from everywhere. An edge counts
    only while the axis moves as demanded.

    Attributes:
        phase: what it is about.
        direction: where to go, -1 or +1; 0 for nowhere.
    """

    def __init__(self, method: HomingMethod, switches: Switch) -> None:
        self._method, self._before = method, switches
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
        switch = self._method.switch or Switch(0)
        as_demanded = moving == self.direction
        crossed = as_demanded and bool(switch & (switches ^ before))
        self._follow(bool(switch & switches), crossed, crawling, as_demanded and index)
        if not self.ended and LIMIT[self.direction] & switches & ~switch:
            self._meet_limit()

    def _follow(self, active: bool, crossed: bool, crawling: bool, pulse: bool) -> None:
        method = self._method
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
        approach = self._method.approach
        self.direction = -approach if phase is Phase.LEAVE else approach

    def _behind_the_edge(self) -> Phase:
        return Phase.INDEX if self._method.by_index else Phase.FOUND

    def _meet_limit(self) -> None:
        """Turn round once, if the method does; give up otherwise."""
        turns = self._method.turns and self.direction == self._method.first
        if self.phase is Phase.SEEK and turns:
            self.direction = -self.direction
        else:
            self.phase = Phase.FAILED
