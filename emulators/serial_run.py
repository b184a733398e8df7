"""Run one device on a serial line as its command line asks: in real time, or a scenario."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from types import FrameType

import click

from tickrig.emulators.control import Control
from tickrig.emulators.control_server import ControlServer
from tickrig.emulators.emulated import Emulated
from tickrig.emulators.emulator import Emulator
from tickrig.emulators.fault_spec import FaultSpec, parse_fault_spec
from tickrig.emulators.player import Player
from tickrig.emulators.pty_port import PtyPort
from tickrig.emulators.recorder import TraceFile
from tickrig.emulators.refused import Refused, refuse_path
from tickrig.emulators.scenario import Encoder, Line, ScenarioParser
from tickrig.emulators.serving_clock import ServingClock
from tickrig.emulators.trace import Config, Header
from tickrig.emulators.transcript import Transcript
from tickrig.emulators.wire_log import WireLine


@dataclass(frozen=True, slots=True)
class Options:
    """What the command lines of all serial emulators share (`serial_options`)."""

    link: Path | None = None
    control: Path | None = None
    scenario: Path | None = None
    faults: tuple[str, ...] = ()
    seed: int = 0
    trace: Path | None = None
    verbose: int = 0
    panel: bool = False

    @property
    def in_real_time(self) -> bool:
        """A scenario alone runs in virtual time."""
        return not self.scenario or bool(self.link or self.control or self.panel)


@dataclass(frozen=True, slots=True)
class Kind:
    """What the command line of one kind of device adds.

    Attributes:
        name: as in traces.
        title: for people.
        encoders: further verbs of its scenarios.
        is_event: which lines -v shows.
        panel: runs the operator panel until it is left.
    """

    name: str
    title: str
    encoders: Mapping[str, Encoder] = field(default_factory=dict)
    is_event: Callable[[WireLine], bool] = lambda line: True
    panel: Callable[[Emulator], None] | None = None


class SerialRun:
    """One run.

    Args:
        kind: the kind of device.
        device: the device.
        config: its configuration, for the trace.
        options: the command line.
    """

    def __init__(
        self, kind: Kind, device: Emulated[bytes], config: Config, options: Options
    ) -> None:
        self._kind, self._device, self._config, self._options = kind, device, config, options
        self._clock = ServingClock()
        self._running: Emulator | None = None
        self._stopped = False

    def run(self) -> int:
        """Run, and return the exit status.

        Raises:
            Refused: the command line asks for something that cannot be done.
        """
        faults, scenario = self._checked()
        with ExitStack() as stack:
            if self._options.in_real_time:
                stack.enter_context(self._stopped_by_signals())
            emulator = self._running = self._open(stack)
            if self._options.in_real_time and not self._options.panel:
                self._greet(emulator)
            player = self._attend(emulator, scenario)
            for spec in faults:
                emulator.operator.fault(0, spec)
            self._go_on(emulator)
            if player:
                player.finish(emulator.rig.now_us)
        return self._sum_up(emulator, player)

    def _checked(self) -> tuple[list[FaultSpec], tuple[Line, ...]]:
        """Read all that can be wrong before anything is opened."""
        if self._options.panel:
            self._check_panel()
        rehearsal = Emulator(self._kind.name, self._device)
        try:
            faults = [parse_fault_spec(text) for text in self._options.faults]
            for spec in faults:
                rehearsal.operator.check_fault(spec)
            parser = ScenarioParser(self._device, rehearsal.operator, self._kind.encoders)
            return faults, parser.parse(*_read(self._options.scenario))
        except ValueError as error:
            raise Refused(str(error)) from None

    def _check_panel(self) -> None:
        if self._options.scenario or self._options.verbose:
            raise Refused("--panel has the screen to itself: no --scenario and no --verbose")
        if self._kind.panel is None:
            raise Refused(f"--panel: there is none for {self._kind.title}")
        if find_spec("textual") is None:
            raise Refused("--panel needs Textual: pip install 'tickrig[tui]'")

    def _open(self, stack: ExitStack) -> Emulator:
        """Open pty, trace and control socket; each is given back at the end."""
        options = self._options
        pty = self._open_pty(stack) if options.in_real_time else None
        emulator = Emulator(
            self._kind.name,
            self._device,
            outside=pty,
            clock=self._clock if pty else None,
            seed=options.seed,
            trace=self._open_trace(),
            link=str(options.link or pty.path) if pty else "",
        )
        stack.callback(emulator.close)
        if options.control:
            server = _open_control(options.control, emulator)
            stack.callback(server.close)
            self._clock.serve = server.serve
        return emulator

    def _open_pty(self, stack: ExitStack) -> PtyPort:
        try:
            pty = PtyPort(self._options.link)
        except FileExistsError as error:
            path = error.filename2
            raise Refused(f"link {path}: exists; remove it if no emulator uses it") from None
        except OSError as error:
            refuse_path("link", error)
        stack.callback(pty.close)
        return pty

    def _open_trace(self) -> TraceFile | None:
        if self._options.trace is None:
            return None
        header = Header(self._kind.name, {**self._config, "seed": self._options.seed})
        try:
            return TraceFile(self._options.trace, header)
        except OSError as error:
            refuse_path("trace", error)

    def _attend(self, emulator: Emulator, scenario: tuple[Line, ...]) -> Player | None:
        """Have the run written down as far as that is wanted."""
        options, everything = self._options, bool(self._options.scenario)
        if options.panel or not (everything or options.verbose):
            return None
        everything = everything or options.verbose > 1
        wanted = (lambda line: True) if everything else self._kind.is_event
        transcript = Transcript(emulator, click.echo, wanted)
        return Player(emulator, scenario, transcript, stays=options.in_real_time)

    def _go_on(self, emulator: Emulator) -> None:
        """Step until somebody stops it."""
        if self._options.panel and self._kind.panel:
            self._kind.panel(emulator)
            return
        while emulator.running and not self._stopped:
            emulator.step()

    @contextmanager
    def _stopped_by_signals(self) -> Iterator[None]:
        """Let Ctrl-C, SIGTERM and a closed terminal end the run after its tick."""

        def stop(number: int, frame: FrameType | None) -> None:
            self._stopped = True
            if self._running:
                self._running.stop()

        signals = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        before = {number: signal.signal(number, stop) for number in signals}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _greet(self, emulator: Emulator) -> None:
        click.echo(emulator.link)
        control = self._options.control
        _say(f"{self._kind.title} at {emulator.link}, 115200 8N1. Ctrl-C ends. Talk to it with")
        _say(f"  picocom -b 115200 --imap lfcrlf --omap crlf --echo {emulator.link}")
        _say(
            f"  tickrig ctl {control} describe"
            if control
            else "and add --control PATH or --panel to press buttons and make faults."
        )
        sys.stdout.flush()

    def _sum_up(self, emulator: Emulator, player: Player | None) -> int:
        """Say how it went; 1 if an expectation was not met."""
        rig = emulator.rig
        worst = f" (up to {rig.late_us / 1_000:.1f} ms)" if rig.late_steps else ""
        late = f"; late ticks: {rig.late_steps}{worst}" if self._options.in_real_time else ""
        _say(f"ran {rig.now_us / 1e6:.3f} s{late}; bytes lost: {emulator.lost_bytes}")
        if player is None or not player.met + player.missed:
            return 0
        _say(f"expectations met: {player.met}; missed: {player.missed}")
        return 1 if player.missed else 0


def _say(text: str) -> None:
    click.echo(text, err=True)


def _read(scenario: Path | None) -> tuple[str, str]:
    """Return the text of a scenario and what it is called."""
    if scenario is None:
        return "", ""
    try:
        text = sys.stdin.read() if str(scenario) == "-" else scenario.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise Refused(f"scenario {scenario}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        refuse_path("scenario", error)
    return text, str(scenario)


def _open_control(path: Path, emulator: Emulator) -> ControlServer:
    try:
        return ControlServer(path, Control(emulator))
    except OSError as error:
        refuse_path("control", error)
