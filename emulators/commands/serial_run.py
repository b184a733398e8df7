"""Run one device on a serial line as its command line asks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

import click

from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.bench.transcript import Transcript
from tickrig.emulators.commands.run import EmulatorRun, RunOptions
from tickrig.emulators.record.recorder import TraceFile
from tickrig.emulators.record.trace import Config, Header
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.scenario.player import Player
from tickrig.emulators.scenario.scenario import Encoder, Line, ScenarioParser, Sender
from tickrig.emulators.serial.emulator import Emulator, LineSettings
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.host.cli.messages import say
from tickrig.host.cli.refused import Refused, refuse_path


@dataclass(frozen=True, slots=True, kw_only=True)
class Options(RunOptions):
    """What the command lines of all serial emulators share (`line_options`)."""

    link: Path | None = None
    panel: bool = False

    @property
    def in_real_time(self) -> bool:
        """A scenario alone runs in virtual time."""
        return not self.scenario or bool(self.link or self.control or self.panel)


def by_miniterm(link: str, baud: int) -> str:
    """Say how to talk to a device of lines of text; miniterm comes with pyserial."""
    return f" Talk to it with\n  python -m serial.tools.miniterm --eol LF -e {link} {baud}"


@dataclass(frozen=True, slots=True)
class DeviceType:
    """What the command line of one kind of device adds.

    Attributes:
        name: as in traces.
        title: for people.
        encoders: further verbs of its scenarios.
        is_event: which lines -v shows.
        panel: runs the operator panel until it is left.
        senders: the verbs of its scenarios that send, where the line carries no text.
        line: baud rate, wire faults and the cutting of the log.
        talk: says how to talk to it at a path and a baud rate.
    """

    name: str
    title: str
    encoders: Mapping[str, Encoder] = field(default_factory=dict)
    is_event: Callable[[WireLine], bool] = lambda line: True
    panel: Callable[[Emulator], None] | None = None
    senders: Mapping[str, Sender] | None = None
    line: LineSettings = field(default_factory=LineSettings)
    talk: Callable[[str, int], str] = by_miniterm


class SerialRun(EmulatorRun):
    """One run.

    Args:
        kind: the kind of device.
        device: the device.
        config: its configuration, for the trace.
        options: the command line.
    """

    def __init__(
        self, kind: DeviceType, device: Emulated[bytes], config: Config, options: Options
    ) -> None:
        super().__init__(options, in_real_time=options.in_real_time)
        self._kind, self._device, self._config, self._options = kind, device, config, options

    def _rehearsal(self) -> tuple[RunningEmulator, ScenarioParser]:
        if self._options.panel:
            self._check_panel()
        kind = self._kind
        bench = Emulator(kind.name, self._device, line=kind.line)
        parser = ScenarioParser(self._device, bench.operator, kind.encoders, senders=kind.senders)
        return bench, parser

    def _check_panel(self) -> None:
        if self._options.scenario or self._options.verbose:
            raise Refused("--panel has the screen to itself: no --scenario and no --verbose")
        if self._kind.panel is None:
            raise Refused(f"--panel: there is none for {self._kind.title}")
        if find_spec("textual") is None:
            raise Refused("--panel needs Textual: pip install 'tickrig[tui]'")

    @property
    def _tells_warnings(self) -> bool:
        return not self._options.panel

    def _open(self, stack: ExitStack) -> Emulator:
        options = self._options
        pty = self._open_pty(stack) if options.in_real_time else None
        return Emulator(
            self._kind.name,
            self._device,
            outside=pty,
            clock=self._clock if pty else None,
            seed=options.seed,
            trace=self._open_trace(),
            link=str(options.link or pty.path) if pty else "",
            line=self._kind.line,
        )

    def _open_pty(self, stack: ExitStack) -> PtyPort:
        try:
            pty = PtyPort(self._options.link)
        except OSError as error:
            refuse_path("link", error)
        stack.callback(pty.close)
        pty.watch_setting(self._kind.line.baud, self._tell_setting)
        return pty

    def _tell_setting(self, setting: str) -> None:
        if not self._options.panel:
            own = f"{self._kind.line.baud} 8N1"
            say(
                f"The host has set its port to {setting}, the device has {own}:"
                " on a real line they would not understand each other."
            )

    def _open_trace(self) -> TraceFile | None:
        if self._options.trace is None:
            return None
        header = Header(self._kind.name, {**self._config, "seed": self._options.seed})
        try:
            return TraceFile(self._options.trace, header)
        except OSError as error:
            refuse_path("trace", error)

    def _attend(self, bench: RunningEmulator, scenario: tuple[Line, ...]) -> Player | None:
        options, everything = self._options, bool(self._options.scenario)
        if options.panel or not (everything or options.verbose):
            return None
        everything = everything or options.verbose > 1
        wanted = (lambda line: True) if everything else self._kind.is_event
        transcript = Transcript(bench, click.echo, wanted)
        return Player(bench, scenario, transcript, stays=options.in_real_time)

    def _go_on(self, bench: RunningEmulator) -> None:
        if self._options.panel and self._kind.panel and isinstance(bench, Emulator):
            self._kind.panel(bench)
            return
        super()._go_on(bench)

    def _greet(self, bench: RunningEmulator) -> None:
        if self._options.panel:
            return
        click.echo(bench.link)
        control = self._options.control
        kind, talk = self._kind, self._kind.talk(bench.link, self._kind.line.baud)
        say(f"{kind.title} at {bench.link}, {kind.line.baud} 8N1. Ctrl-C ends.{talk}")
        way = "--control PATH or --panel" if kind.panel else "--control PATH"
        say(
            f"  tickrig ctl {control} describe"
            if control
            else f"Add {way} to press buttons and make faults."
        )
