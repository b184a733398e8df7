"""Run one device on a serial line for its command line."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, fields
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tickrig._lazy import LazyModule
from tickrig.emulators.bench.operator import Operator
from tickrig.emulators.bench.running_emulator import RunningEmulator, Transcript
from tickrig.emulators.commands.device_type import ConfiguredDevice, DeviceType
from tickrig.emulators.commands.run import EmulatorRun, RunOptions, mistakes_in
from tickrig.emulators.fields import check_needed
from tickrig.emulators.record.recorder import TraceFile
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.scenario import ScenarioParser, ScenarioPlayer, ScenarioStep
from tickrig.emulators.serial.emulator import Emulator, SerialHub
from tickrig.emulators.serial.network import NetworkPort, ServeUrl, parse_serve_url
from tickrig.host.cli.messages import Refused, refuse_path, refused_at, say
from tickrig.host.text.trace import Header

if TYPE_CHECKING:
    from tickrig.emulators.serial import pty_port
else:
    pty_port = LazyModule("tickrig.emulators.serial.pty_port")  # POSIX


@dataclass(frozen=True, slots=True, kw_only=True)
class _Options(RunOptions):
    """Common options of the command lines of all serial emulators (`line_options`)."""

    link: Path | None = None
    serve: tuple[str, ...] = ()
    panel: bool = False

    @property
    def in_real_time(self) -> bool:
        """Whether the run is in real time; a scenario alone runs in virtual time."""
        return not self.scenario or bool(self.link or self.serve or self.control or self.panel)


def run_device(device_type: DeviceType, options: Mapping[str, Any]) -> int:
    """Make a device from the options of its command, run it, and return the exit status.

    Args:
        device_type: type of the device.
        options: all options: options of the type and options of `line_options`.

    Raises:
        Refused: the options cannot be carried out.
    """
    names = {item.name for item in fields(_Options)}
    own = {name: value for name, value in options.items() if name not in names}
    shared = _Options(**{name: value for name, value in options.items() if name in names})
    try:
        check_needed(device_type.fields, own, own)
        configured = device_type.of_options(own, shared.seed)
    except ValueError as error:
        raise Refused(str(error)) from None
    with mistakes_in([configured.type.user_code]):
        return _SerialRun(configured, shared).run()


class _SerialRun(EmulatorRun[_Options]):
    """A run of a device on a serial line.

    Args:
        configured: device with its configuration.
        options: options of the command line.
    """

    def __init__(self, configured: ConfiguredDevice, options: _Options) -> None:
        super().__init__(options)
        self._type, self._device = configured.type, configured.device
        self._config = configured.config
        with refused_at("--serve"):
            self._urls = [parse_serve_url(url) for url in options.serve]
        self._places: list[str] = []
        self._emulator: Emulator | None = None

    def _make(self) -> tuple[Operator, ScenarioParser]:
        if self._options.panel:
            self._check_panel()
        device, line = self._device, self._type.line
        port = FaultyPort(line.wire(line.baud).a, line.faults)
        operator = Operator(device.inputs, device.tick_us, EventQueue(), port)
        encoders, senders = self._type.encoders, self._type.senders
        return operator, ScenarioParser(device, operator, encoders, senders=senders)

    def _check_panel(self) -> None:
        if self._options.scenario or self._options.verbose:
            raise Refused("--panel has the screen to itself: no --scenario and no --verbose")
        if self._type.panel is None:
            raise Refused(f"--panel: there is none for {self._type.title}")
        if find_spec("textual") is None:
            raise Refused("--panel needs Textual: pip install 'tickrig[tui]'")

    @property
    def _shows_warnings(self) -> bool:
        return not self._options.panel

    def _open(self, stack: ExitStack) -> Emulator:
        ports = self._open_ports(stack) if self._options.in_real_time else []
        for port in ports:
            passes = not isinstance(port, NetworkPort)
            port.watch_setting(self._type.line.baud, partial(self._show_setting, passes))
        self._emulator = Emulator(
            self._type.name,
            self._device,
            outside=SerialHub(ports) if ports else None,
            clock=self._clock if ports else None,
            seed=self._options.seed,
            trace=self._open_trace(),
            link=next(iter(self._places), ""),
            line=self._type.line,
        )
        return self._emulator

    def _open_ports(self, stack: ExitStack) -> list[pty_port.PtyPort | NetworkPort]:
        """Open the ports for hosts, with a pty if it is requested or if no other port is."""
        ports: list[pty_port.PtyPort | NetworkPort] = []
        if self._options.link or not self._urls:
            ports.append(self._open_pty(stack))
        ports += [self._serve(stack, url) for url in self._urls]
        return ports

    def _open_pty(self, stack: ExitStack) -> pty_port.PtyPort:
        try:
            pty = pty_port.PtyPort(self._options.link)
        except ModuleNotFoundError:
            raise Refused(
                "this system has no ptys: serve the line, as --serve rfc2217://7000"
            ) from None
        except OSError as error:
            refuse_path("link", error)
        stack.callback(pty.close)
        self._places.append(str(self._options.link or pty.path))
        return pty

    def _serve(self, stack: ExitStack, url: ServeUrl) -> NetworkPort:
        try:
            port = NetworkPort(url)
        except OSError as error:
            refuse_path("--serve", error)
        stack.callback(port.close)
        self._places.append(port.url)
        return port

    def _show_setting(self, passes: bool, setting: str) -> None:
        """Warn of different settings of host and device, which a pty hides and RFC 2217 shows."""
        if not self._options.panel and self._emulator is not None:
            own = self._emulator.line.b.uart.setting
            ends = "on a real line they would" if passes else "they do"
            differs = f"The host has set its port to {setting}, the device has {own}"
            say(f"{differs}: {ends} not understand each other.")

    def _open_trace(self) -> TraceFile | None:
        if self._options.trace is None:
            return None
        header = Header(self._type.name, {**self._config, "seed": self._options.seed})
        try:
            return TraceFile(self._options.trace, header)
        except OSError as error:
            refuse_path("trace", error)

    def _attend(
        self, bench: RunningEmulator, scenario: tuple[ScenarioStep, ...]
    ) -> ScenarioPlayer | None:
        options, everything = self._options, bool(self._options.scenario)
        if options.panel or not (everything or options.verbose):
            return None
        everything = everything or options.verbose > 1
        wanted = (lambda line: True) if everything else self._type.is_event
        transcript = Transcript(bench, click.echo, wanted)
        return ScenarioPlayer(bench, scenario, transcript, stays=options.in_real_time)

    def _go_on(self, bench: RunningEmulator) -> None:
        if self._options.panel and self._type.panel and isinstance(bench, Emulator):
            self._type.panel(bench)
            return
        super()._go_on(bench)

    def _greet(self, bench: RunningEmulator) -> None:
        if self._options.panel:
            return
        click.echo("\n".join(self._places))
        shown, baud = self._type, self._type.line.baud
        talk = shown.talk(bench.link, baud)
        say(f"{shown.title} at {', '.join(self._places)}, {baud} 8N1. Ctrl-C ends.{talk}")
        way = "--control PATH or --panel" if shown.panel else "--control PATH"
        self._say_how(f"Add {way} to press buttons and make faults.")
