"""A bench in virtual time: time passes only in waits, at no cost."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeVar

from tickrig._lazy import LazyModule
from tickrig.device.twin import twin
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.sim_waits import EPOCH_S, LOOK_US, HostLimit
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.errors import BenchError
from tickrig.emulators.testing.bench.modes.mode import Address, EmulatedMode
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount
from tickrig.emulators.testing.bench.tasks import DAY_US
from tickrig.emulators.testing.host_clock.host_code import (
    HostHangsError,
    HostTimeError,
    host_places,
)
from tickrig.emulators.testing.host_clock.patched_time import patched_time
from tickrig.emulators.testing.rig_file.plan import Tolerances
from tickrig.host.control.requests import Object
from tickrig.host.text.values import format_time
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    import can
    import canopen
    import serial

    from tickrig.emulators.can.outside import host, interface, sim_network
    from tickrig.host.links.link import Link
else:  # python-can and canopen are slow
    host = LazyModule("tickrig.emulators.can.outside.host")
    interface = LazyModule("tickrig.emulators.can.outside.interface")
    sim_network = LazyModule("tickrig.emulators.can.outside.sim_network")


# The time of a rig, for hosts that read a clock.

_LONGEST_US: Final = 3_600_000_000
"""Longest wait without a timeout: an hour."""


_PART_US: Final = 60_000_000
"""A wait counts as one minute at most, so a few long time-outs are no polling."""

_MOST_LOOKS: Final = 2_000_000
"""Largest number of reads of the clock between two calls of the test, and of waits that take no
time; they take some seconds."""

_MORE_LOOKS: Final = 1_000
"""After the error, until it is raised again."""

_MOST_GETS: Final = 1_000_000
"""Largest number of requests, such as `get`, at one instant; they take some seconds."""

_MOST_CAUGHT: Final = 100
"""How often a host may catch the error; then it gets one that `except Exception` does not catch."""


_CALLERS: Final = 4
"""Largest number of lines in the message that called the line that waits."""

_ENDLESS: Final = (
    "and the test has called neither run_for nor wait_until since. Give the loop a time-out, or"
    ' raise the limit: Bench(..., limit="7200s"), --bench-limit 7200s, or bench_limit in the'
    ' configuration file; "none" switches it off'
)


class _CaughtError(BaseException):
    """A host waits endlessly, and catches each `HostHangsError`."""


class _WaitLimit(HostLimit):
    """The time for which hosts may wait until the test advances the time itself.

    Only virtual time counts, so a repeated run ends at the same wait.

    Args:
        limit_us: the limit; `NEVER` for none.
        now_us: the present time.

    Attributes:
        limit_us: the limit.
        refused: text of the first error; empty if there was none.
    """

    def __init__(self, limit_us: int, now_us: int) -> None:
        self.limit_us, self.refused = limit_us, ""
        self._most_parts = -(-limit_us // _PART_US)
        self._requests, self._request_us = 0, now_us
        self._first_us = limit_us - (self._most_parts - 1) * _PART_US  # the shortest
        self.restart(now_us)

    def restart(self, now_us: int) -> None:
        """Count waits from zero again, because the test itself has advanced the time."""
        self._looks = self._caught = 0
        self._parts = self._most_parts
        self.due_us = now_us + self._first_us if self.limit_us < NEVER else NEVER

    def count(self, now_us: int, where: Callable[[], str] | None = None) -> None:
        """Count a wait of a host towards the limit.

        Args:
            now_us: present time in microseconds.
            where: function that returns file and line number of the waiting code, for the message.
                If it is None, this code is found in the call stack.

        Raises:
            HostHangsError: the limit is reached.
        """
        if self._parts <= 1:
            # What ends the test, such as a fixture, may wait a little.
            self.due_us = now_us + min(self.limit_us, _PART_US)
            waited = f"has waited for {format_time(self.limit_us)} s of virtual time"
            self._refuse(now_us, waited, where)
        self._parts -= 1
        due_us = self.due_us + _PART_US
        self.due_us = due_us if due_us > now_us else now_us + _PART_US

    def look(
        self, now_us: int, what: str = "read the clock", where: Callable[[], str] | None = None
    ) -> None:
        """Count a read of the clock by a host, or a wait that took no time.

        Virtual time does not advance at such a read or wait. A host that makes only such reads and
        waits would therefore run forever. The count ends it by an exception.

        Raises:
            HostHangsError: there were too many such reads and waits.
        """
        self._looks += 1
        if self._looks > _MOST_LOOKS and self.limit_us < NEVER:
            self._looks -= _MORE_LOOKS
            self._refuse(now_us, f"has {what} {_MOST_LOOKS} times", where)

    def count_request(self, now_us: int) -> None:
        """Count a request of the test to the bench, such as `get`.

        Raises:
            HostHangsError: there were too many requests at one instant of virtual time.
        """
        if now_us != self._request_us:
            self._requests, self._request_us = 0, now_us
        self._requests += 1
        if self._requests > _MOST_GETS and self.limit_us < NEVER:
            self._requests = 0
            self._refuse(now_us, f"has asked the bench {_MOST_GETS} times at one instant")

    def _refuse(self, now_us: int, what: str, where: Callable[[], str] | None = None) -> NoReturn:
        place, *callers = [where()] if where else host_places(sys._getframe()) or ["a host"]
        called = f", called from {', '.join(callers[:_CALLERS])}" if callers else ""
        place = place or "a host"
        text = f"{place}: the host {what}, up to {format_time(now_us)} s{called}, {_ENDLESS}"
        self.refused = self.refused or text
        self._caught += 1
        if self._caught > _MOST_CAUGHT:
            raise _CaughtError(self.refused)
        raise HostHangsError(text)


class RigPassing:
    """Advances the virtual time of a rig while a host waits in functions such as `time.sleep`.

    The class implements the protocol `Passing`. A function that the rig calls in the middle of a
    step may read the clock, but must not wait.

    Args:
        rig: rig that is advanced while a host waits.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    @property
    def time_s(self) -> float:
        """Seconds since 1970; the time of a rig begins with the year 2000."""
        return EPOCH_S + self._rig.now_us / 1e6

    def wait(self, done: Callable[[], bool], timeout_s: float | None) -> bool:
        """Advance the virtual time until `done()` is true; return False after the timeout.

        Args:
            done: function that returns whether the wait is over.
            timeout_s: longest wait in seconds. With None the wait ends when there are no more
                events, or after an hour.

        Raises:
            HostTimeError: the rig has called the method in the middle of a step.
            HostHangsError: the limit for waits is reached.
        """
        timeout_us = _LONGEST_US if timeout_s is None else max(0, round(timeout_s * 1e6))
        if not (rig := self._rig).in_step:
            limit = rig.host_limit
            if timeout_us <= LOOK_US:
                limit.look(rig.now_us)
            if rig.now_us >= limit.due_us:
                limit.count(rig.now_us)
            return rig.run_until(done, timeout_us)
        if timeout_us > LOOK_US:
            raise HostTimeError("what is called back while time passes cannot wait itself")
        return done()


_T = TypeVar("_T")


class _Offers:
    """The names offered to hosts; a snapshot withdraws names that were offered later."""

    def __init__(self) -> None:
        self._open: list[AbstractContextManager[object]] = []

    def enter(self, offer: AbstractContextManager[_T]) -> None:
        """Offer a name until it is withdrawn."""
        offer.__enter__()
        self._open.append(offer)

    def close(self, left: int = 0) -> None:
        """Withdraw all names except the first `left` names."""
        while len(self._open) > left:
            self._open.pop().__exit__(None, None, None)

    def way_back(self) -> Callable[[], None]:
        """Return a function that withdraws the names offered after this call."""
        return partial(self.close, len(self._open))


class _VirtualDoors:
    """The `_HostDoors` of a bench in virtual time.

    Args:
        rig: the rig.
    """

    def __init__(self, rig: BenchRig) -> None:
        self._rig, self._mounts = rig.rig, rig.state.mounts
        self._journal = rig.journal
        self._sides: dict[str, SerialSide] = {}
        self._addresses: dict[str, Address] = {}
        self._offers = _Offers()

    def link(self, wire: str) -> Link[Any]:
        """Connect a link."""
        mount = self._mounts[wire]
        if isinstance(mount, BusMount):
            return host.CanHost(self._rig, mount.open_end())
        return SimLink(self._rig, mount.line.b)

    def serial(self, wire: str, options: dict[str, Any]) -> serial.SerialBase:
        """Open a line by pyserial."""
        return SimSerial(self._side(wire), **{"port": wire, **options})

    def can_bus(self, wire: str, options: dict[str, Any]) -> can.BusABC:
        """Open a bus by python-can."""
        self._bus(wire)
        address = self.address(wire)
        assert not isinstance(address, str)
        return interface.TickrigBus(address["channel"], **options)

    def canopen_network(self, wire: str) -> canopen.Network:
        """Connect the canopen library to a bus."""
        return sim_network.SimNetwork(self._rig, self._bus(wire).open_end())

    def address(self, wire: str) -> Address:
        """Return the address at which a program can open a wire itself."""
        if wire not in self._addresses:
            self._addresses[wire] = self._offer(wire)
        return self._addresses[wire]

    def close(self) -> None:
        """Withdraw all names."""
        self._offers.close()

    def _offer(self, wire: str) -> Address:
        """Offer a wire under a unique name."""
        mount = self._mounts[wire]
        if isinstance(mount, LineMount):
            name = _free(wire, SERIAL_PORTS.names)
            self._offers.enter(SERIAL_PORTS.offer(name, self._side(wire)))
            return f"tickrig://{name}"
        name = _free(wire, interface.CHANNELS.names)
        self._offers.enter(interface.CHANNELS.offer(name, self._rig, mount.wire))
        return {"interface": "tickrig", "channel": name}

    def _side(self, wire: str) -> SerialSide:
        """Return the host's side of a line, for one host at a time."""
        mount = self._mounts[wire]
        if isinstance(mount, BusMount):
            raise ValueError(f"{wire} is a CAN bus, not a serial line")
        if wire not in self._sides:
            end = mount.line.b
            device = end.uart.setting if mount.settings.uart else None
            side = self._sides[wire] = SerialSide(self._rig, end, device)
            side.listeners.append(self._journal.of_settings(wire))
        return self._sides[wire]

    def _bus(self, wire: str) -> BusMount:
        mount = self._mounts[wire]
        if isinstance(mount, LineMount):
            raise ValueError(f"{wire} is a serial line, not a CAN bus")
        return mount


def _free(name: str, taken: tuple[str, ...]) -> str:
    """Return an unused name: the given one, or with a number appended.

    >>> _free("rrc", ("rrc", "rrc-2"))
    'rrc-3'
    """
    names = [name, *(f"{name}-{number}" for number in range(2, len(taken) + 3))]
    return next(each for each in names if each not in taken)


_LOOK_US: Final = 1_000
_LOOKS: Final = 10_000
"""Period for checking a condition in long waits. In short waits the period is a millisecond."""

_EXACT: Final = Tolerances(stick_pct=0, time_us=0)


class VirtualMode(EmulatedMode):
    """Mode of a bench of emulated devices in virtual time, which advances while the test waits.

    Args:
        rig: rig with the devices.
        limit_us: limit on the waits of hosts, in microseconds of virtual time, or `NEVER` for no
            limit. Whenever the test itself advances the time, the waits are counted from zero
            again.
    """

    name = "virtual"

    def __init__(self, rig: BenchRig, limit_us: int = NEVER) -> None:
        super().__init__(rig, _EXACT)
        self.doors, self._closed = _VirtualDoors(rig), False
        rig.rig.host_limit = self._limit = _WaitLimit(limit_us, rig.rig.now_us)

    @property
    def now_us(self) -> int:
        """The rig's time."""
        rig = self._rig.rig
        return rig.now_us if rig.acting_us is None else rig.acting_us

    def act(self, action: Callable[[BenchRig], _T]) -> _T:
        """Run a function on the rig between two ticks."""
        return action(self._rig)

    def request(self, do: str, **fields: object) -> Object:
        """Execute a request of the control socket; ValueError if it is refused."""
        self._limit.count_request(self._rig.rig.now_us)
        return super().request(do, **fields)

    def run_for(self, duration_us: int) -> None:
        """Advance the time."""
        self._check_open()
        self._rig.rig.run_for(duration_us)
        self._limit.restart(self._rig.rig.now_us)

    def wait_until(self, done: Callable[[], bool], within_us: int) -> bool:
        """Advance the virtual time until a condition is true; return False after the time-out.

        Without a time-out, the wait ends when there are no more events, or after a day. The
        condition is checked after each step, and periodically during long steps. The reason for the
        periodic check is that the condition may call a host that has work to do.
        """
        found = self._wait_until(done, within_us)
        self._limit.restart(self._rig.rig.now_us)
        return found

    def await_until(
        self, done: Callable[[], bool], within_us: int, where: Callable[[], str]
    ) -> bool:
        """Advance the time as `wait_until` does; it counts as a wait of a host."""
        rig = self._rig.rig
        before_us = rig.now_us
        if before_us >= self._limit.due_us:
            self._limit.count(before_us, where)
        found = self._wait_until(done, within_us)
        if rig.now_us == before_us:
            self._limit.look(before_us, "awaited 0 s", where)
        return found

    def _wait_until(self, done: Callable[[], bool], within_us: int) -> bool:
        self._check_open()
        rig = self._rig.rig
        for_ever = rig.now_us + within_us >= NEVER
        until_us = rig.now_us + (DAY_US if for_ever else within_us)
        look_us = max(_LOOK_US, (_LONGEST_US if for_ever else within_us) // _LOOKS)
        found = done()
        while not found:
            if rig.now_us >= until_us or (for_ever and rig.next_us == NEVER):
                return False  # time that nothing ends does not pass: the bench keeps its age
            found = rig.run_until(done, min(look_us, until_us - rig.now_us))
        return True

    def _check_open(self) -> None:
        if self._closed:
            raise BenchError("the bench is closed: no time passes")

    def patched_time(self) -> AbstractContextManager[object]:
        """Run hosts that read a clock in the rig's time; see `patched_time`."""
        return patched_time(RigPassing(self._rig.rig))

    def too_slow(self) -> str:
        """Return an empty text: virtual time is always kept."""
        return ""

    def hung(self) -> str:
        """Return an error message if a host has waited endlessly, otherwise ""."""
        return self._limit.refused

    def fork(self) -> VirtualMode:
        """Return a twin that continues independently, without hosts and triggers."""
        state = twin(self._rig.state)
        return VirtualMode(BenchRig(self._rig.name, state), self._limit.limit_us)

    def close(self) -> None:
        """Release all resources; time stops."""
        self._closed = True
        self.doors.close()
