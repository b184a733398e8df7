"""A VR2 wheelchair with an RRC, its client, and what a test does to both."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

from tests.host.spy_link import SpyLink
from tickrig import Bench
from tickrig.emulators.testing.bench.errors import OperatorRefused
from tickrig.host import RrcClient, RrcEvent
from tickrig.wire.rrc.replies import StatusA

PATIENCE_US: Final = 5_000_000
"""For what takes VR2 its time, 10 times what is expected."""

PRESS_US: Final = 30_000
"""How long a button is pressed: several periods of the RRC."""

SETTLE_US: Final = 200_000
"""From what an operator does to the last event that it causes."""

ASKED: Final = 3
"""So often a hand is asked to hold the stick right."""

SAMPLE_US: Final = 10_000
EDGE_US: Final = 50_000  # how far a sampled edge of a tone may be off

OFF_STATE: Final = "WaitPowerOn"
ON_STATES: Final = ("Standby", "Limit", "Output", "PowerOffByOthers")
"""Where one press leads to off; another might come so late that it leads to on again."""


class Chair:
    """What a test body sees: the same on an emulator and on real hardware.

    Attributes:
        bench: where it is.
        link: what went over the line; lines can be spoilt here.
        client: the client; it is started.
        stable: whether stablemode is on.
    """

    def __init__(self, bench: Bench) -> None:
        self.bench, self.stable = bench, False
        self.link = SpyLink(bench.link)
        self.client = RrcClient(self.link)
        bench.meanwhile(self.client.run_for)
        self.client.start()

    @property
    def late_us(self) -> int:
        """How far a time may be off."""
        return self.bench.tolerance.time_us

    def press(self, button: str) -> None:
        """Press a button and let it go."""
        self.bench.press(button, for_=PRESS_US)
        self.client.run_for(3 * PRESS_US)

    def hold_stick(self, v_pct: int, w_pct: int) -> None:
        """Move the stick (forward and right are positive) and hold it there.

        Raises:
            OperatorRefused: a hand holds it elsewhere, by the status that the RRC sends.
        """
        for _ in range(ASKED if self.bench.mode == "hardware" else 1):
            self.bench.set("stick", v_pct, w_pct)
            self.client.run_for(PRESS_US)
            told = self.client.latest_status
            if told is None or self.client.now_us - told.at_us > PRESS_US:
                return
            seen = told.value.in_v_pct, told.value.in_w_pct
            if self.near(seen[0], v_pct) and self.near(seen[1], w_pct):
                return
        within = f"within {self.bench.tolerance.stick_pct:g} %"
        text = f"the stick is held at {seen}, and not at {(v_pct, w_pct)} {within}"
        raise OperatorRefused(text) if self.bench.mode == "hardware" else AssertionError(text)

    def cut_power(self) -> None:
        """Take the RRC's power away for a moment."""
        self.bench.switch_off()
        self.client.run_for(PRESS_US)
        assert self.bench.observe("the RRC is off", lambda: self.bench.get("state") == "Off")
        self.bench.switch_on()
        self.client.run_for(PRESS_US)

    def switch_on(self) -> None:
        """Bring VR2 on."""
        self.press("power_button")
        self.client.wait_for(RrcEvent.POWER_ON_SUCCESS, PATIENCE_US)

    def switch_off(self) -> None:
        """Bring VR2 off in the regular way."""
        self.press("power_button")
        self.client.wait_for(RrcEvent.INITIALIZED, PATIENCE_US)

    def sees_motion(self, v_pct: int, w_pct: int) -> bool:
        """Whether the motors run like this, 0 and 0 for not at all."""
        self.client.run_for(PRESS_US)
        wanted = (v_pct, w_pct)
        return self.bench.observe(
            f"the motors drive {_direction(*wanted)}",
            lambda: (self.bench.get("out_v_pct"), self.bench.get("out_w_pct")) == wanted,
        )

    def sees_error(self) -> bool:
        """Whether the controller's LED blinks an error."""
        return self.bench.observe(
            "the controller's LED blinks an error", lambda: self.bench.get("error_led") == 1
        )

    def hears_tones(self, times_us: tuple[int, ...]) -> bool:
        """Whether the buzzer now sounds like this: on, off, on, ... times."""
        text = ", ".join(f"{time_us / 1e6:g} s" for time_us in times_us)
        return self.bench.observe(
            f"the buzzer sounds like this (on, off, on, ...): {text}",
            lambda: _alike(self._listen(sum(times_us) + EDGE_US)[:-1], times_us[:-1]),
        )

    def sent(self, sample: bytes, check: bytes) -> bool:
        """Whether this sample of the manual was sent, with CHECK if that is wanted."""
        line = sample + check if self.stable else sample
        return line.lower() in [sent.lower() for sent in self.link.lines]

    def status(self) -> StatusA:
        """Return a fresh status line."""
        self.client.run_for(30_000)
        latest = self.client.latest_status
        assert latest is not None
        assert self.client.now_us - latest.at_us <= 20_000 + self.late_us
        return latest.value

    def near(self, value_pct: int, wanted_pct: int) -> bool:
        """Whether a percentage is what was wanted, as far as a hand can hold a stick."""
        return abs(value_pct - wanted_pct) <= self.bench.tolerance.stick_pct

    def hang(self) -> None:
        """Let nothing reach the RRC any more."""
        self.link.spoil = lambda line: b""

    def leave(self) -> None:
        """Bring VR2 off, whatever state it is in: the next test begins there."""
        self.link.spoil = lambda line: line
        self.bench.perform(
            "switch VR2 off, unless it is off, and wait until it is dark", self._leave
        )
        self.client.run_for(SETTLE_US)

    def _leave(self) -> None:
        self.bench.set("stick", 0, 0)
        while (state := self.bench.get("state")) != OFF_STATE:
            if state in ON_STATES:
                self.press("power_button")
            while self.bench.get("state") == state:
                self.client.run_for(SAMPLE_US)

    def _listen(self, duration_us: int) -> list[int]:
        """Return how long the buzzer was on, off, on, ... from its first sound to the end.

        The buzzer is looked at, and its times are taken, by the host: in virtual time to the
        sample, in real time as late as the host is. A human is asked instead.
        """
        edges: list[tuple[int, bool]] = []
        until_us = self.client.now_us + duration_us
        while self.client.now_us < until_us:
            sounding = self.bench.get("buzzer") == 1
            if sounding != (bool(edges) and edges[-1][1]):
                edges.append((self.client.now_us, sounding))
            self.client.run_for(SAMPLE_US)
        times_us = [until_us - duration_us, *(at_us for at_us, _ in edges), until_us]
        return [b - a for a, b in pairwise(times_us)][1:]


def _alike(heard_us: list[int], wanted_us: tuple[int, ...]) -> bool:
    """Whether tones are those that were wanted; the last pause has no end."""
    return len(heard_us) == len(wanted_us) and all(
        abs(heard - wanted) <= EDGE_US for heard, wanted in zip(heard_us, wanted_us, strict=True)
    )


def _direction(v_pct: int, w_pct: int) -> str:
    forward = f"{abs(v_pct)} % {'forward' if v_pct >= 0 else 'backward'}"
    return f"{forward} and {abs(w_pct)} % {'right' if w_pct >= 0 else 'left'}"
