"""An operator with hands in an emulator."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise

from tests.hil.rrc.lateness import Ask
from tests.hil.rrc.operator import PRESS_US
from tickrig.host.rrc import RrcClient

OFF_STATE = "WaitPowerOn"
ON_STATES = ("Standby", "Limit", "Output", "PowerOffByOthers")
"""Where one press leads to off; another might come so late that it leads to on again."""

SAMPLE_US = 10_000
EDGE_US = 50_000  # how far a sampled edge may be off


class EmulatorOperator:
    """Does and looks itself; while it takes its time the client goes on listening.

    Args:
        ask: asks the emulator, wherever it runs.
        client: the client.
        time_us: how long what it looks for may be late.
    """

    def __init__(self, ask: Ask, client: RrcClient, time_us: int = 0) -> None:
        self._ask, self._client, self._time_us = ask, client, time_us
        self.said_no = False

    def press(self, button: str) -> None:
        self._do("press", name=button, duration_us=PRESS_US)
        self._client.run_for(PRESS_US)
        self._wait_until(lambda: self._read(button) == 0)
        self._client.run_for(PRESS_US)

    def hold_stick(self, v_pct: int, w_pct: int) -> None:
        self._do("set", name="stick", value=[v_pct, w_pct])
        self._client.run_for(PRESS_US)

    def cut_power(self) -> None:
        self._do("set", name="rrc_power", value=0)
        self._client.run_for(PRESS_US)
        self._wait_until(lambda: self._read("state") == "Off")
        self._do("set", name="rrc_power", value=1)
        self._client.run_for(PRESS_US)

    def make_fault(self, name: str, value: int = 1) -> None:
        self._do("set", name=name, value=value)

    def switch_off(self) -> None:
        self._do("set", name="stick", value=[0, 0])
        while (state := self._read("state")) != OFF_STATE:
            if state in ON_STATES:
                self.press("power_button")
            while self._read("state") == state:
                self._client.run_for(SAMPLE_US)

    def sees_motion(self, v_pct: int, w_pct: int) -> bool:
        self._client.run_for(PRESS_US)
        return self._wait_until(
            lambda: (self._read("out_v_pct"), self._read("out_w_pct")) == (v_pct, w_pct)
        )

    def sees_error(self) -> bool:
        return self._wait_until(lambda: self._read("error_led") == 1)

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
            sounding = self._read("buzzer") == 1
            if sounding != (bool(edges) and edges[-1][1]):
                edges.append((self._client.now_us, sounding))
            self._client.run_for(SAMPLE_US)
        times_us = [until_us - duration_us, *(at_us for at_us, _ in edges), until_us]
        return [b - a for a, b in pairwise(times_us)][1:]

    def _wait_until(self, seen: Callable[[], bool]) -> bool:
        """Look again and again for as long as it may be late."""
        until_us = self._client.now_us + self._time_us
        while not seen():
            if self._client.now_us >= until_us:
                return False
            self._client.run_for(SAMPLE_US)
        return True

    def _read(self, name: str) -> object:
        values = self._do("get", names=[name])["values"]
        assert isinstance(values, dict)
        return values[name]

    def _do(self, do: str, **fields: object) -> Mapping[str, object]:
        answer = self._ask(do, **fields)
        assert answer["ok"], answer
        return answer
