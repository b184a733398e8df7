"""A device that is switched by commands."""

from __future__ import annotations

import subprocess
from typing import Final

from tickrig.emulators.testing.bench.errors import BenchBlocked
from tickrig.emulators.testing.rig_file.plan import PowerPlan

SWITCH_S: Final = 30.0
"""A command that takes longer is ended."""


class PowerSwitch:
    """Switches a device by the commands of a rig file.

    Args:
        device: name of the device.
        plan: the commands.
    """

    def __init__(self, device: str, plan: PowerPlan) -> None:
        self._device, self._plan = device, plan

    def switch(self, *, on: bool) -> None:
        """Give or take the supply.

        Raises:
            BenchBlocked: the command cannot be run, failed, or did not end.
        """
        command = self._plan.on if on else self._plan.off
        try:
            done = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=SWITCH_S,
                check=False,
            )
        except OSError as error:
            raise self._blocked(on, error.strerror or str(error)) from None
        except subprocess.TimeoutExpired:
            raise self._blocked(on, f"has not ended after {SWITCH_S:g} s") from None
        if done.returncode:
            said = done.stderr.decode("utf-8", "replace").strip().split("\n")[-1]
            raise self._blocked(on, f"exit status {done.returncode}{said and f': {said}'}")

    def _blocked(self, on: bool, why: str) -> BenchBlocked:
        state, command = ("on", self._plan.on) if on else ("off", self._plan.off)
        return BenchBlocked(f"{self._device} was not switched {state}: {' '.join(command)}: {why}")
