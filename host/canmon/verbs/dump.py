"""The verb `dump`, which prints arriving frames, one per line."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from itertools import islice
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import DumpLines, Stamp
from tickrig.host.canmon.model.recorder.files import RecordingPlan
from tickrig.host.canmon.model.recorder.recorder import FilterTrigger
from tickrig.host.canmon.output import printer
from tickrig.host.canmon.output.listening import (
    bit_rates_of,
    expect_frames,
    report,
    say_marks,
    until_interrupted,
)
from tickrig.host.canmon.output.printer import DecodedFrame, FilteredDecoder
from tickrig.host.canmon.output.recording import (
    NAMES,
    LogFile,
    RecordingOptions,
    recording_options,
    whole_log,
)
from tickrig.host.canmon.sources.source import (
    AnySource,
    LineSpec,
    LogCut,
    PieceLog,
    is_live,
    open_any,
    open_source,
    parse_source,
    piece_log,
)
from tickrig.host.canmon.verbs import decode_options
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, until_unread
from tickrig.host.cli.options import PATH, Choice, add_options, refuse_idle
from tickrig.host.cli.start import INTERRUPTED
from tickrig.host.links.ready import ready

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_text
    from tickrig.host.canmon.model.columns import columns as column_blocks
    from tickrig.host.canmon.model.frames import AnyRecord
    from tickrig.host.canmon.model.logs.log_file import Mark
    from tickrig.host.canmon.model.logs.log_writer import TextBlock
else:  # numpy
    column_text = LazyModule("tickrig.host.canmon.model.columns.column_text")
    column_blocks = LazyModule("tickrig.host.canmon.model.columns.columns")


# Triggers by hand: Enter in the terminal, or a signal.

_KEY: Final = "key"
_STDIN: Final = 0


class _TriggerKeys:
    """A wait for Enter on standard input, if it is a terminal, and for SIGUSR1.

    Args:
        typed: whether to wait for Enter, or False if standard input is recorded.
    """

    def __init__(self, typed: bool) -> None:
        self._typed = typed and sys.platform != "win32" and os.isatty(_STDIN)
        self._signals = 0

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Receive signals while the block runs."""
        if sys.platform == "win32":
            yield
        else:  # mypy leaves out the branch of the other system
            before = signal.signal(signal.SIGUSR1, self._signalled)
            # a job in the background that reads its terminal would be stopped
            ignored = signal.signal(signal.SIGTTIN, signal.SIG_IGN)
            try:
                yield
            finally:
                signal.signal(signal.SIGUSR1, before)
                signal.signal(signal.SIGTTIN, ignored)

    def pressed(self) -> str:
        """Return what was pressed since the last call, empty if nothing was pressed."""
        if self._signals:
            self._signals = 0
            return "SIGUSR1"
        if not self._typed or not ready([_STDIN], wait_s=0)[0]:
            return ""
        try:
            typed = os.read(_STDIN, 1_024)
        except OSError:
            typed = b""
        self._typed = bool(typed)  # at its end no more input comes
        return _KEY if b"\n" in typed else ""

    def _signalled(self, number: int, frame: FrameType | None) -> None:
        self._signals += 1


_POLL_US: Final = 100_000

_Take = Callable[[list[printer.DecodedFrame], int, "Sequence[Mark]"], bool]
"""Function that takes frames, the number of lost frames, and later events.

The function returns whether to end.
"""

_shown: Final = add_options(
    click.option(
        "-t",
        "stamp",
        type=Choice([stamp.value for stamp in Stamp if stamp]),
        help="Print times: (a)bsolute, (d)elta, (z)ero at the first frame, (A)bsolute with date.",
    ),
    click.option("-x", "extra", is_flag=True, help="Show the direction, RX or TX."),
    click.option(
        "-e", "errors", is_flag=True, help="Describe error frames in words, also with --raw."
    ),
    click.option("-r", "--raw", is_flag=True, help="Show only bytes, in candump format."),
    click.option(
        "-L", "output", flag_value="log", help="Print lines of a log, in candump -L format."
    ),
    click.option("--jsonl", "output", flag_value="jsonl", help="Print one JSON object per line."),
    click.option("--csv", "output", flag_value="csv", help="Print CSV rows with a header."),
    click.option(
        "-l",
        "file",
        type=PATH,
        metavar="FILE",
        help="Record to FILE, such as run.blf; print nothing.",
    ),
)
_ending: Final = add_options(
    decode_options.cut_options,
    decode_options.reopen_option,
    click.option("-n", "count", type=click.IntRange(1), metavar="N", help="End after N frames."),
    click.option(
        "-T",
        "quiet_ms",
        type=click.IntRange(1),
        metavar="MS",
        help="End after MS milliseconds without a frame.",
    ),
)


@decode_options.source_command(
    _shown, recording_options, decode_options.filter_option, decode_options.decode_options, _ending
)
def dump(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    stamp: str | None,
    extra: bool,
    errors: bool,
    raw: bool,
    output: str | None,
    file: Path | None,
    wanted: str | None,
    eds: decode_options.EdsOptions,
    dbc: Sequence[Path],
    cut: LogCut,
    count: int | None,
    quiet_ms: int | None,
    reopen: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Show frames as they come, and what they mean.

    The command only listens. Frames are decoded by the CANopen standard, by --eds and --dbc, and by
    the SDO traffic on the bus. Frames go to standard output. Lost and invalid frames are reported
    on standard error.

    \b
    canmon dump can0 -t z
    canmon dump can0 --eds 3=drive.eds -F 'node=3 and (pdo or emcy)'
    canmon dump can0 -l run.blf
    canmon dump can0 -l run.log.gz --rotate 100M --rotate 1h --disk 10G
    canmon dump can0 -l fault.log --trigger emcy --pre 10s --post 2s
    canmon dump can0 -l fault.log --trigger rules.toml --trigger 'statusword.fault'
    canmon dump run.asc.gz -L > run.log
    canmon dump run.log --from 2.5 --to 3 -t a
    ssh robot canmon dump can0 --jsonl | canmon top -

    A recording in parts has an index, such as run.index.jsonl. The same command continues the
    recording. A recording that waits for a trigger also accepts Enter and SIGUSR1. A recording
    waits for a bus that goes away.

    {source}
    """  # noqa: D301 - click wants the backspace
    if file is not None and output:
        raise Refused("-l shows nothing: it goes without -L, --jsonl and --csv")
    given = {name: options.pop(name) for name in NAMES}
    if file is None and (named := next((name for name in NAMES if given[name]), "")):
        raise Refused(f"--{named.replace('_', '-')} goes with -l FILE")
    if (file is not None or output == printer.DumpFormat.LOG) and any(map(_is_line, source)):
        raise Refused(
            "a log holds frames alone: a serial port is shown, or goes into --jsonl, --csv"
        )
    _refuse_idle(source, output, file, raw=raw, filtered=wanted is not None)
    chosen, form = decode_options.read_filter(wanted), printer.DumpFormat(output or "")
    bus = BusOptions(**options)
    bit_rate = bit_rates_of(source, bus).nominal
    recording = None if file is None else RecordingOptions(file, given, bit_rate)
    decodes = recording is not None and recording.decodes
    plain = (raw or form is printer.DumpFormat.LOG or file is not None) and not decodes
    decoder = None if plain and chosen is None else decode_options.make_decoder(eds, dbc)
    kept = None
    if recording is not None and recording.triggers and chosen is not None:
        kept, chosen = FilterTrigger(wanted or "", chosen), None  # triggers see all frames
    meaning = printer.FilteredDecoder(decoder, chosen)
    cut = meaning.learning(cut)
    lines = DumpLines(Stamp(stamp or ""), extra)
    writer = printer.StdoutWriter(printer.printer_of(form, lines, plain, errors), form)
    take: _Take = writer.take
    alike = (
        form in (printer.DumpFormat.TEXT, printer.DumpFormat.LOG) and file is None and not errors
    )
    if alike and chosen is None and count is None and (pieces := piece_log(source, cut)):
        _pass_pieces(pieces, meaning, writer, printer.BlockPrinter(form, lines, decoder))
        report(pieces, strict)
        expect_frames(pieces)
        return
    with ExitStack() as held:
        frames = held.enter_context(closing(open_any(source, bus, cut)))
        if reopen or (recording is not None and recording.plan.numbered):
            frames.reopen()
        if recording is not None:
            keys = None
            if recording.plan.around is not None:
                keys = _TriggerKeys("-" not in source)
                held.enter_context(keys.watching())  # before there is a file: it is a sign to send
            log = LogFile(recording.plan, source, frames.live, recording.triggers, kept)
            held.enter_context(closing(log))
            take = log.take if keys is None else _with_keys(log, keys)
        with until_interrupted() as signals, until_unread():
            # a block of a log is written whole; who prints may wait for its reader for ever
            whole = take if recording is None else signals.behind(take)
            _pass_on(frames, meaning, whole, count, quiet_ms)
    report(frames, strict, meaning.messages())
    if not signals.came:
        expect_frames(frames, meaning)


_TEXT_ONLY: Final = ("stamp", "extra")
_DECODES: Final = ("eds", "eds_folders", "dbc")


def _refuse_idle(
    source: Sequence[str], output: str | None, file: Path | None, *, raw: bool, filtered: bool
) -> None:
    """Raise Refused for options without an effect."""
    if file is not None:
        refuse_idle("-l shows nothing", *_TEXT_ONLY, "errors", "raw")
    elif output:
        option = "-L" if output == printer.DumpFormat.LOG else f"--{output}"
        refuse_idle(f"{option} writes all of a frame, with its time", *_TEXT_ONLY)
        if output == printer.DumpFormat.LOG:
            refuse_idle("-L writes only bytes", "errors", "raw")
    if not filtered and file is None and (raw or output == printer.DumpFormat.LOG):
        refuse_idle("only bytes are shown, and no -F needs their meaning", *_DECODES)
    if source and not any(map(is_live, source)):
        refuse_idle("a log ends by itself", "quiet_ms")


def _pass_pieces(
    log: PieceLog,
    meaning: printer.FilteredDecoder,
    writer: printer.StdoutWriter,
    blocks: printer.BlockPrinter,
) -> None:
    """Print a large log whose frames are all wanted."""
    with closing(log), until_interrupted(), until_unread():
        for piece in log.pieces():
            if isinstance(piece, Sequence):
                writer.take(list(meaning.take(piece)), log.lost, log.marks)
            elif len(piece) and column_text.fits(piece):
                writer.take_block(blocks.texts(piece), log.lost)
            else:
                writer.take(list(meaning.take(column_blocks.records(piece))), log.lost)


def _with_keys(log: LogFile, keys: _TriggerKeys) -> _Take:
    """Return a function that takes frames and checks for keys."""

    def take(decoded_frames: list[printer.DecodedFrame], lost: int, marks: Sequence[Mark]) -> bool:
        ended = log.take(decoded_frames, lost, marks)
        if why := keys.pressed():
            log.trigger(why)
        return ended

    return take


def _is_line(word: str) -> bool:
    return isinstance(parse_source(word), LineSpec)


def _pass_on(
    source: AnySource[AnyRecord],
    meaning: printer.FilteredDecoder,
    take: _Take,
    count: int | None = None,
    quiet_ms: int | None = None,
) -> None:
    """Pass on frames until the source ends, `count` frames came, or none came for `quiet_ms`."""
    quiet_s = quiet_ms / 1e3 if quiet_ms else float("inf")
    latest_s, left = time.monotonic(), count
    while not source.ended and left != 0:
        records = source.poll(min(_POLL_US, (quiet_ms or _POLL_US) * 1_000))
        decoded_frames = list(islice(meaning.take(records), left))
        say_marks(source)
        if take(decoded_frames, source.lost, source.marks):
            break
        left = None if left is None else left - len(decoded_frames)
        if records:
            latest_s = time.monotonic()
        elif time.monotonic() - latest_s >= quiet_s:
            break


# The verb `conv`: log files into another.


@click.command()
@click.argument("source", nargs=-1, metavar="SOURCE...")
@click.argument("log", type=PATH)
@decode_options.filter_option
@decode_options.cut_options
@decode_options.decode_options
@decode_options.strict_option
def conv(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    log: Path,
    wanted: str | None,
    cut: LogCut,
    eds: decode_options.EdsOptions,
    dbc: Sequence[Path],
    strict: bool,
) -> None:
    """Write the content of SOURCE into the file LOG.

    The suffix of LOG selects the format. Several files are merged by time. Items that the format
    cannot hold are reported on standard error. If each SOURCE is a file, LOG is written completely
    or not at all.

    \b
    canmon conv a.blf b.log
    canmon conv left.log right.asc.gz both.log
    canmon conv run.log,123:7FF run.csv
    canmon conv run.log faults.log -F 'emcy or error'
    canmon conv run.log part.blf --from 2.5 --to 3

    {source}
    """  # noqa: D301 - click wants the backspace
    if not source:  # click takes the last word as LOG
        raise click.UsageError("Missing argument 'LOG'.")
    if wanted is None:
        refuse_idle("a log holds only bytes, and no -F needs their meaning", *_DECODES)
    chosen = decode_options.read_filter(wanted)
    decoder = None if chosen is None else decode_options.make_decoder(eds, dbc)
    meaning = FilteredDecoder(decoder, chosen)
    cut = meaning.learning(cut)
    pieces = piece_log(source, cut) if chosen is None else None
    frames = pieces or open_source(source, cut=cut)
    with closing(frames), whole_log(log, source) as place:
        with (
            closing(LogFile(RecordingPlan(path=place), source, kept=place == log)) as out,
            until_interrupted() as signals,
        ):
            if pieces is None:
                _pass_on(frames, meaning, signals.behind(out.take))
            else:
                _convert_pieces(pieces, signals.behind(out.take), signals.behind(out.take_block))
        if signals.came and place != log:
            raise click.exceptions.Exit(INTERRUPTED)
    report(frames, strict, meaning.messages())
    expect_frames(frames, meaning)


def _convert_pieces(
    log: PieceLog,
    take: Callable[[list[DecodedFrame], int, Sequence[Mark]], bool],
    take_block: Callable[[TextBlock], bool],
) -> None:
    """Convert a large log whose frames are all wanted."""
    for piece in log.pieces():
        if isinstance(piece, Sequence):
            take([(record, None) for record in piece], log.lost, log.marks)
        elif len(piece) and not (
            column_text.fits(piece) and take_block(column_text.ColumnText(piece))
        ):
            take([(record, None) for record in column_blocks.records(piece)], log.lost, log.marks)


decode_options.explained(conv)
