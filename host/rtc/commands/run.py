"""Running a system of RT components in real time, as a command line requires."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.engine_options import EngineOptions, take_engines
from tickrig.host.cli.messages import Refused, say, time_us, warnings_shown
from tickrig.host.cli.start import load
from tickrig.host.control.clock import ServingClock
from tickrig.host.rtc.commands.console import Console
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.components import EXAMPLES
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.schedule import RealTime
from tickrig.host.rtc.system.system import System, restore, with_remotes
from tickrig.host.rtc.system.system_file import check_system, file_format, read_system, write_system
from tickrig.host.text.user_file import explain_error, find_class

_ATTACH_LITE: Final = "tickrig.host.rtc.lite.attachment:attach_lite"
"""Function loaded by its path, as a command is, because that folder uses components of this one."""
_JOIN_ENGINES: Final = "tickrig.host.rtc.engines.engines_joined:engines_joined"
"""Function that is also loaded by its path."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _SystemOptions:
    """The options of `tickrig rtc run`."""

    system: Path | None = None
    control: Path
    components: tuple[str, ...] = ()
    lites: tuple[str, ...] = ()
    lite_boot_us: int = 0
    rate_hz: float | None = None
    save: Path | None = None
    console: bool = False
    engines: EngineOptions = field(default_factory=EngineOptions)


def run_system(lite_boot: str, **given: Any) -> None:
    """Run a system of RT components in real time until it is stopped (command `tickrig rtc run`).

    Raises:
        Refused: the command line is invalid.
    """
    engines, boot_us = take_engines(given), time_us("--lite-boot", lite_boot)
    options = _SystemOptions(lite_boot_us=boot_us, engines=engines, **given)
    system = System() if options.system is None else read_system(options.system)
    if options.save is not None:
        check_system(options.save)
    manager = Manager()
    for kind in (*EXAMPLES, *map(_find_rt_component, options.components)):
        manager.register(kind)
    with warnings_shown(), ExitStack() as stack:
        for word in options.lites:
            load(_ATTACH_LITE)(manager, word, stack, options.lite_boot_us, options.rate_hz)
        _restore(manager, system, options)
        stack.callback(_close, manager)
        _serve(stack, manager, options)


def _find_rt_component(spec: str) -> type[RtComponent]:
    """Return the class that `FILE.py:Class` names. Raise Refused if a component cannot be of it."""
    try:
        kind: type[RtComponent] = find_class(spec, RtComponent)
        kind(f"{kind.spec.type_name}0")
    except Exception as error:  # a user's constructor may raise anything
        reason = explain_error(error, spec.rpartition(":")[0])
        raise Refused(f"--component {spec}: {reason}") from None
    return kind


def _restore(manager: Manager, system: System, options: _SystemOptions) -> None:
    """Make the system. The proxies exist already."""
    if (rate_hz := options.rate_hz) is not None:
        entries = tuple(replace(entry, rate_hz=rate_hz) for entry in system.components)
        system = replace(system, components=entries)
    if options.engines.openrtm is not None:
        system = with_remotes(system, manager.types)
    elif system.remotes:
        names = ", ".join(entry.name for entry in system.remotes)
        raise Refused(f"system {options.system}: {names} runs elsewhere: --openrtm HOST says where")
    there = {component.instance_name for component in manager.components}
    made = tuple(entry for entry in system.components if entry.name not in there)
    try:
        restore(manager, replace(system, components=made))
        proxies = there.intersection(entry.name for entry in system.components if entry.active)
        manager.activate(*sorted(proxies))
    except Exception as error:  # the constructor of a user's component may raise anything
        raise Refused(f"system {options.system}: {explain_error(error)}") from None


def _serve(stack: ExitStack, manager: Manager, options: _SystemOptions) -> None:
    """Run until the system is stopped, then save it."""
    clock = ServingClock()
    runner = RealTime(manager, clock)
    control = SystemControl(manager, runner)
    stack.enter_context(stopped_by_signals(runner.stop))
    server = stack.enter_context(serving_control(options.control, control, clock))
    if options.engines:
        joined = load(_JOIN_ENGINES)(
            options.engines, manager, lambda calls: server.attach(calls, calls.make), runner.stop
        )
        stack.enter_context(joined)
    _run(manager, runner, options)
    if options.save is not None:
        write_system(control.saved(file_format(options.save)), options.save)


def _run(manager: Manager, runner: RealTime, options: _SystemOptions) -> None:
    console = Console(manager, click.echo, say)
    if options.console:
        runner.after_tick.append(lambda now_us: console.read(sys.stdin.fileno()))
    names = ", ".join(component.instance_name for component in manager.components) or "Nothing"
    say(f"{names}. Ctrl-C ends.\n  tickrig rtc ls -l --at {options.control}")
    runner.run()
    worst = f" (up to {runner.worst_late_us / 1_000:.1f} ms)" if runner.late_ticks else ""
    say(f"ran {manager.now_us / 1e6:.3f} s; late ticks: {runner.late_ticks}{worst}")


def _close(manager: Manager) -> None:
    """Deactivate all components, and the devices behind them."""
    for component in manager.components:
        for context in tuple(component.contexts):
            context.close()
