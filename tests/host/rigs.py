"""What the host tests talk to: an RRC in virtual time, or a script."""

from __future__ import annotations

from dataclasses import dataclass, field

from tests.host.spy_link import SpyLink
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.rrc import OnRefusals, RrcClient


@dataclass
class Bench:
    """An RRC on a rig in virtual time, and a client on it."""

    rrc: Rrc
    rig: Rig
    link: SpyLink
    client: RrcClient

    def press_power(self) -> None:
        """Press and release the power button; takes 20 ms."""
        self.rrc.inputs.set("power_button", 1)
        self.rig.run_for(10_000)
        self.rrc.inputs.set("power_button", 0)
        self.rig.run_for(10_000)

    def state(self) -> int | str:
        return self.rrc.read("state")

    def out_pct(self) -> tuple[int | str, int | str]:
        return self.rrc.read("out_v_pct"), self.rrc.read("out_w_pct")


def powered_off_bench(
    *, max_refusals: int = 3, on_refusals: OnRefusals = OnRefusals.POWER_OFF
) -> Bench:
    """Return a bench with its client started, waiting for the power button."""
    line, rrc = SerialLine(), Rrc()
    rig = Rig(Station(rrc, line.a))
    link = SpyLink(SimLink(rig, line.b))
    client = RrcClient(link, max_refusals=max_refusals, on_refusals=on_refusals)
    client.start()
    link.sent.clear()
    return Bench(rrc, rig, link, client)


def standby_bench(
    *, stable: bool = False, max_refusals: int = 3, on_refusals: OnRefusals = OnRefusals.POWER_OFF
) -> Bench:
    """Return a bench with VR2 on and no event untaken."""
    bench = powered_off_bench(max_refusals=max_refusals, on_refusals=on_refusals)
    bench.press_power()
    bench.client.run_for(400_000)
    list(bench.client.events(0))
    if stable:
        bench.client.stablemode()
    bench.link.sent.clear()
    return bench


@dataclass
class ScriptedLink:
    """A link whose other end says what a script has for each line it hears.

    Attributes:
        answers: what comes back for a line, once; the last one stays.
        delay_us: how long an answer takes.
    """

    answers: dict[bytes, list[bytes]] = field(default_factory=dict)
    delay_us: int = 10_000
    now_us: int = 0
    sent: list[bytes] = field(default_factory=list)
    _coming: list[tuple[int, bytes]] = field(default_factory=list)

    def send(self, traffic: bytes, /) -> None:
        line = traffic.removesuffix(b"\n")
        self.sent.append(line)
        answers = self.answers.get(line, [])
        if answers:
            answer = answers.pop(0) if len(answers) > 1 else answers[0]
            self.comes(self.delay_us, answer)

    def comes(self, after_us: int, data: bytes) -> None:
        """Let bytes arrive in `after_us`."""
        self._coming.append((self.now_us + after_us, data))

    def receive(self, timeout_us: int, /) -> bytes:
        until_us = self.now_us + timeout_us
        at_us = min((at_us for at_us, _ in self._coming), default=until_us)
        self.now_us = max(self.now_us, min(until_us, at_us))
        data = b"".join(data for at_us, data in self._coming if at_us <= self.now_us)
        self._coming = [item for item in self._coming if item[0] > self.now_us]
        return data

    def close(self) -> None:
        """Nothing to close."""
