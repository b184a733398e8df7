"""`tickrig rtc print`: the values that an OutPort writes, as they come."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import click

from tickrig.emulators.rtc.at import SYSTEM, at
from tickrig.emulators.rtc.completion import complete_port
from tickrig.emulators.rtc.texts import value_line
from tickrig.host.cli.control import refused_by
from tickrig.host.cli.options import time_us
from tickrig.host.control.client import ControlClient

POLL_S: Final = 0.02


@click.command("print")
@click.argument("port", shell_complete=complete_port)
@click.option("-n", "count", type=click.IntRange(1), help="End after so many values.")
@click.option("--for", "duration", metavar="TIME", help="End after this time, as 2s.")
@click.option("--json", "as_json", is_flag=True, help="Print each value as a JSON object.")
@at
def print_(at: Path, port: str, count: int | None, duration: str | None, as_json: bool) -> None:
    """Print what the OutPort PORT writes from now on, a line a value; Ctrl-C ends.

    A line is the value's time in seconds and its data as JSON.

    \b
    tickrig rtc print ConsoleIn0.out
    tickrig rtc print SeqOut0.Long -n 10 --json
    """  # noqa: D301 - click wants the backspace
    until_s = time.monotonic() + time_us("--for", duration) / 1e6 if duration else None
    try:
        for value in _values(at, port, count, until_s):
            click.echo(json.dumps(value) if as_json else value_line(value))
    except KeyboardInterrupt:
        return


def _values(socket: Path, port: str, count: int | None, until_s: float | None) -> Iterator[Any]:
    """Yield values until there were enough of them, or it is time."""
    with refused_by(socket, SYSTEM), ControlClient(socket) as client:
        latest = client.ask("seen", port=port)["latest"]
        given = 0
        while until_s is None or time.monotonic() < until_s:
            answer: Any = client.ask("seen", port=port, since=latest)
            _tell_lost(answer, latest)
            latest = answer["latest"]
            for seen in answer["values"]:
                yield seen["value"]
                given += 1
                if given == count:
                    return
            time.sleep(POLL_S)


def _tell_lost(answer: Any, latest: Any) -> None:
    if lost := answer["latest"] - latest - len(answer["values"]):
        click.echo(f"{lost} values lost: they came faster than they were taken", err=True)
