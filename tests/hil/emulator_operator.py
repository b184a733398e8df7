"""An operator with hands in an emulator."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Protocol

from tests.hil.operator import PRESS_US
from tests.host.live import LiveRrc
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.control_client import ControlClient
from tickrig.host.rrc import RrcClient

OFF_STATE = "WaitPowerOn"
SAMPLE_US = 10_000
EDGE_US = 50_000  # how far a sampled edge may be off


class Hands(Protocol):
    """Reach into an emulator, wherever it runs."""

    def set(self, name: str, value: int) -> None:
        """Set a physical input."""

    def move_stick(self, v_pct: int, w_pct: int) -> None:
        """Set both axes of the stick, at once."""

    def read(self, name: str) -> int | str:
        """Read a physical output."""
        ...


class DirectHands:
    """Hands at a device in this thread."""

    def __init__(self, rrc: Rrc) -> None:
        self._rrc = rrc

    def set(self, name: str, value: int) -> None:
        self._rrc.inputs.set(name, value)

    def move_stick(self, v_pct: int, w_pct: int) -> None:
        self.set("stick_v_pct", v_pct)
        self.set("stick_w_pct", w_pct)

    def read(self, name: str) -> int | str:
        return self._rrc.read(name)


class ControlHands:
    """Hands at an emulator in another process, by its control socket."""

    def __init__(self, path: Path) -> None:
        self._control = ControlClient(path)

    def set(self, name: str, value: int) -> None:
        self._control.ask("set", name=name, value=value)

    def move_stick(self, v_pct: int, w_pct: int) -> None:
        self._control.ask("set", name="stick", value=[v_pct, w_pct])

    def read(self, name: str) -> int | str:
        values = self._control.ask("get", names=[name])["values"]
        assert isinstance(values, dict)
        value = values[name]
        assert isinstance(value, int | str)
        return value

    def close(self) -> None:
        self._control.close()


class EmulatorOperator:
    """Does and looks itself; while it takes its time the client goes on listening."""

    def __init__(self, hands: Hands | LiveRrc, client: RrcClient) -> None:
        self._hands, self._client = hands, client

    def press(self, button: str) -> None:
        self._hands.set(button, 1)
        self._client.run_for(PRESS_US)
        self._hands.set(button, 0)
        self._client.run_for(PRESS_US)

    def hold_stick(self, v_pct: int, w_pct: int) -> None:
        self._hands.move_stick(v_pct, w_pct)
        self._client.run_for(PRESS_US)

    def cut_power(self) -> None:
        self._hands.set("rrc_power", 0)
        self._client.run_for(PRESS_US)
        self._hands.set("rrc_power", 1)
        self._client.run_for(PRESS_US)

    def make_fault(self, name: str, value: int = 1) -> None:
        self._hands.set(name, value)

    def switch_off(self) -> None:
        self._hands.move_stick(0, 0)
        while (state := self._hands.read("state")) != OFF_STATE:
            if state != "PowerOffByButton":
                self.press("power_button")
            self._client.run_for(PRESS_US)

    def sees_motion(self, v_pct: int, w_pct: int) -> bool:
        self._client.run_for(PRESS_US)
        return (self._hands.read("out_v_pct"), self._hands.read("out_w_pct")) == (v_pct, w_pct)

    def sees_error(self) -> bool:
        return self._hands.read("error_led") == 1

    def hears_tones(self, times_us: tuple[int, ...]) -> bool:
        tones_us = self._listen(sum(times_us) + EDGE_US)[:-1]
        wanted_us = times_us[:-1]  # the last pause has no end
        return len(tones_us) == len(wanted_us) and all(
            abs(heard - wanted) <= EDGE_US
            for heard, wanted in zip(tones_us, wanted_us, strict=True)
        )

    def _listen(self, duration_us: int) -> list[int]:
        """Return how long the buzzer was on, off, on, ... from its first sound to the end."""
        edges: list[tuple[int, bool]] = []
        until_us = self._client.now_us + duration_us
        while self._client.now_us < until_us:
            sounding = self._hands.read("buzzer") == 1
            if sounding != (bool(edges) and edges[-1][1]):
                edges.append((self._client.now_us, sounding))
            self._client.run_for(SAMPLE_US)
        times_us = [until_us - duration_us, *(at_us for at_us, _ in edges), until_us]
        return [b - a for a, b in pairwise(times_us)][1:]
