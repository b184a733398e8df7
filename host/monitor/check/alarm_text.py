"""Alarms as lines of text."""

from __future__ import annotations

from typing import Final

from tickrig.host.monitor.check.alarms import Alarm, Alarms, State
from tickrig.host.monitor.frames.quantity import s_text

HEAD: Final = f"{'RULE':<20} {'STATE':<10} {'COUNT':>6} {'AGO':>8}  LATEST"

NO_FRAME: Final = "no frame"
"""The state of a rule that does not hold yet: nothing came."""


def render_alarms(alarms: Alarms, now_us: int) -> list[str]:
    """Return a line for each rule below a head, then the findings, the latest first."""
    lines = [HEAD, *(_line(alarm, now_us, alarms.judged) for alarm in alarms.rows())]
    found = [str(finding) for finding in reversed(alarms.findings)]
    return [*lines, "", f"FINDINGS, latest first: {len(found)}", *found]


def _line(alarm: Alarm, now_us: int, judged: bool) -> str:
    state, finding = str(alarm.state(now_us)), alarm.finding
    if state == State.HOLDS and not judged:
        state = NO_FRAME
    ago = "" if finding is None else f"{s_text(now_us - finding.at_us)} s"
    text = "" if finding is None else finding.text
    return f"{alarm.rule:<20} {state:<10} {alarm.count:>6} {ago:>8}  {text}".rstrip()
