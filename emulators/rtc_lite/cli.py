"""The command `rtc-lite-emu`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.emulators.commands.run_options import line_options, run_named
from tickrig.host.cli.options import HarmlessCommand
from tickrig.wire.rtc_lite.frame import Checksum, Framing


def _complete_node(context: click.Context, option: click.Parameter, word: str) -> list[str]:
    from tickrig.emulators.rtc_lite.device_type import COMPONENTS  # noqa: PLC0415 - slow

    return [name for name in COMPONENTS if name.startswith(word)]


@click.command(cls=HarmlessCommand)
@click.option(
    "--node",
    default="echo",
    metavar="NAME",
    help="Component: echo, lite-a, lite-b, or FILE.py:Class.  [echo]",
    shell_complete=_complete_node,
)
@click.option(
    "--baud",
    type=click.IntRange(300, 4_000_000),
    default=57_600,
    help="Bit rate of the line, 8N1.  [57600]",
)
@click.option(
    "--timer",
    "timer_hz",
    type=click.IntRange(1, 1_000),
    metavar="HZ",
    help="Execute by a timer of the device (type 22h) instead of by the proxy (21h).",
)
@click.option(
    "--framing",
    type=click.Choice([framing.value for framing in Framing]),
    default=Framing.LITE.value,
    help="Frames of RTC-Lite, or packets of RTno.  [lite]",
)
@click.option(
    "--checksum",
    type=click.Choice([checksum.value for checksum in Checksum]),
    default=Checksum.SUM8.value,
    help="How frames are summed up.  [sum8]",
)
@line_options("flip, drop, dup, cut, noise, ping, radio", "tickrig.device.rtc_lite.node:INPUTS")
@click.pass_context
def main(context: click.Context, /, **options: Any) -> None:
    """Emulate a PIC with an RTC-Lite component, on a pseudo-terminal.

    It runs in real time until Ctrl-C. A scenario alone runs in virtual time:
    as fast as it goes, with the same transcript each time, exit status 1 if
    something expected did not come. Together with --link, --serve or
    --control it is played in real time.

    \b
    Faults: power_cut the supply, slow_answer; on the line noise=0.01 bytes of
    chance, flip=0.001 bits turned over, ping=0.5 every second PING unanswered,
    radio=0.05 a lossy radio link.

    \b
    rtc-lite-emu --link /tmp/lite-a --node lite-a
    rtc-lite-emu --link /tmp/lite --node my_node.py:Thermometer --timer 10 -v
    rtc-lite-emu --link /tmp/lite --control /tmp/lite.ctl --fault power_cut@5s-9s
    echo '0 send CX' | rtc-lite-emu --scenario -

    \b
    Completion of options and nodes in the shell:
    eval "$(_RTC_LITE_EMU_COMPLETE=bash_source rtc-lite-emu)"
    """  # noqa: D301 - click wants the backspace
    context.exit(run_named("rtc-lite", options))
