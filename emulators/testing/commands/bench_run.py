"""Run the bench of a rig file: at ptys, network doors and buses, or in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import click

from tickrig.emulators.bench.operator import Operator
from tickrig.emulators.bench.running_emulator import STATE, OutputWatch, RunningEmulator
from tickrig.emulators.commands.run import EmulatorRun, RunOptions, mistakes_in
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.scenario import ScenarioParser, ScenarioPlayer, ScenarioStep
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.emulators.testing.bench.bench_rig import BenchOperator, BenchRig, line_text
from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.emulators.testing.bench.modes.doors import OutsideEnds
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount, Mount
from tickrig.emulators.testing.bench.plan_parts import parts_of, rig_of
from tickrig.emulators.testing.commands import run_output
from tickrig.emulators.testing.rig_file.plan import RigFileError, RigPlan, bus_text, device_text
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.cli.messages import Refused, refuse_path, say
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import aligned

_ALONE: Final = "{wire}: no bus outside; [real.{wire}] with interface and channel joins one."
_NOWHERE: Final = "-"
_MISTAKES: Final = 2
_INTERRUPTED: Final = 130
"""Exit status after Ctrl-C in virtual time, if the run had a duration."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _BenchOptions(RunOptions):
    """The options of the command line.

    Attributes:
        virtual: whether to run in virtual time, as fast as possible.
        for_us: duration of the run in microseconds, or None to run until Ctrl-C.
        plots: signals to draw, one text for each diagram.
        files: files to draw to, or empty for the terminal.
        report: page of the run.
        command: the command that repeats the run.
    """

    virtual: bool = False
    for_us: int | None = None
    plots: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    report: Path | None = None
    command: tuple[str, ...] = ()

    @property
    def in_real_time(self) -> bool:
        """Whether the run is in real time, which is the default."""
        return not self.virtual

    @property
    def shows(self) -> bool:
        """Whether something is shown after the run, also after Ctrl-C."""
        return bool(self.plots or self.report)


def run_bench(
    file: Path, *, virtual: bool, control: Path | None, seed: int | None, **others: Any
) -> int:
    """Run the bench of a rig file for the command line, and return the exit status.

    Args:
        file: path of the rig file.
        virtual: whether to run in virtual time.
        control: path of the control socket, or None to use the path in the file.
        seed: seed of all random numbers, or None to use the seed in the file.
        others: other options, named as in `_BenchOptions`.

    Raises:
        Refused: the command line requests something impossible.
    """
    if virtual and others["for_us"] is None:
        raise Refused("--virtual wants a time: --for 10s")
    if virtual and control is not None:
        raise Refused("--control belongs to real time, not to --virtual")
    try:
        plan = read_rig_file(file)
    except RigFileError as error:
        say(str(error))
        return _MISTAKES
    except OSError as error:
        refuse_path("file", error)
    plan = plan if seed is None else replace(plan, seed=seed)
    control = None if virtual else control or plan.real.control
    command = _command(file, plan.seed, virtual=virtual, **others)
    options = _BenchOptions(virtual=virtual, control=control, command=command, **others)
    with mistakes_in(each.type for each in plan.devices.values()):
        return _BenchRun(plan, options).run()


def _command(
    file: Path,
    seed: int,
    *,
    virtual: bool,
    for_us: int | None,
    faults: tuple[str, ...],
    **others: object,
) -> tuple[str, ...]:
    """Return the command line that repeats a run."""
    words = ["tickrig", "run", str(file), *["--virtual"] * virtual]
    words += [] if for_us is None else ["--for", _span(for_us)]
    words += [word for fault in faults for word in ("--fault", fault)]
    return (*words, "--seed", str(seed))


def _span(us: int) -> str:
    """Return a duration as text for the option `--for`.

    >>> _span(3_000_000), _span(1_500)
    ('3s', '1500us')
    """
    return f"{us}us" if us % 1_000_000 else f"{us // 1_000_000}s"


class _BenchRun(EmulatorRun[_BenchOptions]):
    """A run of the bench.

    Args:
        plan: content of the rig file.
        options: options of the command line.
    """

    def __init__(self, plan: RigPlan, options: _BenchOptions) -> None:
        super().__init__(options)
        self._plan = plan
        self._outside: OutsideEnds | None = None
        self._mounts: list[Mount] = []
        self._is_over = False
        inputs = [plan.path] if plan.path else []
        written = [path for path in (*options.files, options.report, options.trace) if path]
        if twice := {str(path) for path in written if written.count(path) > 1}:
            raise Refused(f"{min(twice)}: the run writes this file twice; give another name")
        self._plots = run_output.RunPlots(options.plots, options.files, inputs)
        self._page = (
            run_output.RunPage(options.report, plan, options.command, inputs)
            if options.report
            else None
        )

    def _make(self) -> tuple[Operator, ScenarioParser]:
        try:
            self._parts = parts_of(self._plan)
        except ValueError as error:
            raise Refused(str(error)) from None
        device, faults = self._parts.assembly, self._parts.faults
        operator = BenchOperator(device, EventQueue(), faults)
        return operator, ScenarioParser(device, operator)

    def _open(self, stack: ExitStack) -> BenchRig:
        self._mounts = list(self._parts.mounts)
        if not self._options.virtual:
            self._outside = self._open_outside(stack)
            self._clock = self._outside.clock
        try:
            rig = rig_of(
                self._parts,
                self._plan,
                self._outside,
                trace=self._options.trace,
                keeps=self._page is not None and self._options.virtual,
            )
        except OSError as error:
            refuse_path("trace", error)
        if self._options.plots:
            self._plots.watch(rig)
        if self._page:
            self._page.watch(rig)
        return rig

    def _open_outside(self, stack: ExitStack) -> OutsideEnds:
        try:
            outside = OutsideEnds(self._mounts, self._plan.real)
        except PortGone as error:
            raise Refused(str(error)) from None
        except OSError as error:
            if error.filename is None:
                raise Refused(str(error)) from None
            refuse_path("link", error)
        stack.callback(outside.close)
        for mount in self._mounts:
            for port in outside.ports.get(mount.name, ()):
                if isinstance(mount, LineMount) and isinstance(port, PtyPort):
                    port.watch_setting(mount.settings.baud, _setting_shown(mount))
        return outside

    def _attend(
        self, bench: RunningEmulator, scenario: tuple[ScenarioStep, ...]
    ) -> ScenarioPlayer | None:
        options = self._options
        if options.for_us is not None:
            bench.event_queue.put(self, options.for_us, lambda now_us: self._end(bench))
        if options.verbose:
            everything = options.verbose > 1
            bench.log.listeners.append(lambda line: _show(line, everything=everything))
            states = (one for one in bench.device.outputs if one.rpartition("/")[2] == STATE)
            bench.after_step.append(OutputWatch(bench.device, click.echo, states))
        return None

    def _go_on(self, bench: RunningEmulator) -> None:
        super()._go_on(bench)
        if self._is_over and self._options.for_us is not None:
            bench.rig.run_to(self._options.for_us)  # with the ticks of that time

    @property
    def _ends_in_order(self) -> bool:
        return super()._ends_in_order or self._options.shows

    def _show(self, bench: RunningEmulator) -> None:
        if self._options.plots:
            self._plots.finish(bench.rig.now_us, Path(self._plan.path or "").name)
        if self._page:
            rows = map(self._row, self._mounts)
            self._page.finish(virtual=self._options.virtual, rows=rows, paths=self._plots.paths)

    def _sum_up(self, bench: RunningEmulator, player: ScenarioPlayer | None) -> int:
        status = super()._sum_up(bench, player)
        return _INTERRUPTED if self._stopped and self._options.virtual else status

    def _end(self, bench: RunningEmulator) -> None:
        self._is_over = True
        bench.stop()

    def _greet(self, bench: RunningEmulator) -> None:
        for line in aligned(self._row(mount) for mount in self._mounts):
            click.echo(line)
        say(f"{self._plan.path} in real time. Ctrl-C ends.")
        self._say_how("Add --control PATH to press buttons and make faults.")
        for mount in self._mounts:
            if isinstance(mount, BusMount) and self._place(mount) == _NOWHERE:
                say(_ALONE.format(wire=mount.name))

    def _row(self, mount: Mount) -> tuple[str, ...]:
        """Return the name, the place and the kind of a wire, and the devices on it."""
        devices = ", ".join(map(device_text, self._plan.devices_on(mount.name)))
        if isinstance(mount, BusMount):
            rate = f"{mount.wire.bit_rate} bit/s"
        else:
            rate = f"{mount.settings.baud} {self._plan.wires[mount.name].framing}"
        return mount.name, self._place(mount), rate, devices

    def _place(self, mount: Mount) -> str:
        """Return where hosts find a wire."""
        door = self._plan.real.doors.get(mount.name)
        if isinstance(mount, BusMount):
            bus = door.bus if door else None
            return bus_text(bus) if bus else _NOWHERE
        ports = self._outside.ports[mount.name] if self._outside else []
        pty = door.link if door and door.link else None
        return " ".join(
            str(pty or port.path) if isinstance(port, PtyPort) else str(port.url) for port in ports
        )


def _setting_shown(mount: LineMount) -> Callable[[str], None]:
    def show(setting: str) -> None:
        own = mount.line.b.uart.setting
        say(f"{mount.name}: the host has set its port to {setting}, not {own}.")

    return show


def _show(line: WireLine, *, everything: bool) -> None:
    """Print a line of the journal: an action, or with `everything` also traffic."""
    if everything or line.mark is Mark.PHYSICAL:
        click.echo(line_text(line))
