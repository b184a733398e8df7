"""The command `rrc`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import click
from click.shell_completion import CompletionItem

from tickrig.host.cli.messages import Refused
from tickrig.host.cli.options import (
    Decorator,
    HarmlessCommand,
    time_option,
    version_option,
    works_in,
)
from tickrig.host.cli.start import load, loading

_VERBS: Final = "tickrig.host.rrc.verbs"
_WATCHDOG_US: Final = 500_000
_MOST_WATCHDOG_US: Final = 2_550_000
_UNIT_US: Final = 10_000

_SPEED: Final = click.IntRange(1, 5)
_PERCENT: Final = click.IntRange(0, 100)
_SIGNED: Final = click.IntRange(-100, 100)
_BYTE: Final = click.IntRange(0, 255)
_NIBBLE: Final = click.IntRange(0, 15)
_ANGLE: Final = click.IntRange(0, 90)


@dataclass(frozen=True, slots=True)
class RrcCall:
    """Options of the command `rrc` that stand before the verb, as in `rrc URL --pad PATH drive`.

    Attributes:
        url: device path or pyserial URL of the port, empty if none was given.
        watchdog_us: time without a command, in us, after which the RRC stops the wheelchair. 0
            switches this watchdog off.
        stable: whether stablemode is switched on.
        pad: path of a game pad, or None without a pad.
    """

    url: str
    watchdog_us: int
    stable: bool
    pad: str | None


class _Verb(HarmlessCommand):
    """A verb whose arguments may be negative numbers, which are not options."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments, with a blank before negative numbers. They are then not options."""
        return super().parse_args(
            ctx, [f" {a}" if a[:1] == "-" and a[1:2].isdecimal() else a for a in args]
        )


class _RrcGroup(HarmlessCommand, click.Group):
    """A group with URL before its verbs."""

    command_class = _Verb

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the command line of `rrc`, in which options may stand before or after the URL.

        If a verb comes first, no URL is needed, so that the help of the verb can be shown.
        """
        options, url, rest = self._split(ctx, args)
        if url in self.commands:
            return super().parse_args(ctx, [*options, "", url, *rest])
        more, verb, rest = self._split(ctx, rest) if rest[:1] != ["--"] else ([], "", rest)
        words = [word for word in (url, verb) if word]
        return super().parse_args(ctx, [*options, *more, *words, *rest])

    def _split(self, ctx: click.Context, args: list[str]) -> tuple[list[str], str, list[str]]:
        """Return the options before the first other word, that word, and the rest."""
        found, rest, _ = self.make_parser(ctx).parse_args(list(args))
        word = found.get("url")
        count = len(args) - len(rest)
        if not isinstance(word, str):
            return args, "", []
        return args[: count - 1], word, rest

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order of the help."""
        return list(self.commands)


@click.group(cls=_RrcGroup, subcommand_metavar="[VERB [ARGS]...]", invoke_without_command=True)
@click.argument(
    "url", shell_complete=lambda ctx, param, begun: [CompletionItem(begun, type="file")]
)
@click.option("--panel", is_flag=True, help="Show a panel in this terminal, and drive by keys.")
@click.option(
    "--pad",
    metavar="DEVICE",
    help="Drive by a game pad, such as /dev/input/event5, while a button is held.",
)
@time_option(
    "--watchdog", "watchdog_us", help="Time without a command after which VR2 stops. [500ms]"
)
@click.option(
    "--no-watchdog", is_flag=True, help="Use no watchdog: nothing stops VR2 after a crash."
)
@click.option("--no-stablemode", is_flag=True, help="Do not switch on stablemode (checksums).")
@version_option()
@click.pass_context
def main(context: click.Context, /, url: str, *, panel: bool, **guard: Any) -> None:
    """Drive and watch an RRC, the controller of a VR2 wheelchair, real or emulated.

    URL is a port: /dev/ttyACM0, COM3, rfc2217://HOST:PORT, socket://HOST:PORT. Nothing moves before
    an RRC has answered. Its watchdog and stablemode are on while the command runs. The command
    always stops the motors before it ends. If the command is killed, the watchdog stops VR2.

    \b
    rrc /dev/ttyACM0 status                  what is connected, and its state
    rrc /dev/ttyACM0 drive 30 0              forward at 30 %, while SPACE is held
    rrc /dev/ttyACM0 limit 50 50             the stick drives, at 50 % at most
    rrc /dev/ttyACM0 --panel                 drive by keys
    rrc /dev/ttyACM0 --pad /dev/input/event5 drive 50 50
    rrc /dev/ttyACM0 test                    the test procedure of the manual

    \b
    Exit status  0 all is done               3 no device, another device, or
                 1 VR2 is off, was stopped,     the device is gone
                   or refused; a test failed  130 Ctrl-C, 129 terminal closed
                 2 usage

    \b
    Completion of verbs and options in the shell:
    eval "$(_RRC_COMPLETE=bash_source rrc)"
    """  # noqa: D301 - click wants the backspace
    watchdog_us = _watchdog(guard["watchdog_us"], off=guard["no_watchdog"])
    context.obj = RrcCall(url, watchdog_us, not guard["no_stablemode"], guard["pad"])
    if context.invoked_subcommand is not None:
        if panel:
            raise Refused(f"--panel and {context.invoked_subcommand}: give one of them")
        return
    if not panel:
        raise Refused("a verb is missing: status, drive, watch, ..., or --panel; see rrc --help")
    with loading():
        from importlib.util import find_spec  # noqa: PLC0415 - a TAB needs none

        if find_spec("textual") is None:
            raise Refused("--panel needs Textual: pip install 'tickrig[tui]'")
        run = load("tickrig.host.rrc.panel:run")
    run()


def _watchdog(time_us: int | None, *, off: bool) -> int:
    if off and time_us is not None:
        raise Refused("--watchdog and --no-watchdog: give one of them")
    if off:
        return 0
    time_us = _WATCHDOG_US if time_us is None else time_us
    if time_us % _UNIT_US or not 0 < time_us <= _MOST_WATCHDOG_US:
        raise Refused(f"--watchdog {time_us / 1_000:g}ms is not 10ms..2550ms in steps of 10ms")
    return time_us


_for_option: Final = time_option("--for", "for_us", help="End after this time, such as 10s.")
_json_option: Final = click.option(
    "--json", "as_json", is_flag=True, help="Print the answer as JSON."
)


def _number(option: str, name: str, kind: click.IntRange, default: int, text: str) -> Decorator:
    """Return an option whose help shows its default."""
    return click.option(option, name, type=kind, default=default, show_default=True, help=text)


def _bound(option: str, name: str, what: str) -> Decorator:
    """Return an option that limits a quantity of `rrc limit`."""
    return click.option(
        option, name, type=_BYTE, default=255, help=f"Limit of {what} in %.  [no limit]"
    )


def _pair(option: str, kind: click.IntRange, default: int, text: str) -> Decorator:
    """Return an option with a value for each direction of the stick."""
    shown = f"{text}  [{default} {default}]"
    return click.option(
        option, type=kind, nargs=2, default=(default, default), metavar="V W", help=shown
    )


_speed_option: Final = _number("--speed", "speed", _SPEED, 1, "Speed mode, 1 is the slowest.")


@main.command("status")
@_json_option
@works_in(f"{_VERBS}:status")
def _status(**options: Any) -> None:
    """Show the connected device, whether VR2 is on, and its status line.

    \b
    rrc /dev/ttyACM0 status
    rrc /dev/ttyACM0 status --json | jq .gauge
    """  # noqa: D301 - click wants the backspace


@main.command("drive")
@click.argument("v_pct", metavar="V", type=_SIGNED)
@click.argument("w_pct", metavar="W", type=_SIGNED)
@_speed_option
@_for_option
@click.option("--no-dead-man", is_flag=True, help="Drive without a dead-man key; needs --for.")
@works_in(f"{_VERBS}:drive")
def _drive(**options: Any) -> None:
    """Drive: V forward and W to the right, -100..100 % each.

    On a terminal, the chair drives while SPACE is held, or pressed again within 1 s. The key q ends
    the command. With --pad, the chair drives by the left stick while a button of the pad is held,
    with V and W as limits. A script has neither terminal nor pad, and needs --for.

    \b
    rrc /dev/ttyACM0 drive 30 0
    rrc /dev/ttyACM0 drive -20 0 --speed 2
    rrc /dev/ttyACM0 --pad /dev/input/event5 drive 50 50
    rrc /dev/ttyACM0 drive 0 15 --for 2s </dev/null
    """  # noqa: D301 - click wants the backspace


@main.command("limit")
@click.argument("v_pct", metavar="V", type=_PERCENT)
@click.argument("w_pct", metavar="W", type=_PERCENT)
@_bound("--sum", "sum_pct", "|v| + |w|")
@_bound("--product", "product_pct", "|v| * |w| / 100")
@_bound("--radius", "radius_pct", "the root of v² + w²")
@_speed_option
@_for_option
@click.option(
    "--leave", is_flag=True, help="End at once; the stick keeps driving, without watchdog."
)
@works_in(f"{_VERBS}:limit")
def _limit(**options: Any) -> None:
    """Drive by the stick: V % forward and W % of rotation at most.

    The command runs until Ctrl-C, and then stops the chair.

    \b
    rrc /dev/ttyACM0 limit 50 50
    rrc /dev/ttyACM0 limit 100 60 --sum 120 --for 10s
    rrc /dev/ttyACM0 limit 100 100 --leave
    """  # noqa: D301 - click wants the backspace


@main.command("stick")
@_pair("--low", _PERCENT, 0, "Largest value in % that counts as 0.")
@_pair("--high", _PERCENT, 100, "Smallest value in % that counts as 100.")
@_pair("--exponent", _NIBBLE, 0, "Output is input ^ (1 + 0.1 * exponent), 0..15.")
@_number(
    "--reverse",
    "reverse_mode",
    click.IntRange(0, 3),
    0,
    "Driving backward: 0 plain, 1 never, 2 by gears, 3 by gears, rotation reversed.",
)
@_number("--neutral", "neutral_pct", _PERCENT, 5, "Radius of neutral in %, for gears.")
@_number("--switch", "switch_deg", _ANGLE, 30, "Largest angle in deg that selects gear R.")
@_number("--fade", "fade_deg", _ANGLE, 45, "Angle in deg from which gear R slows.")
@works_in(f"{_VERBS}:stick")
def _stick(**options: Any) -> None:
    """Shape the stick: dead zones, exponents, and backing.

    The settings last until VR2 or the RRC is switched off.

    \b
    rrc /dev/ttyACM0 stick --low 10 10 --exponent 5 5
    rrc /dev/ttyACM0 stick --reverse 3
    """  # noqa: D301 - click wants the backspace


@main.command("speed")
@click.argument("mode", metavar="MODE", type=_SPEED)
@click.option("--lock", is_flag=True, help="Lock the speed buttons of the controller.")
@works_in(f"{_VERBS}:speed")
def _speed(**options: Any) -> None:
    """Choose the speed mode, 1 (slowest) to 5.

    \b
    rrc /dev/ttyACM0 speed 4
    rrc /dev/ttyACM0 speed 1 --lock
    """  # noqa: D301 - click wants the backspace


@main.command("beep")
@click.argument("times", metavar="ON [OFF ON ...]", nargs=-1, required=True)
@works_in(f"{_VERBS}:beep")
def _beep(**options: Any) -> None:
    """Sound the buzzer: up to ten times, on and off in turn.

    A time is 0..2550ms, in steps of 10ms. A single 0 stops the sound.

    \b
    rrc /dev/ttyACM0 beep 1s 1s 1s
    rrc /dev/ttyACM0 beep 0
    """  # noqa: D301 - click wants the backspace


@main.command("poweroff")
@works_in(f"{_VERBS}:poweroff")
def _poweroff(**options: Any) -> None:
    """Force VR2 to stop. Press the power button of VR2 afterwards.

    \b
    rrc /dev/ttyACM0 poweroff
    """  # noqa: D301 - click wants the backspace


@main.command("watch")
@_for_option
@click.option("--all", "every", is_flag=True, help="Print each status line, not only changes.")
@click.option("--jsonl", "--json", "as_json", is_flag=True, help="Print one JSON object per line.")
@works_in(f"{_VERBS}:watch")
def _watch(**options: Any) -> None:
    """Print events and changes of the status line until Ctrl-C.

    \b
    rrc /dev/ttyACM0 watch
    rrc /dev/ttyACM0 watch --jsonl --for 10s > run.jsonl
    """  # noqa: D301 - click wants the backspace


@main.command("test")
@click.option(
    "--json",
    "json_path",
    metavar="FILE",
    help="Write the results to FILE as JSON; - is standard output.",
)
@works_in(f"{_VERBS}:test")
def _test(**options: Any) -> None:
    """Run the test procedure of the manual, step by step.

    The command sends the sample commands without CHECK, then with CHECK, and checks the answers.
    You press buttons, move the stick, and answer questions. Two samples run the motors, so lift the
    wheels off the ground first.

    \b
    rrc /dev/ttyACM0 test
    rrc /dev/ttyACM0 test --json results.json
    """  # noqa: D301 - click wants the backspace
