"""The bench: an RRC, a client on it, and an operator beside it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass

import pytest

from tests.hil.emulator_operator import ControlHands, DirectHands, EmulatorOperator
from tests.hil.operator import Operator
from tests.hil.rig_file import RigFile
from tests.hil.terminal_operator import Terminal, TerminalOperator
from tests.host.live import live_rrc, pty
from tests.host.spy_link import SpyLink
from tickrig.device.rrc.config import RrcConfig
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.rig import Rig, Station
from tickrig.emulators.serial_line import SerialLine
from tickrig.emulators.sim_link import SimLink
from tickrig.host.rrc import RrcClient
from tickrig.host.serial_link import SerialLink
from tickrig.wire.rrc.replies import EventKind, StatusA

QUICK = RrcConfig(power_on_ticks=5, button_off_ticks=5)
"""An RRC that does not keep the real-time tests waiting."""

PATIENCE_US = 5_000_000
"""For what takes VR2 its time, 10 times what is expected."""


@dataclass
class Bench:
    """What a test body sees: the same on an emulator and on real hardware.

    Attributes:
        client: the client, started.
        link: what went over the line; lines can be spoilt here.
        operator: hands and eyes.
        stick_pct: how far a stick may be off.
        time_us: how far a time may be off.
        stable: whether stablemode is on.
    """

    client: RrcClient
    link: SpyLink
    operator: Operator
    stick_pct: int = 0
    time_us: int = 0
    stable: bool = False

    def switch_on(self) -> None:
        """Bring VR2 on."""
        self.operator.press("power_button")
        self.client.wait_for(EventKind.POWER_ON_SUCCESS, PATIENCE_US)

    def switch_off(self) -> None:
        """Bring VR2 off in the regular way."""
        self.operator.press("power_button")
        self.client.wait_for(EventKind.INITIALIZED, PATIENCE_US)

    def sent(self, sample: bytes, check: bytes) -> bool:
        """Whether this sample of the manual was sent, with CHECK if that is wanted."""
        line = sample + check if self.stable else sample
        return line.lower() in [sent.lower() for sent in self.link.lines]

    def status(self) -> StatusA:
        """Return a fresh status line."""
        self.client.run_for(30_000)
        latest = self.client.latest_status
        assert latest is not None
        assert self.client.now_us - latest.at_us <= 20_000 + self.time_us
        return latest.value

    def near(self, value_pct: int, wanted_pct: int) -> bool:
        """Whether a percentage is what was wanted, as far as a hand can hold a stick."""
        return abs(value_pct - wanted_pct) <= self.stick_pct

    def hang(self) -> None:
        """Let nothing reach the RRC any more."""
        self.link.spoil = lambda line: b""


@contextmanager
def sim_bench() -> Iterator[Bench]:
    """Put an emulated RRC into virtual time."""
    line, rrc = SerialLine(), Rrc()
    link = SpyLink(SimLink(Rig(Station(rrc, line.a)), line.b))
    with RrcClient(link) as client:
        client.start()
        yield Bench(client, link, EmulatorOperator(DirectHands(rrc), client))


@contextmanager
def pty_bench() -> Iterator[Bench]:
    """Put an emulated RRC into real time, on a pseudo-terminal."""
    with pty() as port, live_rrc(port, QUICK) as rrc:
        link = SpyLink(SerialLink(port.path))
        with RrcClient(link) as client:
            client.start()
            yield Bench(client, link, EmulatorOperator(rrc, client), time_us=100_000)


@contextmanager
def real_bench(rig: RigFile, config: pytest.Config) -> Iterator[Bench]:
    """Take the RRC that a rig file names; it is off before and after each test."""
    with ExitStack() as stack:
        link = SpyLink(SerialLink(rig.port))
        client = stack.enter_context(RrcClient(link))
        client.start()
        operator = _operator(rig, config, client, stack)
        operator.switch_off()
        client.start()
        if client.stable:
            client.stablemode(on=False)
        stack.callback(operator.switch_off)
        yield Bench(client, link, operator, rig.stick_pct, rig.time_us)
        link.spoil = lambda line: line


def _operator(rig: RigFile, config: pytest.Config, client: RrcClient, stack: ExitStack) -> Operator:
    if rig.control is None:
        return TerminalOperator(Terminal(config, client), client, rig.stick_pct)
    hands = stack.enter_context(closing(ControlHands(rig.control)))
    return EmulatorOperator(hands, client)
