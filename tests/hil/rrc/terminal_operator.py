"""An operator at the terminal, who is told what to do and asked what happened."""

from __future__ import annotations

import select
import sys
from typing import Final

import pytest

from tickrig.host.rrc import RrcClient

POLL_US: Final = 10_000
SETTLE_US: Final = 200_000
"""From the operator's Enter to the last event that it caused."""

NO_INJECTION: Final = "cannot be injected on real hardware"


class Terminal:
    """Asks in spite of pytest's capture; the client goes on listening meanwhile."""

    def __init__(self, config: pytest.Config, client: RrcClient) -> None:
        self._capture = config.pluginmanager.getplugin("capturemanager")
        self._client = client

    def ask(self, text: str) -> str:
        """Show a text and return the line that is typed."""
        self._capture.suspend_global_capture(in_=True)
        try:
            sys.stdout.write(f"\n{text} ")
            sys.stdout.flush()
            while not select.select([sys.stdin], [], [], 0)[0]:
                self._client.run_for(POLL_US)
            line = sys.stdin.readline()
        finally:
            self._capture.resume_global_capture()
        if not line:
            pytest.exit("nobody is at the terminal (end of input)", returncode=1)
        return line.strip().lower()


class TerminalOperator:
    """Asks a human to be hands and eyes."""

    def __init__(self, terminal: Terminal, client: RrcClient, stick_pct: int) -> None:
        self._terminal, self._client, self._stick_pct = terminal, client, stick_pct
        self.said_no = False

    def press(self, button: str) -> None:
        self._tell(f"Press and release the {button.replace('_', ' ')} of the controller.")

    def hold_stick(self, v_pct: int, w_pct: int) -> None:
        text = f"Hold the stick at {_direction(v_pct, w_pct)}, and press Enter while you hold it."
        while not self._holds(v_pct, w_pct):
            self._terminal.ask(text)

    def cut_power(self) -> None:
        pytest.skip(f"a power cut of the RRC {NO_INJECTION}: its USB port would vanish")

    def make_fault(self, name: str, value: int = 1) -> None:
        pytest.skip(f"{name} {NO_INJECTION}")

    def switch_off(self) -> None:
        off = "Switch VR2 off with the power button, unless it is off, and wait until it is dark."
        self._tell(off)
        self._client.run_for(SETTLE_US)

    def sees_motion(self, v_pct: int, w_pct: int) -> bool:
        if v_pct == w_pct == 0:
            return self._sees("Do the motors stand still?")
        return self._sees(f"Do the motors drive {_direction(v_pct, w_pct)}?")

    def sees_error(self) -> bool:
        return self._sees("Does the controller's LED blink an error?")

    def hears_tones(self, times_us: tuple[int, ...]) -> bool:
        tones = ", ".join(f"{time_us / 1e6:g} s" for time_us in times_us)
        return self._sees(f"Did the buzzer sound like this (on, off, on, ...): {tones}?")

    def _tell(self, text: str) -> None:
        self._terminal.ask(f"{text} Then press Enter.")

    def _sees(self, question: str) -> bool:
        while (answer := self._terminal.ask(f"{question} [y/n]")) not in ("y", "n"):
            continue
        self.said_no |= answer == "n"
        return answer == "y"

    def _holds(self, v_pct: int, w_pct: int) -> bool:
        self._client.run_for(5 * POLL_US)
        latest = self._client.latest_status
        if latest is None:
            raise RuntimeError("the stick cannot be seen: switch status on first")
        off_pct = (abs(latest.value.in_v_pct - v_pct), abs(latest.value.in_w_pct - w_pct))
        return max(off_pct) <= self._stick_pct


def _direction(v_pct: int, w_pct: int) -> str:
    forward = f"{abs(v_pct)} % {'forward' if v_pct >= 0 else 'backward'}"
    return f"{forward} and {abs(w_pct)} % {'right' if w_pct >= 0 else 'left'}"
