"""A bench in virtual time: waiting is free, and nothing passes unless somebody waits."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Final, TypeVar

from tickrig.device.twin import twin
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import BenchError
from tickrig.emulators.testing.bench.modes.emulated_mode import EmulatedMode
from tickrig.emulators.testing.bench.modes.mode import Address
from tickrig.emulators.testing.bench.modes.virtual_doors import LONGEST_US, RigPassing, VirtualDoors
from tickrig.emulators.testing.bench.tasks import DAY_US
from tickrig.emulators.testing.host_clock.patched_time import patched_time
from tickrig.emulators.testing.rig_file.plan import Tolerances
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    import can
    import canopen
    import serial

    from tickrig.host.links.link import Link

T = TypeVar("T")

_LOOK_US: Final = 1_000
_LOOKS: Final = 10_000
"""A condition is looked at each millisecond, in long waits so often."""

_EXACT: Final = Tolerances(stick_pct=0, time_us=0)


class VirtualMode(EmulatedMode):
    """A `BenchMode` whose time is that of its rig, stepped by whoever waits.

    Args:
        rig: the rig.
    """

    name = "virtual"

    def __init__(self, rig: BenchRig) -> None:
        super().__init__(rig, _EXACT)
        self._doors, self._closed = VirtualDoors(rig), False

    @property
    def now_us(self) -> int:
        """The rig's time."""
        rig = self._rig.rig
        return rig.now_us if rig.acting_us is None else rig.acting_us

    def act(self, action: Callable[[BenchRig], T]) -> T:
        """Do something to the rig between two ticks."""
        return action(self._rig)

    def run_for(self, duration_us: int) -> None:
        """Let time pass."""
        self._check_open()
        self._rig.rig.run_for(duration_us)

    def wait_until(self, done: Callable[[], bool], within_us: int) -> bool:
        """Let time pass until something is so; False if it was not in time.

        Without an end it is waited for until nothing happens any more, or for a day.
        It is looked at after each step, and now and then between: a host that is polled in it
        may have something to do.
        """
        self._check_open()
        rig = self._rig.rig
        for_ever = rig.now_us + within_us >= NEVER
        until_us = rig.now_us + (DAY_US if for_ever else within_us)
        look_us = max(_LOOK_US, (LONGEST_US if for_ever else within_us) // _LOOKS)
        found = done()
        while not found:
            if rig.now_us >= until_us or (for_ever and rig.next_us == NEVER):
                return False  # time that nothing ends does not pass: the bench keeps its age
            found = rig.run_until(done, min(look_us, until_us - rig.now_us))
        return True

    def _check_open(self) -> None:
        if self._closed:
            raise BenchError("the bench is closed: no time passes")

    def link(self, wire: str) -> Link[Any]:
        """Connect a host: bytes on a serial line, frames on a bus."""
        return self._doors.link(wire)

    def serial(self, wire: str, options: dict[str, Any]) -> serial.SerialBase:
        """Open a serial line by pyserial."""
        return self._doors.serial(wire, options)

    def can_bus(self, wire: str, options: dict[str, Any]) -> can.BusABC:
        """Open a bus by python-can."""
        return self._doors.can_bus(wire, options)

    def canopen_network(self, wire: str) -> canopen.Network:
        """Connect the canopen library to a bus."""
        return self._doors.canopen_network(wire)

    def address(self, wire: str) -> Address:
        """Return where a program opens a wire by itself."""
        return self._doors.address(wire)

    def patched_time(self) -> AbstractContextManager[object]:
        """Let hosts that look at a clock live in the rig's time; see `patched_time`."""
        return patched_time(RigPassing(self._rig.rig))

    def too_slow(self) -> str:
        """Say nothing: virtual time is always kept."""
        return ""

    def fork(self) -> VirtualMode:
        """Return a twin that goes on by itself from here; it has no hosts, no triggers."""
        return VirtualMode(BenchRig(self._rig.name, twin(self._rig.state)))

    def close(self) -> None:
        """Give everything back; no time passes any more."""
        self._closed = True
        self._doors.close()
