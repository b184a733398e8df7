"""How well a cart drove, as lines of text."""

from __future__ import annotations

from collections.abc import Sequence

from tickrig.host.rtc.motion.chain import MotionChain
from tickrig.host.rtc.motion.components.omni_to_2wd import plan
from tickrig.host.rtc.motion.control_laws import VelocityLimits, steps
from tickrig.host.rtc.motion.drive import PERIOD_US
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.motion_run import MotionRun, least_time_s


def table(run: MotionRun, start: Pose, points: Sequence[Pose], limits: VelocityLimits) -> list[str]:
    """Return a line for each measure."""
    least_s, track = least_time_s(plan(start, points)), run.cross_track
    took_s = run.duration_s if run.reached_s is None else run.reached_s
    share = f", {took_s / least_s:.2f} x the least time" if least_s else ""
    lost = run.violations(limits)
    return [
        f"time         {took_s:.2f} s{share}",
        f"at the end   {run.error_m * 1e3:.1f} mm and {run.heading_error_rad:.4f} rad off the goal",
        f"cross-track  {track.rms * 1e3:.1f} mm rms, {track.most * 1e3:.1f} mm at most,"
        " on legs of 1 m and more",
        f"turning      {run.turning_rad_s:.2f} rad/s in all changes",
        f"limits       {f'{lost} commands beyond them' if lost else 'kept'}",
    ]


def limits_of(chain: MotionChain) -> VelocityLimits:
    """Return the limits that a chain is configured to keep."""
    follower = chain.path_follower
    dv, dw = steps(
        follower.max_acc_v.value,
        follower.max_acc_w.value,
        PERIOD_US / 1e6,
        follower.acc_cycle.value,
    )
    return VelocityLimits(follower.max_v.value, follower.max_w.value, dv, dw)
