"""The bench: an RRC, a client on it, and an operator beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field

import pytest

from tests.hil.rrc.emulator_operator import EmulatorOperator
from tests.hil.rrc.lateness import EmulatorPace, Lateness, PacedLink, too_slow
from tests.hil.rrc.operator import Operator
from tests.hil.rrc.rig_file import RigFile
from tests.hil.rrc.terminal_operator import Terminal, TerminalOperator
from tests.host.live import live_rrc, pty
from tests.host.spy_link import SpyLink
from tickrig.device.rrc.config import RrcConfig
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.client import ControlClient
from tickrig.host.control.requests import VERSION
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rrc import RrcClient
from tickrig.wire.rrc.replies import RrcEvent, StatusA

QUICK = RrcConfig(power_on_ticks=5, button_off_ticks=5)
"""An RRC that does not keep the real-time tests waiting."""

TIME_US = 100_000
"""How far a time may be off in real time."""

PATIENCE_US = 5_000_000
"""For what takes VR2 its time, 10 times what is expected."""


@dataclass
class Bench:
    """What a test body sees: the same on an emulator and on real hardware.

    Attributes:
        client: the client; `begin` starts it.
        link: what went over the line; lines can be spoilt here.
        operator: hands and eyes.
        stick_pct: how far a stick may be off.
        time_us: how far a time may be off.
        fresh: the RRC has just got its power.
        parts: what may be late in real time.
        stable: whether stablemode is on.
        late: why no failure of the RRC counts, empty if it does; `look` looks.
    """

    client: RrcClient
    link: SpyLink
    operator: Operator
    stick_pct: int = 0
    time_us: int = 0
    fresh: bool = True
    parts: Mapping[str, Lateness] = field(default_factory=dict)
    stable: bool = False
    late: str = ""

    def begin(self) -> None:
        """Start the client; VR2 is off then."""
        self.client.start()
        if self.fresh:
            return
        self.operator.switch_off()
        self.client.start()
        if self.client.stable:
            self.client.stablemode(on=False)

    def look(self) -> str:
        """Return that the machine was too slow, if so; after `close` what was seen then."""
        if self.operator.said_no:
            return ""
        self.late = too_slow(self.parts) if self.parts else self.late
        return self.late

    def close(self) -> None:
        """Look for the last time."""
        self.look()
        self.parts = {}

    def switch_on(self) -> None:
        """Bring VR2 on."""
        self.operator.press("power_button")
        self.client.wait_for(RrcEvent.POWER_ON_SUCCESS, PATIENCE_US)

    def switch_off(self) -> None:
        """Bring VR2 off in the regular way."""
        self.operator.press("power_button")
        self.client.wait_for(RrcEvent.INITIALIZED, PATIENCE_US)

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
    emulator = Emulator("rrc", Rrc())
    control = EmulatorControl(emulator)
    link = SpyLink(SimLink(emulator.rig, emulator.host_end))
    with RrcClient(link) as client:
        operator = EmulatorOperator(
            lambda do, **fields: control.answer({"v": VERSION, "do": do, **fields}), client
        )
        yield Bench(client, link, operator)


@contextmanager
def pty_bench() -> Iterator[Bench]:
    """Put an emulated RRC into real time, on a pseudo-terminal."""
    with pty() as port, live_rrc(port, QUICK) as rrc:
        host = PacedLink(SerialLink(port.path))
        link = SpyLink(host)
        with RrcClient(link) as client:
            ask = host.beside(rrc.ask)
            operator = EmulatorOperator(ask, client, TIME_US)
            parts: dict[str, Lateness] = {"host": host, "emulator": EmulatorPace(ask)}
            yield Bench(client, link, operator, time_us=TIME_US, parts=parts)


@contextmanager
def real_bench(rig: RigFile, config: pytest.Config) -> Iterator[Bench]:
    """Take the RRC that a rig file names; it is off before and after each test."""
    with ExitStack() as stack:
        host = PacedLink(SerialLink(rig.port))
        link = SpyLink(host)
        client = stack.enter_context(RrcClient(link))
        parts: dict[str, Lateness] = {"host": host}
        operator: Operator
        if rig.control is None:
            operator = TerminalOperator(Terminal(config, client), client, rig.stick_pct)
        else:
            ask = host.beside(stack.enter_context(closing(ControlClient(rig.control))).request)
            parts["emulator"] = EmulatorPace(ask)
            operator = EmulatorOperator(ask, client, rig.time_us)
        stack.callback(operator.switch_off)
        yield Bench(client, link, operator, rig.stick_pct, rig.time_us, False, parts)
        link.spoil = lambda line: line
