"""Rides beside `ClosedLoop`: a cart on a serial port, and virtual time held back."""

from __future__ import annotations

from functools import partial

from tickrig.host.control.clock import RealClock
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.motion.chain import MotionChain
from tickrig.host.motion.drive import BaseConnection
from tickrig.host.motion.geometry import Pose
from tickrig.host.rtc import Manager
from tickrig.host.rtc.execution.real_time import RealTime


class SerialBaseConnection:
    """A `BaseConnection` in real time, over a serial port: a base, or `rh3-emu`.

    Args:
        url: what DeviceFileName is set to; a path or a pyserial URL.
        baud: bit rate in bit/s.
    """

    def __init__(self, url: str, baud: int) -> None:
        self._manager = Manager()
        self._chain = MotionChain(self._manager, partial(SerialLink, baud=baud))
        self._chain.ref_hard.configuration.set("DeviceFileName", url)
        self._runner = RealTime(self._manager, RealClock())

    @property
    def chain(self) -> MotionChain:
        """Its components."""
        return self._chain

    @property
    def now_us(self) -> int:
        """Time since the start."""
        return self._manager.now_us

    @property
    def pose(self) -> Pose:
        """Where odometry takes it to be: nobody else knows."""
        return self._chain.odometry.pose

    def run_to(self, t_us: int) -> None:
        """Wait until it is so late, and run what is due meanwhile."""
        while self.now_us < t_us:
            self._runner.step()


class PacedBaseConnection:
    """A `BaseConnection` in virtual time that passes so many times as fast as the machine's.

    Args:
        connection: the one in virtual time.
        pace: 1 is real time.
    """

    def __init__(self, connection: BaseConnection, pace: float) -> None:
        self._connection, self._pace, self._clock = connection, pace, RealClock()

    @property
    def chain(self) -> MotionChain:
        """Its components."""
        return self._connection.chain

    @property
    def now_us(self) -> int:
        """The virtual time."""
        return self._connection.now_us

    @property
    def pose(self) -> Pose:
        """Where it truly is."""
        return self._connection.pose

    def run_to(self, t_us: int) -> None:
        """Go on to a virtual time when it has come."""
        self._clock.wait_until(round(t_us / self._pace))
        self._connection.run_to(t_us)
