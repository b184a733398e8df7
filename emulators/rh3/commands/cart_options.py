"""Common parts of the verbs of `rh3`: options of a cart, and the end of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

import click

from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.urg.world import room
from tickrig.emulators.rh3.closed_loop import ClosedLoop, MountedUrg
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.host.cli.messages import Refused, SourceFailed, refuse_path
from tickrig.host.control.clock import RealClock
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import Manager
from tickrig.host.rtc.motion.chain import RATE_HZ, MotionChain
from tickrig.host.rtc.motion.drive import BaseConnection, start
from tickrig.host.rtc.motion.geometry import Pose, Wheels
from tickrig.host.rtc.motion.motion_run import MotionRun
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.schedule import RealTime

_SCANNER: Final = "LRFCapture_URG0"
"""The component of a range finder, if the cart has one."""


@dataclass(frozen=True, slots=True)
class MotionOptions:
    """The options that all verbs have.

    Attributes:
        set_id: name of the configuration set.
        device: serial port, or None for an emulated base in virtual time.
        baud: bit rate of the serial port in bit/s.
        any_device: whether to drive the device without a check of its type.
        pace: ratio of virtual time to real time, or None to run as fast as possible.
        conf: content of Odometry.conf.
        show_map: whether to draw the track during the run.
        base: parameters of the emulated base.
        plot: file for a picture.
        clock: clock for waiting, in real time and with a pace.
        room_m: width and depth of a room around the origin. If given, an emulated base carries a
            range finder.
    """

    set_id: str
    device: str | None
    baud: int
    pace: float | None
    conf: Path | None
    show_map: bool
    base: BaseParameters
    plot: Path | None = None
    clock: RealClock = field(default_factory=RealClock)
    room_m: tuple[float, float] | None = None
    any_device: bool = False

    def begin(self, wheels: Wheels | None = None) -> BaseConnection:
        """Return a cart at the origin with its components active."""
        connection = self._connection()
        try:
            if self.conf is not None:
                connection.chain.odometry.load(self.conf)
            if wheels is not None:
                connection.chain.odometry.calibrate(wheels)
        except RtcRefused as error:
            raise Refused(str(error)) from None
        except OSError as error:
            refuse_path("odometry-conf", error)
        start(connection, self.set_id)
        if connection.chain.in_error:
            raise SourceFailed(connection.chain.ref_hard.error_reason)
        return connection

    def _connection(self) -> BaseConnection:
        if self.device is not None:
            connection = _SerialBaseConnection(self.device, self.baud, self.clock)
            connection.chain.ref_hard.configuration.set("AnyDevice", str(int(self.any_device)))
            return connection
        world = room(*self.room_m) if self.room_m else None
        loop = ClosedLoop(self.base, world=world, pace=self.pace, clock=self.clock)
        for eye in loop.range_finders:
            _add_scanner(loop, eye)
        return loop


def _add_scanner(loop: ClosedLoop, eye: MountedUrg) -> None:
    """Write the scans of a range finder to a port."""
    scanner = LrfCaptureUrg(_SCANNER, lambda name: SimLink(loop.rig, eye.line.b))
    loop.manager.add(scanner, RATE_HZ)
    loop.manager.activate(_SCANNER)


class _SerialBaseConnection:
    """A `BaseConnection` in real time over a serial port, to a base or to `rh3-emu`.

    Args:
        url: value of DeviceFileName, which is a path or a pyserial URL.
        baud: bit rate in bit/s.
        clock: clock for waiting.

    Attributes:
        chain: components of the cart.
    """

    def __init__(self, url: str, baud: int, clock: RealClock | None = None) -> None:
        self._manager = Manager()
        self.chain = MotionChain(self._manager, partial(SerialLink, baud=baud))
        self.chain.ref_hard.configuration.set("DeviceFileName", url)
        self._runner = RealTime(self._manager, clock or RealClock())

    @property
    def now_us(self) -> int:
        """Time since the start."""
        return self._manager.now_us

    @property
    def pose(self) -> Pose:
        """Pose by odometry, because the true pose is unknown."""
        return self.chain.odometry.pose

    def run_to(self, t_us: int) -> None:
        """Wait until a time, and run everything due before it."""
        while self.now_us < t_us:
            self._runner.step()


def require_arrival(connection: BaseConnection, run: MotionRun) -> None:
    """End with a line and exit status 1 if the goal was not reached."""
    if connection.chain.in_error:
        raise click.ClickException(connection.chain.ref_hard.error_reason)
    if run.reached_s is None:
        raise click.ClickException(f"not there after {run.duration_s:.1f} s")
