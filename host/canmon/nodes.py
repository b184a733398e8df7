"""The verb `nodes`: the state of all nodes."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Sequence
from typing import Any, Final

import click

from tickrig.host.canmon.decode_options import eds_option, read_eds_files
from tickrig.host.canmon.ending import report, until_interrupted
from tickrig.host.canmon.screen import Screen
from tickrig.host.canmon.source import Source, explain_sources, open_source
from tickrig.host.canmon.stopwatch import Stopwatch
from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.cli.duration import parse_time_us
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.decode.board_text import board_json, render_board
from tickrig.host.monitor.decode.decoder import Decoder
from tickrig.host.monitor.decode.node_board import NodeBoard
from tickrig.host.monitor.heard import Heard

POLL_US: Final = 20_000
PAINT_S: Final = 0.1
PATIENCE_US: Final = 5_000_000
"""How long a bus is heard where there is no terminal to leave it at."""
MANY_LINES: Final = 1_000
MANY_COLUMNS: Final = 1_000


@click.command(cls=BusCommand)
@click.argument("source", nargs=-1)
@eds_option
@click.option("--for", "span", metavar="TIME", help="End after 10s, 500ms.")
@click.option("--jsonl", is_flag=True, help="One JSON object a node, at the end.")
@click.option("--strict", is_flag=True, help="Exit status 4 if frames were lost.")
@bus_options
def command(
    source: Sequence[str],
    eds: Sequence[str],
    span: str | None,
    jsonl: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Show all nodes: NMT state, heartbeat, boot-ups, drive state, EMCYs, SDO errors.

    It listens only, and knows what it hears: the heartbeat period by SDO
    traffic or an EDS, else learnt (~). An arrow shows a state that was
    commanded and is not confirmed yet. Of a log file it shows the final state.

    \b
    canmon nodes can0
    canmon nodes can0 --eds 3=drive.eds --for 5s --jsonl
    canmon nodes run.log

    Keys: q quit.

    {source}
    """  # noqa: D301 - click wants the backspace
    try:
        span_us = None if span is None else parse_time_us(span)
    except ValueError as error:
        raise Refused(f"--for {error}") from None
    objects = read_eds_files(eds)
    decoder = Decoder(objects)
    view = NodesView(
        decoder, NodeBoard(decoder, {node: found.name for node, found in objects.items()})
    )
    frames = open_source(source, BusOptions(**options))
    on_screen = frames.live and sys.stdout.isatty() and not jsonl
    try:
        with until_interrupted():
            if on_screen:
                view.paint(frames, span_us)
            else:
                patience = frames.live and list(source) != ["-"]
                view.listen(frames, span_us or (PATIENCE_US if patience else None))
        for line in board_json(view.board, view.now_us) if jsonl else view.lines():
            click.echo(line)
    finally:
        frames.close()
    report(frames, strict)


class NodesView:
    """Feeds a board from a source.

    Args:
        decoder: decodes what comes.
        board: takes it.
    """

    def __init__(self, decoder: Decoder, board: NodeBoard) -> None:
        self.board = board
        self._decoder = decoder
        self._watch = Stopwatch()
        self._live = False

    @property
    def now_us(self) -> int:
        """The time at the source; of a file its last frame's."""
        return self._watch.now_us if self._live else self.board.now_us

    def lines(self) -> list[str]:
        """Return the board for paper, or for as many columns as the terminal has."""
        columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else MANY_COLUMNS
        return render_board(self.board, self.now_us, columns, MANY_LINES)

    def listen(self, source: Source, span_us: int | None) -> None:
        """Take what comes, without a screen; a file is taken whole."""
        self._live, begin_s = source.live, time.monotonic()
        while not (source.ended or _is_over(begin_s, span_us)):
            self._take(source.poll(POLL_US))

    def paint(self, source: Source, span_us: int | None) -> None:
        """Take what comes, and show the board ten times a second."""
        self._live, begin_s, due_s = True, time.monotonic(), 0.0
        with Screen() as screen:
            while not (source.ended or _is_over(begin_s, span_us)):
                self._take(source.poll(POLL_US))
                pressed = screen.keys()
                if "q" in pressed:
                    break
                if time.monotonic() >= due_s:
                    due_s = time.monotonic() + PAINT_S
                    screen.paint(render_board(self.board, self.now_us, *screen.size()))

    def _take(self, heards: list[Heard]) -> None:
        for heard in heards:
            self.board.take(heard, self._decoder.take(heard))
        self._watch.take(heards)


def _is_over(begin_s: float, span_us: int | None) -> bool:
    return span_us is not None and time.monotonic() >= begin_s + span_us / 1e6


explain_sources(command)
