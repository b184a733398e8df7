"""Ticks that a drive computes together, ahead of time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.slave import TICK_US
from tickrig.device.twin import Part

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.axis import Axis
    from tickrig.device.canopen.ds402.drive import Ds402
    from tickrig.device.servo.servo import Bounds, Line, RunAhead, Servo

_FEWEST: Final = 2
"""Smallest number of ticks that is worth computing together."""


class Stretch(Part):
    """Coming ticks, computed at once, in which a drive only continues a plain motion.

    Between two SYNCs a drive in csp does the same work each millisecond. If its rig allows it,
    the drive computes as many such ticks at once as the latest quiet period lasted. When a value
    is read, or when the next tick with work comes, the drive applies the ticks that have passed.
    The first tick in which anything else would happen is left to `on_execute`: a cut demand, a
    following error, standstill, a winding that is too hot, the end of the range. (32 drives in
    csp: 2.5 times as fast.)

    Args:
        drive: the drive.
        axis: the axis of the drive.
        servo: motor of the drive. Without a servo no ticks are computed ahead.
    """

    def __init__(self, drive: Ds402, axis: Axis, servo: Servo | None) -> None:
        self._drive, self._axis, self._servo = drive, axis, servo
        self._run: RunAhead | None = None
        self._began_us = self._requested_us = self._quiet_us = 0
        self._line: Line
        self._bounds: Bounds

    def plan(self, now_us: int, *, requested: bool) -> int:
        """Compute the ticks after the present tick in advance.

        The computation ends before the first tick in which anything happens besides the motion. The
        drive expects that requests come at equal intervals. Therefore the interval between the last
        two requests also limits the number of computed ticks.

        Args:
            now_us: time of the present tick.
            requested: whether a frame or an input caused the present tick. If false, the drive
                itself had scheduled the tick.

        Returns:
            The duration of the computed ticks in microseconds, or 0 if none were computed.
        """
        most, servo = self._most_us(now_us, requested=requested) // TICK_US, self._servo
        if most < _FEWEST or servo is None or not self._drive.goes_on_plainly:
            return 0
        line = self._drive.mode.ahead() if servo.is_plain else None
        if line is None:
            return 0
        axis = self._axis
        first, last = axis.unwrapped
        window = axis.settings.following_error_window
        hottest_dc = self._drive.supervision.bounds.winding_dc
        self._line, self._bounds = line, (first, last, window, axis.standstill, hottest_dc)
        run = servo.run_ahead(line, most, self._bounds)
        if run.steps < _FEWEST:
            return 0
        self._run, self._began_us = run, now_us
        return run.steps * TICK_US

    def catch_up(self) -> None:
        """Bring the drive to the state after the ticks up to now."""
        run, servo = self._run, self._servo
        if run is None or servo is None:
            return
        node = self._drive.node
        passed_us = node.now_us - TICK_US
        if node.horizon is not None and node.horizon.passed_us > passed_us:
            passed_us = node.horizon.passed_us
        steps = (passed_us - self._began_us) // TICK_US
        if steps >= run.steps:
            self._run = None
            self._take(servo, run)
        elif steps > 0:
            run.steps -= steps
            self._take(servo, servo.run_ahead(self._line, steps, self._bounds))

    @property
    def ahead(self) -> bool:
        """Whether there are computed ticks."""
        return self._run is not None

    def drop(self) -> None:
        """Discard the computed ticks, because something is about to change."""
        self.catch_up()
        self._run = None

    def _most_us(self, now_us: int, *, requested: bool) -> int:
        """Return the expected quiet time, estimated from the latest quiet time."""
        horizon = self._drive.node.horizon
        since_us = now_us - self._requested_us
        if requested:
            self._quiet_us, self._requested_us, since_us = since_us, now_us, 0
        if horizon is None or horizon.until_us <= now_us:
            return 0
        left_us = self._quiet_us - since_us
        return min(left_us - TICK_US if left_us > 0 else since_us, horizon.until_us - now_us)

    def _take(self, servo: Servo, run: RunAhead) -> None:
        """Apply the ticks of a run to the drive."""
        self._line.go_on(run.steps, run.demand)
        self._began_us += run.steps * TICK_US
        servo.follow(run)
        position, velocity = run.demand
        self._drive.skip(run.steps, self._began_us, position, velocity)
