"""The command `tickrig`."""

from __future__ import annotations

from typing import Any, Final

import click

from tickrig.host.cli.options import LazyGroup, version_option, works_in

# The command `tickrig demo`; each demonstration stands with its device.

DEMOS: Final = {
    "rrc": (
        "tickrig.emulators.demos.cli:rrc",
        "Drive an emulated RRC, the controller of a wheelchair, on a pty.",
    ),
    "rtc-lite": (
        "tickrig.emulators.demos.cli:rtc_lite",
        "Send numbers through two emulated PICs, cut the power of one, and see it come back.",
    ),
    "tkernel": (
        "tickrig.emulators.demos.cli:tkernel",
        "Let a robot find its position by infra-red markers while a service is unreachable.",
    ),
    "fig120": (
        "tickrig.emulators.demos.cli:fig120",
        "Let a potentiometer at one CANopen node turn the motor of another, without a PC in"
        " between.",
    ),
    "follow": (
        "tickrig.emulators.demos.cli:follow",
        "Let two robots follow a preceding one (NEDO report, experiment A, Fig. 96).",
    ),
    "leader": (
        "tickrig.emulators.demos.cli:leader",
        "Exchange the leaders of two pairs of robots, then remove a connection and join it again.",
    ),
    "four": (
        "tickrig.emulators.demos.cli:four",
        "Drive four robots with one joystick, then two of them with another joystick.",
    ),
    "joystick": (
        "tickrig.emulators.demos.cli:joystick",
        "Drive two robots of different make with one joystick (NEDO report, Fig. 92).",
    ),
    "rh3": (
        "tickrig.emulators.demos.cli:rh3",
        "Let a cart of Reference Hardware 3 drive to a goal, and along a path.",
    ),
    "beego": (
        "tickrig.emulators.demos.cli:beego",
        "Drive beego, two CANopen drives at its wheels, with a joystick.",
    ),
    "fourx": (
        "tickrig.emulators.demos.cli:fourx",
        "Drive FourX, four motor core units at its wheels, with a joystick.",
    ),
}


@click.group(cls=LazyGroup, commands=DEMOS, invoke_without_command=True)
@click.pass_context
def demo(context: click.Context) -> None:
    """Show an emulated device and a host at work; each demonstration ends by itself.

    Without a name, list the demonstrations.

    \b
    tickrig demo
    tickrig demo rtc-lite --virtual
    """  # noqa: D301 - click wants the backspace
    if context.invoked_subcommand is None:
        for name, (_, what) in DEMOS.items():
            click.echo(f"tickrig demo {name:8}  {what}")


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print the table as JSON.")
@click.option(
    *("--need", "needs"),
    multiple=True,
    metavar="CHECK",
    help="Exit with status 1 if CHECK is missing, such as socketcan or tui; may be repeated.",
)
@works_in("tickrig.emulators.commands.doctor:run_doctor")
def doctor(**options: Any) -> None:
    """Check what tickrig can use on this machine, and show what to do.

    The table has a row for each check: ok, note (it works, and there is something to know) or
    missing. The checks cover Python, packages and extras, groups, SocketCAN, ports and adapters,
    and how well the machine keeps time. The command needs no root, changes nothing, and ends within
    half a minute.

    The exit status is 0 if everything needed is there: Python 3.11 or newer, the packages of
    tickrig, pseudo-terminals, and the checks that --need names. The exit status is 1 if something
    needed is missing. All other rows are for information.

    \b
    tickrig doctor
    tickrig doctor --need socketcan --need tui      in CI, before the tests
    tickrig doctor --json
    """  # noqa: D301 - click wants the backspace


_HERE: Final = "tickrig.emulators.commands"
_TESTING: Final = "tickrig.emulators.testing.commands"
_COMMANDS: Final = {
    "campaign": (
        f"{_TESTING}.campaign_cli:campaign",
        "Run bench tests with many seeds and parameters, on all cores or a cluster.",
    ),
    "check": (
        f"{_TESTING}.check_cli:check",
        "Check rig files and bus.yml: list the devices on the bench, or all errors.",
    ),
    "compare": (
        f"{_TESTING}.compare_cli:compare_command",
        "Replay a recorded host against an emulator; report differences from the recording.",
    ),
    "ctl": (
        f"{_HERE}.ctl_cli:ctl",
        "Operate and watch the emulator whose control socket is SOCKET.",
    ),
    "demo": (f"{_HERE}.cli:demo", "Show an emulated device and a host at work."),
    "doctor": (
        f"{_HERE}.cli:doctor",
        "Check what tickrig can use on this machine, and show what to do.",
    ),
    "emu": (
        f"{_HERE}.emu_cli:emu",
        "Emulate a built-in device or a device of an installed package.",
    ),
    "init": (
        f"{_TESTING}.init_cli:init",
        "Write an initial rig file: devices with all their options.",
    ),
    "new": (f"{_HERE}.new_cli:new", "Create a package that extends tickrig."),
    "record": (
        f"{_TESTING}.record_cli:record_command",
        "Record the traffic between a host and the device at PORT, for `tickrig compare`.",
    ),
    "replay": (f"{_TESTING}.replay_cli:replay_command", "Replay the trace FILE on fresh devices."),
    "report": (
        f"{_TESTING}.report_cli:report_command",
        "Make one HTML page of test runs that were kept as JSON.",
    ),
    "run": (f"{_TESTING}.run_cli:run", "Run the bench of a rig file: all its devices on one rig."),
    "rtc": (
        "tickrig.host.rtc.commands.cli:rtc",
        "Run RT components, and work with them while they run.",
    ),
}


@click.group(cls=LazyGroup, commands=_COMMANDS)
@version_option()
def main() -> None:
    """Work with emulated devices.

    \b
    tickrig ctl /tmp/rrc.ctl press power_button   operate a running emulator
    tickrig emu rrc --link /tmp/rrc               emulate a device
    tickrig init                                  write a rig file to begin with
    tickrig check rig.toml                        see what is wrong with a rig file
    tickrig run rig.toml                          run the bench of a rig file
    tickrig doctor                                see what this machine has
    tickrig new device lamp                       begin a device of your own
    tickrig compare run.trace                     compare a recording with the emulator
    tickrig record /dev/ttyUSB0 -o run.trace      record a real device and its host
    tickrig replay run.trace                      replay a recorded run
    tickrig report run.json -o bench.html         see a test run as a page
    tickrig campaign test_x.py --seeds 0-9999     run a test ten thousand times
    tickrig demo rrc                              see a device and a host at work
    tickrig rtc run system.toml                   run RT components

    \b
    Completion of commands and options in the shell:
    eval "$(_TICKRIG_COMPLETE=bash_source tickrig)"      in ~/.bashrc
    eval "$(_TICKRIG_COMPLETE=zsh_source tickrig)"       in ~/.zshrc
    _TICKRIG_COMPLETE=fish_source tickrig | source       in fish's configuration
    """  # noqa: D301 - click wants the backspace
