"""The work of the commands of `tickrig demo`; no command loads another demonstration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.cli.can_options import BusOptions, open_raw
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.engine_options import EngineOptions, take_engines
from tickrig.host.cli.messages import Refused, failing, refuse_path, say, warnings_shown

if TYPE_CHECKING:
    import canopen

    from tickrig.emulators.commands import picture
    from tickrig.emulators.demos import experiments, fig120, robots, rrc, rtc_lite, tkernel, tracks
    from tickrig.emulators.rh3.commands import served_cart
    from tickrig.host.links import link
    from tickrig.host.rtc import states
    from tickrig.host.rtc.commands import system_control
    from tickrig.host.rtc.engines import engines_joined
else:
    canopen, link = LazyModule("canopen"), LazyModule("tickrig.host.links.link")
    served_cart = LazyModule("tickrig.emulators.rh3.commands.served_cart")
    states = LazyModule("tickrig.host.rtc.states")
    system_control = LazyModule("tickrig.host.rtc.commands.system_control")
    engines_joined = LazyModule("tickrig.host.rtc.engines.engines_joined")
    picture = LazyModule("tickrig.emulators.commands.picture")
    experiments = LazyModule("tickrig.emulators.demos.experiments")
    fig120 = LazyModule("tickrig.emulators.demos.fig120")
    robots = LazyModule("tickrig.emulators.demos.robots")
    rrc = LazyModule("tickrig.emulators.demos.rrc")
    rtc_lite = LazyModule("tickrig.emulators.demos.rtc_lite")
    tkernel = LazyModule("tickrig.emulators.demos.tkernel")
    tracks = LazyModule("tickrig.emulators.demos.tracks")

_WITHIN_A_PROCESS: Final = ("virtual", "tickrig")


def show_rrc() -> None:
    """Run the demonstration of the RRC, in real time."""
    with failing(RuntimeError, OSError, link.LinkError, link.DeviceRefused):
        rrc.run_demo(click.echo)


def show_rtc_lite(*, virtual: bool) -> None:
    """Run the demonstration of RTC-Lite, in virtual time or in real time."""
    with failing(RuntimeError, OSError, link.LinkError, states.RtcRefused):
        if virtual:
            rtc_lite.run_demo(rtc_lite.VirtualSetup(), click.echo)
            return
        with warnings_shown(), rtc_lite.pty_setup() as setup:
            rtc_lite.run_demo(setup, click.echo)


def show_tkernel(*, no_caches: bool) -> None:
    """Run the demonstration of the T-Kernel node, in virtual time."""
    tkernel.run_demo(tkernel.CorridorStage(caches=not no_caches), click.echo)


def show_follow(plot: Path | None, **options: Any) -> None:
    """Run experiment A."""
    _run_experiment(experiments.FOLLOW, plot, options)


def show_leader(plot: Path | None, **options: Any) -> None:
    """Run experiment B1."""
    _run_experiment(experiments.LEADER, plot, options)


def show_four(plot: Path | None, **options: Any) -> None:
    """Run experiment B2."""
    _run_experiment(experiments.FOUR, plot, options)


def show_joystick(plot: Path | None, **options: Any) -> None:
    """Run the experiment of phase 1."""
    _run_experiment(experiments.JOYSTICK, plot, options)


def _run_experiment(
    experiment: experiments.Experiment, plot: Path | None, options: dict[str, Any]
) -> None:
    """Run an experiment in virtual time, or in real time if others can reach it."""
    control, engines = options.pop("control"), take_engines(options)
    if plot is not None:
        picture.check_plot(plot)
    if control is None and not engines:
        run = experiments.ConvoyRun(experiment, click.echo)
        run.play()
    else:
        with warnings_shown():
            run = _serve(experiment, control, engines)
    _draw(plot, run.tracks, run.marks, experiment.title)


def _serve(
    experiment: experiments.Experiment, control: Path | None, engines: EngineOptions
) -> experiments.ConvoyRun:
    """Run an experiment in real time until Ctrl-C; other programs can change its connectors.

    Raises:
        Refused: an engine or the control socket cannot be opened.
    """
    clock = served_cart.CartClock()
    run = experiments.ConvoyRun(experiment, click.echo, clock)
    loop = run.convoy.loop
    cart = served_cart.ServedCart(loop, clock)
    cart.after_tick.append(run.look)
    with stopped_by_signals(cart.stop), ExitStack() as stack:
        requests = system_control.SystemControl(loop.manager, cart)
        if control is not None:
            cart.server = stack.enter_context(serving_control(control, requests, clock))
        if engines:
            joined = engines_joined.engines_joined(
                engines, loop.manager, cart.attach, cart.stop, fixed=True
            )
            stack.enter_context(joined)
        hint = "" if control is None else f"\n  tickrig rtc ls -l --at {control}"
        say(f"{', '.join(experiment.names)}. Ctrl-C ends.{hint}")
        run.begin()
        cart.run()
    clock.serve = None
    return run


def show_rh3(plot: Path | None) -> None:
    """Run the demonstration of Reference Hardware 3."""
    _run_robot(robots.drive_rh3, plot, "Reference Hardware 3: a goal, then a path")


def show_beego(plot: Path | None) -> None:
    """Run the demonstration of beego."""
    _run_robot(robots.drive_beego, plot, "beego: two EPOS under a joystick")


def show_fourx(plot: Path | None) -> None:
    """Run the demonstration of FourX."""
    _run_robot(robots.drive_fourx, plot, "FourX: four motor core units under a joystick")


def _run_robot(
    drive: Callable[[Callable[[str], None]], tracks.RobotTrack], plot: Path | None, title: str
) -> None:
    if plot is not None:
        picture.check_plot(plot)
    _draw(plot, [drive(click.echo)], (), title)


def _draw(
    plot: Path | None, shown: Sequence[tracks.RobotTrack], marks: Sequence[tracks.Mark], title: str
) -> None:
    """Draw the motions of robots, if a file for the picture is given."""
    if plot is None:
        return
    try:
        picture.write_figure(tracks.draw(shown, marks, title), title, plot)
    except OSError as error:
        refuse_path("plot", error)
    click.echo(f"\nThe paths are in {plot}.")


def show_fig120(plot: Path | None, **options: Any) -> None:
    """Run the demonstration `tickrig demo fig120` in the terminal.

    In this demonstration a potentiometer turns a motor without a PC in between.

    Args:
        plot: path of a picture with the curves of the run, or None to draw no picture.
        options: options of the bus.
    """
    if plot is not None:
        picture.check_plot(plot)
    samples = _play(BusOptions(**options))
    if plot is not None:
        try:
            fig120.write_plot(samples, plot)
        except OSError as error:
            refuse_path("plot", error)
        click.echo(f"\nThe curves are in {plot}.")


def _play(bus: BusOptions) -> list[fig120.CurveSample]:
    with failing(RuntimeError, OSError, canopen.SdoCommunicationError):
        if not bus:
            return fig120.run_demo(fig120.VirtualStage(), click.echo)
        with warnings_shown():
            if bus.interface in _WITHIN_A_PROCESS:
                raise Refused(
                    f"{bus.interface} is inside one process, and the nodes run in another"
                )
            with fig120.bus_stage(bus.arguments(), lambda: open_raw(bus)[0]) as stage:
                return fig120.run_demo(stage, click.echo)
