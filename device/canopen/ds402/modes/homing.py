"""Homing mode (CiA 402-2)."""

from __future__ import annotations

from enum import Enum, IntFlag, auto
from typing import Final, NamedTuple

from tickrig.device.canopen.ds402 import indices, trapezoid
from tickrig.device.canopen.ds402.modes.mode import DriveView, Mode, ModeBit
from tickrig.device.canopen.ds402.modes.profile_position import SLOWEST, STEEPEST
from tickrig.device.twin import Part

# The search for home: a table of the methods, and the direction by the switches (CiA 402-2).


class Switch(IntFlag):
    """The switches of an axis, by their bits in 60FDh."""

    NEGATIVE_LIMIT = 1
    POSITIVE_LIMIT = 2
    HOME = 4


class HomingMethod(NamedTuple):
    """A homing method of CiA 402: how the drive searches for home, and where home is.

    Directions are -1, +1, or 0 for a method without motion.

    Attributes:
        switch: switch whose edge is searched, or None if the method uses no switch.
        first: direction of the search while the switch is not active.
        approach: direction in which the axis finally crosses the edge and then searches for the
            index pulse.
        active: whether the switch is active after the edge, in the direction of `approach`.
        turns: whether the search reverses at the limit switch of its first direction.
        by_index: whether home is the next index pulse after the edge. Otherwise home is the edge
            itself.
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
"""Methods that end at an edge, as rows of `HomingMethod`.

The method whose number is 16 less continues to the index pulse.
"""

METHODS: Final[dict[int, HomingMethod]] = {
    **{number - 16: HomingMethod(*edge, by_index=True) for number, edge in _EDGES.items()},
    **{number: HomingMethod(*edge, by_index=False) for number, edge in _EDGES.items()},
    33: HomingMethod(None, -1, -1, active=False, turns=False, by_index=True),
    34: HomingMethod(None, +1, +1, active=False, turns=False, by_index=True),
    35: HomingMethod(None, 0, 0, active=False, turns=False, by_index=False),
    37: HomingMethod(None, 0, 0, active=False, turns=False, by_index=False),
}
"""Methods by number in 6098h. Methods 35 and 37 use the present position."""

_LIMIT: Final = {-1: Switch.NEGATIVE_LIMIT, 0: Switch(0), +1: Switch.POSITIVE_LIMIT}
"""The limit switch ahead, by direction."""

_BOTH_LIMITS: Final = Switch.NEGATIVE_LIMIT | Switch.POSITIVE_LIMIT


class Phase(Enum):
    """Phase of the search."""

    SEEK = auto()  # fast, to where the switch is active
    LEAVE = auto()  # fast, back to the side from which the edge is approached
    APPROACH = auto()  # slowly, over the edge
    INDEX = auto()  # slowly, on to the index pulse
    FOUND = auto()
    FAILED = auto()


class HomingSearch(Part):
    """The search for home with one homing method, advanced by one control step at a time.

    At the end of the search, the axis crosses the edge of the switch slowly and in the direction
    that the method prescribes. Therefore home is the same position from every start. If the axis
    crosses this edge at a higher speed, it moves back and crosses the edge again. It also moves
    back if it has met the switch from the wrong side. An edge counts only while the axis moves as
    demanded.

    Attributes:
        method: the homing method.
        phase: present phase of the search.
        direction: demanded direction of the motion: -1 or +1, or 0 to stop.
    """

    def __init__(self, method: HomingMethod, switches: Switch) -> None:
        self.method, self._before = method, switches
        self.direction = method.first
        self.phase = Phase.SEEK if method.switch else self._behind_the_edge()
        if not self.ended:
            self.step(switches, 0, crawling=True, index=False)

    @property
    def slow(self) -> bool:
        """Whether the axis moves at the speed of 6099h:02 instead of 6099h:01."""
        return self.phase in (Phase.APPROACH, Phase.INDEX)

    @property
    def ended(self) -> bool:
        """Whether home is found or cannot be found."""
        return self.phase in (Phase.FOUND, Phase.FAILED)

    def step(self, switches: Switch, moving: int, *, crawling: bool, index: bool) -> None:
        """Advance the search for the home position by one control step.

        Args:
            switches: switches that are active in this step.
            moving: sign of the demanded velocity.
            crawling: whether the demanded velocity is at most the slow speed of homing.
            index: whether the encoder has passed an index pulse since the last step.
        """
        before, self._before = self._before, switches
        wrong_limit = _LIMIT[-moving] & switches & ~before
        if switches & _BOTH_LIMITS == _BOTH_LIMITS or wrong_limit:
            self.phase = Phase.FAILED
            return
        switch = self.method.switch or Switch(0)
        as_demanded = moving == self.direction
        crossed = as_demanded and bool(switch & (switches ^ before))
        self._follow(bool(switch & switches), crossed, crawling, as_demanded and index)
        if not self.ended and _LIMIT[self.direction] & switches & ~switch:
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
        """Reverse once if the method allows it, else give up."""
        turns = self.method.turns and self.direction == self.method.first
        if self.phase is Phase.SEEK and turns:
            self.direction = -self.direction
        else:
            self.phase = Phase.FAILED


class _Stage(Enum):
    """Progress of a homing."""

    IDLE = auto()  # not started, or interrupted
    SEARCHING = auto()
    ATTAINED = auto()
    FAILED = auto()


_FLAGS: Final = {
    _Stage.IDLE: 0,
    _Stage.SEARCHING: 0,
    _Stage.ATTAINED: ModeBit.MODE_12,
    _Stage.FAILED: ModeBit.MODE_13,
}


class Homing(Mode):
    """Searches for the home position, assigns the position 607Ch to it, and returns to it.

    The axis brakes beyond the edge or index pulse that is home, and then returns to it: at the
    end 6064h equals 607Ch. An index pulse occurs each time the encoder has turned by its counts.
    The position of an index pulse is exact to the count; the position of an edge is exact to the
    distance that the axis moves in a tick. Halt and the falling edge of bit 4 end a homing in
    progress; a rising edge starts a new one. The result of a homing is valid until the next
    homing begins.

    Values of bits 13, 12 and 10:

    - 000: in progress
    - 001: not started or interrupted
    - 010: home is attained
    - 011: home is attained and the axis stands
    - 100: an error
    - 101: an error and the axis stands

    Not emulated: methods 15, 16, 31, 32, 36 and those of manufacturers; a time-out.
    """

    minds_limits = False

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self._path = trapezoid.PathFollower(self.reference)
        self._stage = _Stage.ATTAINED if self.axis.homed else _Stage.IDLE
        self._search: HomingSearch | None = None
        self._counts, self._velocity = self.axis.motor.counts, 0.0
        self._home: float | None = None

    def start(self) -> None:
        """Begin a homing."""
        method = METHODS.get(self.number(indices.HOMING_METHOD))
        self._counts, self._home = self.axis.motor.counts, None
        self.axis.homed = False
        self._end(_Stage.FAILED if method is None else _Stage.SEARCHING)
        if method is not None:
            self._search = HomingSearch(method, self._switches)

    def stop(self) -> None:
        """Interrupt a homing in progress."""
        if self._search is not None:
            self._end(_Stage.IDLE)

    def halt(self, now_us: int) -> bool:
        """Interrupt a homing in progress; brake according to 605Dh."""
        self.stop()
        self.flags = _FLAGS[self._stage]
        return super().halt(now_us)

    def run(self, now_us: int) -> bool:
        """Search; at the end brake, or move to the home position."""
        if self._search is not None:
            self._watch_switches(self._search)
        if self._search is not None:
            self._steer(self._search, trapezoid.began_us(now_us))
        elif not self._path.kept:
            self._path.begin(self._last_path(trapezoid.began_us(now_us)))
        ended = self._path.follow(now_us) and self._search is None
        self.flags = _FLAGS[self._stage]
        if ended and self.axis.stands:
            self.flags |= ModeBit.TARGET_REACHED
        return ended

    def _end(self, stage: _Stage) -> None:
        self._stage, self._search = stage, None
        self._path.leave()

    def _watch_switches(self, search: HomingSearch) -> None:
        """Update the search with the switches and the index pulse."""
        before, self._counts = self._counts, self.axis.motor.counts
        pulse = index_pulse(before, self._counts, self.axis.motor.counts_per_turn)
        velocity = self.reference.velocity * self.axis.forward
        if not search.ended:
            moving, crawling = (velocity > 0) - (velocity < 0), abs(velocity) <= self._speeds[1]
            search.step(self._switches, moving, crawling=crawling, index=pulse is not None)
        if search.phase is Phase.FOUND:
            method = search.method
            self._attain(method, self._counts if pulse is None or not method.by_index else pulse)
        elif search.phase is Phase.FAILED:
            self._end(_Stage.FAILED)

    def _attain(self, method: HomingMethod, counts: int) -> None:
        """Define counts as the home position."""
        self.axis.place_home(self.number(indices.HOME_OFFSET), counts)
        self._home = float(counts) if method.approach else None
        self._end(_Stage.ATTAINED)

    def _steer(self, search: HomingSearch, now_us: int) -> None:
        """Move in the direction of the search."""
        speed = self._speeds[search.slow]
        wanted = search.direction * self.axis.forward * speed
        if wanted != self._velocity or not self._path.kept:
            self._velocity = wanted
            self._path.begin(trapezoid.to_velocity(now_us, self._path.motion, wanted, self._limits))

    def _last_path(self, now_us: int) -> trapezoid.Path:
        if self._home is None:
            return trapezoid.to_velocity(now_us, self._path.motion, 0.0, self._limits)
        return trapezoid.to_position(now_us, self._path.motion, self._home, self._limits)

    @property
    def _switches(self) -> Switch:
        return Switch(self.drive.switches.word)

    @property
    def _speeds(self) -> tuple[float, float]:
        """Speeds of the search for a switch and for the home position, in counts per second."""
        settings = self.settings
        fast, slow = settings.homing_speeds
        return min(settings.max_velocity, fast), min(settings.max_velocity, slow)

    @property
    def _limits(self) -> trapezoid.PathLimits:
        acceleration = min(STEEPEST, self.settings.homing_acceleration)
        return trapezoid.PathLimits(max(SLOWEST, self._speeds[0]), acceleration, acceleration)


def index_pulse(before: int, after: int, per_turn: int) -> int | None:
    """Return the position of the first index pulse that the encoder passes in a motion, or None.

    Args:
        before: position at the start of the motion, in counts.
        after: position at the end of the motion, in counts.
        per_turn: number of counts from one index pulse to the next.

    >>> index_pulse(1990, 2010, 2000), index_pulse(2000, 2010, 2000), index_pulse(1, 0, 2000)
    (2000, None, 0)
    """
    if after > before:
        pulse = (before // per_turn + 1) * per_turn
        return pulse if pulse <= after else None
    pulse = (before - 1) // per_turn * per_turn
    return pulse if pulse >= after and after < before else None
