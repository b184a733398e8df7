"""The command `tickrig replay`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tickrig.host.cli.options import PATH
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.cli.start import loading
from tickrig.host.text.byte_text import escape
from tickrig.host.text.values import format_time

if TYPE_CHECKING:
    from tickrig.emulators.record.replay import Difference


@click.command("replay")
@click.argument("file", type=PATH)
@click.pass_context
def replay_command(context: click.Context, /, file: Path) -> None:
    """Replay the trace FILE on a fresh device; exit status 1 if it says anything else.

    \b
    rrc-emu --link /tmp/rrc --trace run.trace
    tickrig replay run.trace
    """  # noqa: D301 - click wants the backspace
    with loading():
        from tickrig.emulators.commands.device_type import build_recorded  # noqa: PLC0415 - slow
        from tickrig.emulators.record.replay import read_recording, replay  # noqa: PLC0415

    try:
        recording = read_recording(file.read_bytes())
        difference = replay(recording, build_recorded(recording.header))
    except OSError as error:
        refuse_path("trace", error)
    except ValueError as error:
        raise Refused(f"trace {file}: {error}") from None
    if not recording.ended:
        click.echo(f"{file}: no end line (killed?); its last tick is left out", err=True)
    if difference is None:
        click.echo(f"identical: {recording.ticks} ticks")
    else:
        click.echo(_describe(difference, file))
        context.exit(1)


def _describe(difference: Difference, file: Path) -> str:
    place = f" ({file}:{difference.line})" if difference.line else ""
    then = escape(difference.recorded) if difference.recorded else "(nothing)"
    now = escape(difference.replayed) if difference.replayed else "(nothing)"
    at = format_time(difference.at_us)
    return f"different at {at}{place}\n  recorded < {then}\n  replayed < {now}"
