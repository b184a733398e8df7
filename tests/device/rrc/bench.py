"""An RRC on the bench: lines in, lines out, one call a tick."""

from __future__ import annotations

from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.device.rrc.settings import RrcConfig


class RrcBench:
    """An RRC whose ticks are stepped one by one.

    Attributes:
        rrc: the device.
        tick: number of the latest tick.
    """

    def __init__(self, config: RrcConfig | None = None) -> None:
        self.rrc = Rrc(config or RrcConfig())
        self.tick = 0

    @property
    def state(self) -> str:
        return str(self.rrc.read("state"))

    def step(self, *lines: str, raw: bytes = b"") -> list[str]:
        """Run one tick; give it host lines (without LF) or raw bytes."""
        self.tick += 1
        rx = b"".join(line.encode("latin-1") + b"\n" for line in lines) + raw
        sent = self.rrc.tick(self.tick * TICK_US, rx)
        assert not sent or sent.endswith(b"\n")
        return sent.decode("ascii").splitlines()

    def run(self, ticks: int) -> list[str]:
        """Run ticks without traffic from the host."""
        return [line for _ in range(ticks) for line in self.step()]

    def set(self, **inputs: int) -> None:
        """Set physical inputs."""
        for name, value in inputs.items():
            self.rrc.inputs.set(name, value)

    def tap(self, button: str) -> list[str]:
        """Press a button for one tick, release it for one."""
        self.set(**{button: 1})
        lines = self.step()
        self.set(**{button: 0})
        return lines + self.step()

    def boot(self) -> RrcBench:
        """Go to WaitPowerOn."""
        self.step()
        return self

    def power_on(self) -> RrcBench:
        """Go to Standby, from anywhere before it."""
        if self.state == "Off":
            self.boot()
        self.tap("power_button")
        self.run(30)
        assert self.state == "Standby"
        return self

    def enter(self, state: str) -> RrcBench:
        """Go to a state from power-up on, with stablemode off."""
        match state:
            case "WaitPowerOn":
                self.boot()
            case "Standby":
                self.power_on()
            case "Limit":
                self.power_on().step("limit6464ffffff")
            case "Output":
                self.power_on().step("output0000")
            case "PowerOffByOthers":
                self.power_on().step("poweroff")
            case "PowerOffByButton":
                self.power_on().tap("power_button")
        assert self.state == state
        return self

    def align(self) -> None:
        """Go on so that the next tick is one in which a line is worked on in any state."""
        if self.tick % 2 == 0:
            self.step()
