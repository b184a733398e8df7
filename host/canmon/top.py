"""The verb `top`: a table of all identifiers."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import Any, Final

import click

from tickrig.host.canmon.ending import report, until_interrupted
from tickrig.host.canmon.screen import Screen
from tickrig.host.canmon.source import SOURCE_HELP, Source, open_source
from tickrig.host.canmon.stopwatch import Stopwatch
from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.cli.duration import parse_time_us
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.top_model import TopModel

PAINT_US: Final = 100_000
POLL_US: Final = 20_000
WITHOUT_SCREEN: Final = "5s"
"""How long a bus is heard where there is no terminal to leave it at."""


@click.command(cls=BusCommand)
@click.argument("source", nargs=-1)
@click.option("--for", "span", metavar="TIME", help="End after 10s, 500ms.")
@click.option("--strict", is_flag=True, help="Exit status 4 if frames were lost.")
@bus_options
def command(source: Sequence[str], span: str | None, strict: bool, **options: Any) -> None:
    """Show all identifiers: counts, rates, gaps, jitter, missed cycles, changes, load.

    It listens only. Ten times a second the screen is painted; the last table
    stays in the terminal. A log file is read at once. The load is a share of
    the bit rate that -b gives.

    \b
    canmon top can0 -b 500000
    canmon top run.log
    ssh robot canmon dump can0 --jsonl | canmon top -
    canmon top can0 --for 10s > table.txt

    Keys: q quit, space hold, b bits, n notch (hide what changed so far),
    s sort, c clear, arrows scroll.

    {source}
    """  # noqa: D301 - click wants the backspace
    bus = BusOptions(**options)
    seconds_us = span_us(span)
    frames, model = open_source(source, bus), TopModel(bus.bitrate)
    on_screen = frames.live and sys.stdout.isatty()
    try:
        with until_interrupted():
            if on_screen:
                _paint(frames, model, seconds_us)
            else:
                _listen(frames, model, seconds_us or _patience_us(frames, source))
        click.echo("\n".join(model.final(frames.lost)))
    finally:
        frames.close()
    report(frames, strict)


def span_us(text: str | None) -> int | None:
    """Read the option `--for`.

    Raises:
        Refused: it is no time.
    """
    try:
        return None if text is None else parse_time_us(text)
    except ValueError as error:
        raise Refused(f"--for {error}") from None


def _listen(source: Source, model: TopModel, span_us: int | None) -> None:
    """Take what comes, without a screen; a file is taken whole."""
    begin_s = time.monotonic()
    while not (source.ended or _is_over(begin_s, span_us)):
        model.take(source.poll(POLL_US))


def _patience_us(source: Source, words: Sequence[str]) -> int | None:
    """Return how long a bus is heard; a file and a pipe have an end."""
    return None if not source.live or list(words) == ["-"] else span_us(WITHOUT_SCREEN)


def _paint(source: Source, model: TopModel, span_us: int | None) -> None:
    watch, begin_s, due_s = Stopwatch(), time.monotonic(), 0.0
    with Screen() as screen:
        while not (source.ended or model.quit or _is_over(begin_s, span_us)):
            heards = source.poll(POLL_US)
            model.take(heards)
            watch.take(heards)
            keys = screen.keys()
            for key in keys:
                model.press(key)
            if keys or time.monotonic() >= due_s:
                due_s = time.monotonic() + PAINT_US / 1e6
                screen.paint(model.lines(watch.now_us, source.lost, *screen.size()))


def _is_over(begin_s: float, span_us: int | None) -> bool:
    return span_us is not None and time.monotonic() >= begin_s + span_us / 1e6


command.help = (command.help or "").replace("{source}", SOURCE_HELP)
