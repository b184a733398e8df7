"""Run a node on T-Kernel in real time for its command line."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.bench.running_emulator import keeping_time
from tickrig.emulators.tkernel import node_manager
from tickrig.emulators.tkernel.board import Board
from tickrig.emulators.tkernel.operated import Operated
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.engine_options import FORMAT, EngineOptions, take_engines
from tickrig.host.cli.messages import Refused, refused_at, say, time_us, warnings_shown
from tickrig.host.cli.start import load
from tickrig.host.control.clock import ServingClock
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.components import EXAMPLES
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.schedule import RealTime, Schedule
from tickrig.host.rtc.system.system import System, restore
from tickrig.host.rtc.system.system_file import read_system
from tickrig.host.rtc.ucode.http_source import HttpSource
from tickrig.host.rtc.ucode.infrared_rays_reader import OPEN_SERIAL

_JOIN_ENGINES: Final = "tickrig.host.rtc.engines.engines_joined:engines_joined"
_NAMES: Final = f"{node_manager.HOST}.host_cxt/%n.rtc"
"""Naming context of the components of the node in a name server."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _NodeOptions:
    """The options of `tkernel-emu`."""

    system: Path | None = None
    urg: str | None = None
    ucode: str | None = None
    service: str = ""
    control: Path | None = None
    board: Path | None = None
    limits: node_manager.NodeLimits
    faults: tuple[str, ...] = ()
    engines: EngineOptions


def run_node(connectors: int, message_octets: int, tick: str, boot: str, **options: Any) -> None:
    """Run the node of a command line; raise Refused if the options are invalid."""
    engines = take_engines(options)
    tick_us, boot_us = time_us("--tick", tick), time_us("--boot", boot)
    try:
        limits = node_manager.NodeLimits(
            connectors=connectors, message_octets=message_octets, tick_us=tick_us, boot_us=boot_us
        )
    except ValueError as error:
        raise Refused(str(error)) from None
    _NodeRun(_NodeOptions(limits=limits, engines=engines, **options)).run()


class _Door:
    """A server, opened by `serving_control`."""

    serve: Callable[[int], None] | None = None

    def close(self) -> None:
        """Close the server."""
        self.serve = None


class _Boot:
    """A boot for a control socket, with the runner of the system and its delays."""

    def __init__(self, runner: RealTime) -> None:
        self._runner, self.after_tick = runner, list[Callable[[int], None]]()

    def tick(self, now_us: int) -> None:
        """Callbacks after each tick."""
        for listener in tuple(self.after_tick):
            listener(now_us)

    @property
    def late_ticks(self) -> int:
        """Number of late ticks."""
        return self._runner.late_ticks

    @property
    def worst_late_us(self) -> int:
        """Largest delay of a tick."""
        return self._runner.worst_late_us

    def stop(self) -> None:
        """End the command."""
        self._runner.stop()


class _NodeRun:
    """A run of the command, in which the board may boot many times.

    Args:
        options: options of the command line.
    """

    def __init__(self, options: _NodeOptions) -> None:
        self._options = options
        self._system = System() if options.system is None else read_system(options.system)
        self._operator_door, self._system_door = _Door(), _Door()
        self._clock, schedule = ServingClock(), Schedule()
        self._clock.serve = self._serve
        self._runner = RealTime(schedule, self._clock)
        lines = node_manager.BoardLines(SerialLink, OPEN_SERIAL, HttpSource)
        self._lines, self._board = lines, Board(options.limits, self._start, lines)
        self._operated = Operated("tkernel-emu", self._board, self._runner.stop, self._lateness)
        with refused_at("--fault"):
            self._operated.plan(map(parse_fault_spec, options.faults))
        schedule.add_item(self._operated)
        schedule.add_item(self._board)

    def run(self) -> None:
        """Run the board until a request or Ctrl-C ends the run.

        Raises:
            Refused: the board cannot run these RT components, or a socket cannot be opened.
        """
        with warnings_shown(), ExitStack() as stack:
            stack.enter_context(stopped_by_signals(self._runner.stop))
            stack.callback(self._board.close)
            if path := self._options.board:
                stack.callback(self._operator_door.close)
                stack.enter_context(
                    serving_control(path, EmulatorControl(self._operated), self._operator_door)
                )
            boot_s = self._options.limits.boot_us / 1e6
            say(f"The node boots, {boot_s:g} s. Ctrl-C ends.")
            stack.enter_context(keeping_time())
            try:
                self._runner.run()
            except RtcRefused as error:
                raise Refused(f"the node cannot have this system: {error}") from None
        self._sum_up()

    def _start(self, manager: node_manager.NodeManager, stack: ExitStack) -> None:
        """Make the system of a booted board, and open its servers."""
        options = self._options
        for kind in EXAMPLES:
            manager.register(kind)
        manager.register(LrfCaptureUrg)
        restore(manager, self._system)
        if options.urg is not None:
            node_manager.add_range_finder(manager, self._lines, options.urg)
        if options.ucode is not None:
            node_manager.add_position_detection(
                manager, self._lines, options.ucode, options.service
            )
        self._open_doors(manager, stack)
        names = ", ".join(component.instance_name for component in manager.components) or "nothing"
        say(f"The node is up: {names}.")
        stack.callback(say, "The node is off.")

    def _open_doors(self, manager: node_manager.NodeManager, stack: ExitStack) -> None:
        """Serve the system's control socket and peers while the board runs."""
        stack.callback(self._system_door.close)
        attach: Callable[[CallQueue], object] = self._attach_alone
        if path := self._options.control:
            attach = self._open_control(path, manager, stack)
        engines = self._options.engines
        if engines.openrtm is not None and engines.openrtm.names == FORMAT:
            engines = replace(engines, openrtm=replace(engines.openrtm, names=_NAMES))
        if engines:
            join = load(_JOIN_ENGINES)
            stack.enter_context(join(engines, manager, attach, self._runner.stop))

    def _attach_alone(self, calls: CallQueue) -> None:
        self._system_door.serve = calls.serve

    def _open_control(
        self, path: Path, manager: node_manager.NodeManager, stack: ExitStack
    ) -> Callable[[CallQueue], None]:
        boot = _Boot(self._runner)
        control = SystemControl(manager, boot)
        server = stack.enter_context(serving_control(path, control, self._system_door))
        self._runner.after_tick.append(boot.tick)
        stack.callback(self._runner.after_tick.remove, boot.tick)
        return lambda calls: server.attach(calls, calls.make)

    def _serve(self, wait_us: int) -> None:
        """Serve requests of all servers; the board's server comes first and waits for the tick."""
        open_doors = [door.serve for door in (self._system_door, self._operator_door) if door.serve]
        for serve in open_doors[1:]:
            serve(0)
        if open_doors:
            open_doors[0](wait_us)
        else:
            time.sleep(max(0, wait_us) / 1e6)

    def _lateness(self) -> dict[str, object]:
        return {"late_ticks": self._runner.late_ticks, "late_us": self._runner.worst_late_us}

    def _sum_up(self) -> None:
        board, runner = self._board, self._runner
        refused = sum(board.read(name) for name in board.outputs if name.startswith("refused_"))
        worst = f" (up to {runner.worst_late_us / 1_000:.1f} ms)" if runner.late_ticks else ""
        say(
            f"boots: {board.boots}; refused by a limit: {refused};"
            f" late ticks: {runner.late_ticks}{worst}"
        )
