"""The verb `nodes`, which shows the state of all nodes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import closing
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.extensions import make_decoder
from tickrig.host.canmon.model.decode.node_board import NodeBoard, board_json, render_board
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.output.listening import (
    Stopwatch,
    expect_frames,
    follow,
    report,
    span_option,
    take_blocks,
)
from tickrig.host.canmon.sources.source import BlockLog, LogCut, block_log, open_source
from tickrig.host.canmon.verbs.decode_options import (
    EdsOptions,
    cut_options,
    eds_option,
    read_eds_files,
    source_command,
)
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import until_unread

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_meanings
    from tickrig.host.canmon.model.columns.columns import Columns
else:  # numpy
    column_meanings = LazyModule("tickrig.host.canmon.model.columns.column_meanings")

_MANY: Final = 1_000
"""Default number of lines and columns without a terminal."""


@source_command(
    eds_option,
    span_option,
    cut_options,
    click.option("--jsonl", is_flag=True, help="Print one JSON object per node, at the end."),
)
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    eds: EdsOptions,
    span_us: int | None,
    cut: LogCut,
    jsonl: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Show all nodes: NMT state, heartbeat, boot-ups, drive state, EMCYs, SDO errors.

    The command only listens. It shows the heartbeat period from SDO traffic or an EDS, or else the
    period that it learns from the heartbeats (marked ~). An arrow shows a state that was commanded
    and is not confirmed yet. For a log file, the command shows the final state.

    \b
    canmon nodes can0
    canmon nodes can0 --eds 3=drive.eds --for 5s --jsonl
    canmon nodes run.log --to 2.5

    Keys: q quit.

    {source}
    """  # noqa: D301 - click wants the backspace
    found = read_eds_files(eds)
    view, log = _NodesView(found), block_log(source, cut)
    whole = log is not None and view.decoder.standard and take_blocks(log, view.take_block, span_us)
    frames = (log if whole else None) or open_source(source, BusOptions(**options), cut)
    with closing(frames):
        if not isinstance(frames, BlockLog):
            view = view if log is None else _NodesView(found)
            follow(frames, source, view.take, span_us, None if jsonl else view.painted)
        with until_unread():
            for line in view.json(live=frames.live) if jsonl else view.lines(live=frames.live):
                click.echo(line)
    report(frames, strict)
    expect_frames(frames)


class _NodesView:
    """A node board with its decoder and its display.

    Args:
        eds: content of EDS files by node-ID. These nodes are on the board from the beginning.

    Attributes:
        decoder: decoder of the frames for the board.
    """

    def __init__(self, eds: dict[int, EdsObjects]) -> None:
        self.decoder = make_decoder(eds)
        self._board = NodeBoard(self.decoder, {node: found.name for node, found in eds.items()})
        self._columns: column_meanings.ColumnNodes | None = None
        self._watch = Stopwatch()

    def take_block(self, columns: Columns) -> None:
        """Process a block of a log."""
        if self._columns is None:
            self._columns = column_meanings.ColumnNodes(self.decoder, self._board)
        self._columns.take(columns)

    def take(self, records: Sequence[Record]) -> None:
        """Process records."""
        for record in records:
            self._board.take(record, self.decoder.take(record))
        self._watch.take(records)

    def lines(self, *, live: bool) -> list[str]:
        """Return the table of nodes as lines that fit the terminal, or of full width for a file."""
        columns = _columns() if sys.stdout.isatty() else _MANY
        return render_board(self._board, self._now_us(live), columns, _MANY)

    def json(self, *, live: bool) -> list[str]:
        """Return the board as JSON, with one object per node."""
        return board_json(self._board, self._now_us(live))

    def painted(self, now_us: int, width: int, height: int) -> list[str]:
        """Return the board for a screen."""
        return render_board(self._board, now_us, width, height)

    def _now_us(self, live: bool) -> int:
        """Return the time at a live source, or the time of the last frame of a file."""
        return self._watch.now_us if live else self._board.now_us


def _columns() -> int:
    from shutil import get_terminal_size  # noqa: PLC0415 - slow, and no pipe wants it

    return get_terminal_size().columns
