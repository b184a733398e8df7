"""Homing mode (CiA 402-2)."""

from __future__ import annotations

from enum import Enum, auto
from typing import Final

from tickrig.device.canopen.ds402.modes.homing_search import (
    METHODS,
    HomingMethod,
    HomingSearch,
    Phase,
    Switch,
)
from tickrig.device.canopen.ds402.modes.mode import DriveView, Mode
from tickrig.device.canopen.ds402.modes.profile_position import SLOWEST, STEEPEST
from tickrig.device.canopen.ds402.motion.path_follower import PathFollower, began_us
from tickrig.device.canopen.ds402.motion.trapezoid import Path, PathLimits, to_position, to_velocity
from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.state.automaton import Statusword


class Stage(Enum):
    """Where a homing is."""

    IDLE = auto()  # not begun, or interrupted
    SEARCHING = auto()
    ATTAINED = auto()
    FAILED = auto()


FLAGS: Final = {
    Stage.IDLE: Statusword(0),
    Stage.SEARCHING: Statusword(0),
    Stage.ATTAINED: Statusword.MODE_12,
    Stage.FAILED: Statusword.MODE_13,
}


class Homing(Mode):
    """Looks for the home position, calls it what 607Ch says, and goes back to it.

    The axis brakes beyond the edge or the index pulse that is home, and returns:
    in the end 6064h is 607Ch. An index pulse comes whenever the encoder has
    turned by its counts; it is found to the count, an edge to what the axis moves
    in a tick. Halt and the falling edge of bit 4 end a homing in progress; a
    rising edge begins anew. What a homing found holds until the next one begins.

    Bits 13, 12, 10: 000 in progress, 001 not begun or interrupted, 010 home is
    attained, 011 and the axis stands, 100 an error, 101 and the axis stands.

    Not emulated: methods 15, 16, 31, 32, 36 and those of manufacturers; a time-out.
    """

    minds_limits = False

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self._path = PathFollower(self.reference)
        self._stage = Stage.ATTAINED if self.axis.homed else Stage.IDLE
        self._search: HomingSearch | None = None
        self._counts, self._velocity = self.axis.motor.counts, 0.0
        self._home: float | None = None

    def start(self) -> None:
        """Begin a homing."""
        method = METHODS.get(self.number(indices.HOMING_METHOD))
        self._counts, self._home = self.axis.motor.counts, None
        self.axis.homed = False
        self._end(Stage.FAILED if method is None else Stage.SEARCHING)
        if method is not None:
            self._search = HomingSearch(method, self._switches)

    def stop(self) -> None:
        """Interrupt a homing in progress."""
        if self._search is not None:
            self._end(Stage.IDLE)

    def halt(self, now_us: int) -> bool:
        """Interrupt a homing in progress; brake as 605Dh says."""
        self.stop()
        self.flags = FLAGS[self._stage]
        return super().halt(now_us)

    def run(self, now_us: int) -> bool:
        """Search; at the end brake, or go to the home position."""
        if self._search is not None:
            self._watch_switches(self._search)
        if self._search is not None:
            self._steer(self._search, began_us(now_us))
        elif not self._path.kept:
            self._path.begin(self._last_path(began_us(now_us)))
        ended = self._path.follow(now_us) and self._search is None
        self.flags = FLAGS[self._stage]
        if ended and self.axis.stands:
            self.flags |= Statusword.TARGET_REACHED
        return ended

    def _end(self, stage: Stage) -> None:
        self._stage, self._search = stage, None
        self._path.leave()

    def _watch_switches(self, search: HomingSearch) -> None:
        """Look at switches and index pulse, and what follows from them."""
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
            self._end(Stage.FAILED)

    def _attain(self, method: HomingMethod, counts: int) -> None:
        """Take a place for the home position."""
        self.axis.place_home(self.number(indices.HOME_OFFSET), counts)
        self._home = float(counts) if method.approach else None
        self._end(Stage.ATTAINED)

    def _steer(self, search: HomingSearch, now_us: int) -> None:
        """Go where the search wants to go."""
        speed = self._speeds[search.slow]
        wanted = search.direction * self.axis.forward * speed
        if wanted != self._velocity or not self._path.kept:
            self._velocity = wanted
            self._path.begin(to_velocity(now_us, self._path.motion, wanted, self._limits))

    def _last_path(self, now_us: int) -> Path:
        if self._home is None:
            return to_velocity(now_us, self._path.motion, 0.0, self._limits)
        return to_position(now_us, self._path.motion, self._home, self._limits)

    @property
    def _switches(self) -> Switch:
        return Switch(self.drive.switches.word)

    @property
    def _speeds(self) -> tuple[float, float]:
        """Counts per second in the search for a switch, and for the home position."""
        settings = self.settings
        fast, slow = settings.homing_speeds
        return min(settings.max_velocity, fast), min(settings.max_velocity, slow)

    @property
    def _limits(self) -> PathLimits:
        acceleration = min(STEEPEST, self.settings.homing_acceleration)
        return PathLimits(max(SLOWEST, self._speeds[0]), acceleration, acceleration)


def index_pulse(before: int, after: int, per_turn: int) -> int | None:
    """Return the first index pulse on the way from some counts to others, None if there is none.

    >>> index_pulse(1990, 2010, 2000), index_pulse(2000, 2010, 2000), index_pulse(1, 0, 2000)
    (2000, None, 0)
    """
    if after > before:
        pulse = (before // per_turn + 1) * per_turn
        return pulse if pulse <= after else None
    pulse = (before - 1) // per_turn * per_turn
    return pulse if pulse >= after and after < before else None
