"""The verb `report`, which shows the traffic of a bus as one page."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from platform import python_version
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig._version import __version__
from tickrig.host.canmon.model.check import diagnosis, learnt
from tickrig.host.canmon.model.decode.dbc_file import DbcFile
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.canmon.model.survey import Survey, excerpts
from tickrig.host.canmon.model.traffic import BitRates
from tickrig.host.canmon.output import listening, report_page
from tickrig.host.canmon.sources.source import (
    AnySource,
    BlockLog,
    LogCut,
    Source,
    block_log,
    open_source,
)
from tickrig.host.canmon.verbs import decode_options
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, SourceFailed, refusing
from tickrig.host.cli.options import PATH
from tickrig.host.text.whole_file import check_file, write_whole

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_survey
    from tickrig.host.canmon.model.columns.columns import Columns
else:  # numpy
    column_survey = LazyModule("tickrig.host.canmon.model.columns.column_survey")

_RULE_FILE: Final = ".toml"
_MOST_AROUND: Final = 200
"""Number of findings that are shown with their frames."""


@decode_options.source_command(
    decode_options.decode_options,
    click.option(
        "-o", "page", type=PATH, metavar="FILE", help="Write the page to FILE, such as run.html."
    ),
    click.option("--pdf", type=PATH, metavar="FILE", help="Write the page as PDF; needs Chromium."),
    click.option(
        "--png", type=PATH, metavar="FILE", help="Write the page as a PNG picture; needs Chromium."
    ),
    click.option("--title", metavar="TEXT", help="Title of the page.  [name of the log]"),
    click.option(
        "--around",
        type=click.IntRange(0, 100),
        default=10,
        show_default=True,
        help="Frames to show before and after a finding.",
    ),
    listening.span_option,
    decode_options.cut_options,
)
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    eds: decode_options.EdsOptions,
    dbc: Sequence[Path],
    page: Path | None,
    pdf: Path | None,
    png: Path | None,
    title: str | None,
    around: int,
    span_us: int | None,
    cut: LogCut,
    strict: bool,
    **options: Any,
) -> None:
    """Write the traffic of a bus as one self-contained HTML page.

    The page has a summary, the findings of the rules with the frames around them, a timeline with a
    lane for each node and signal, the nodes and the CAN-IDs. It loads nothing from a network, so
    you can mail it. Names of signals come from --eds, --dbc or SDO traffic. A load in percent needs
    -b.

    \b
    canmon report run.log -o run.html
    canmon report run.blf -o run.html --eds 3=drive.eds -b 500000
    canmon report next.log good.toml -o next.html
    canmon report run.log --from 2.5 --to 30 -o part.html
    canmon report can0 --for 60s -o bus.html --pdf bus.pdf

    A bus is recorded first, until Ctrl-C or for the time of --for. The log is checked against the
    rules of a file that canmon check --init wrote, such as good.toml.

    {source}
    """  # noqa: D301 - click wants the backspace
    outputs = {"-o": page, "--pdf": pdf, "--png": png}
    with refusing():
        _check_outputs(outputs)
    rules = _learnt([Path(word) for word in source if word.endswith(_RULE_FILE)])
    source = [word for word in source if not word.endswith(_RULE_FILE)]
    bus, objects = BusOptions(**options), decode_options.read_eds_files(eds)
    rates, words = listening.bit_rates_of(source, bus), _named(source)
    with TemporaryDirectory(prefix="canmon-") as folder:
        read = _Reading(source, bus, Path(folder), span_us, cut)
        try:
            seen = read.whole(lambda: _Seen(objects, dbc, rates, rules))
            verdict = _verdict(seen, read, around)
        finally:
            read.source.close()
        about = [
            (f"Written by canmon (tickrig) {__version__} on Python {python_version()}:", ""),
            ("Command:", shlex.join(["canmon", *sys.argv[1:]])),
            *((text, "") for text in [*read.source.messages(), read.source.failed] if text),
        ]
        head = report_page.ReportHead(title or words, words, about, rates.nominal)
        _write(outputs, report_page.report_page(seen.survey, verdict, head), Path(folder))
    for line in report_page.summary(seen.survey, verdict, head):
        click.echo(line)
    listening.report(read.source, strict)
    listening.expect_frames(read.source)


def _named(words: Sequence[str]) -> str:
    """Return the name of a source on a page. A log has its file name without the folder."""
    return ", ".join(Path(word).name if Path(word).is_file() else word for word in words) or "bus"


def _learnt(files: Sequence[Path]) -> learnt.Learnt | None:
    """Return the rules learnt from a good log, or None without a file."""
    if len(files) > 1:
        raise Refused(f"learnt rules are held alone: leave {files[1]} out")
    for path in files:
        with refusing("rules", path=path):
            found = learnt.parse_learnt(path.read_text("utf-8"))
        if found is None:
            raise Refused(
                f"rules {path}: no [learnt]: a report takes what canmon check --init writes;"
                " hold other rules with canmon check"
            )
        return found
    return None


def _check_outputs(outputs: Mapping[str, Path | None]) -> None:
    """Raise ValueError unless all requested files can be written."""
    if not any(outputs.values()):
        raise ValueError("no file: give -o run.html, --pdf run.pdf or --png run.png")
    for option, path in outputs.items():
        if path is None:
            continue
        check_file(path, option)
        if option != "-o":
            kind = f".{option[2:]}"
            if path.suffix.lower() != kind:
                raise ValueError(f"{option} {path}: the name does not end in {kind}")
            report_page.browser()


def _write(outputs: Mapping[str, Path | None], text: str, folder: Path) -> None:
    page = outputs["-o"] or folder / "page.html"
    try:
        write_whole(page, text)
        for path in (outputs["--pdf"], outputs["--png"]):
            if path is not None:
                report_page.print_page(page, path)
    except OSError as error:
        raise SourceFailed(f"{error.filename or page}: {error.strerror}") from error
    except report_page.BrowserError as error:
        raise SourceFailed(str(error)) from None


def _verdict(seen: _Seen, read: _Reading, around: int) -> report_page.Verdict:
    """Return the findings. The first findings have the frames around them."""
    shown = seen.diagnosis.faults[:_MOST_AROUND] if around else ()
    numbers = [one.frames[0].number for one in shown if one.frames]
    found = seen.around(numbers, around) if seen.in_columns else read.around(numbers, around)
    return report_page.Verdict(seen.diagnosis, seen.decoder.take_excerpts(found))


class _Seen:
    """The results for a log: a survey, and a diagnosis.

    Attributes:
        survey: survey of the log.
        decoder: decoder of the survey.
        diagnosis: faults, found by all rules that need no parameter, and by learnt rules.
        in_columns: whether the log was read in blocks.
    """

    def __init__(
        self,
        objects: Mapping[int, EdsObjects],
        dbc: Sequence[Path],
        rates: BitRates,
        rules: learnt.Learnt | None,
    ) -> None:
        self.decoder = decode_options.decoder_of(objects, dbc)
        names = {node: found.name for node, found in objects.items()}
        self.survey = Survey(self.decoder, names, rates)
        self.diagnosis, self.in_columns = diagnosis.Diagnosis((), (), {}, 0), False
        self._diagnoser = diagnosis.Diagnoser(rates.nominal, objects, rules=rules)

    def by_columns(self, log: BlockLog) -> bool:
        """Process a log in blocks of columns, or return False if it must be read frame by frame."""
        feed = column_survey.ColumnSurvey(self.decoder, self.survey)

        def take(block: Columns) -> None:
            feed.take(block)
            self._diagnoser.take(block)

        if not listening.take_blocks(log, take):
            return False
        self._end(log)
        self.in_columns = True
        return True

    def by_frames(self, source: Source) -> None:
        """Process a log frame by frame."""

        def take(records: Sequence[Record]) -> None:
            for record in records:
                self.survey.follow(record)
            self._diagnoser.take(records)

        with listening.until_interrupted():
            listening.listen(source, take, None)
        self._end(source)

    def around(self, numbers: Sequence[int], frames: int) -> Mapping[int, tuple[int, list[Record]]]:
        """Return the frames around frames by their numbers, as `excerpts` does."""
        return {number: self._diagnoser.kept.around(number, frames) for number in numbers}

    def _end(self, source: AnySource[Any]) -> None:
        self.survey.end()
        self._diagnoser.without_errors = source.without_errors
        lost = [f"{source.lost} frames were lost"] if source.lost else []
        self.diagnosis = self._diagnoser.diagnosis(lost, source.errors())


class _Reading:
    """A source that is read to its end. A bus is recorded into a file first.

    The log is read a second time, frame by frame, for the frames around findings.

    Args:
        words: SOURCE words that name the source.
        bus: options of the buses.
        folder: folder for the recording.
        span_us: time to listen to a bus, or None to listen until the user interrupts.
        cut: part of a log to read.

    Attributes:
        source: source of the first reading, closed at the end of the reading.
    """

    def __init__(
        self,
        words: Sequence[str],
        bus: BusOptions,
        folder: Path,
        span_us: int | None,
        cut: LogCut,
    ) -> None:
        self._words, self._bus, self._cut = list(words), bus, cut
        self.source: AnySource[Any] = open_source(words, bus, cut)
        self._recorded = self.source.live
        if span_us is not None and not self._recorded:
            raise Refused("--for is how long a bus is recorded: leave it out for a log")
        if self._recorded:
            self._words, self._cut = [str(folder / "bus.log")], LogCut()
            self._record(Path(self._words[0]), span_us)

    def whole(self, make: Callable[[], _Seen]) -> _Seen:
        """Read the whole source."""
        seen, log = make(), block_log(self._words, self._cut)
        if log is not None and _in_columns(seen.decoder):
            with closing(log):
                if seen.by_columns(log):
                    if not self._recorded:
                        self.source = log
                    return seen
            seen = make()
        frames = open_source(self._words, self._bus) if self._recorded else self.source
        with closing(frames):
            seen.by_frames(frames)
        return seen

    def around(self, numbers: Sequence[int], frames: int) -> Mapping[int, tuple[int, list[Record]]]:
        """Return the frames around frames by their numbers, as `excerpts` does."""
        return excerpts(self._pieces(), numbers, frames) if numbers else {}

    def _pieces(self) -> Iterator[Sequence[Record]]:
        source = open_source(self._words, self._bus, self._cut)
        with closing(source):
            while not source.ended:
                yield source.poll(0)

    def _record(self, path: Path, span_us: int | None) -> None:
        with closing(write_log(path)) as writer, listening.until_interrupted():

            def take(records: Sequence[Record]) -> None:
                for record in records:
                    writer.write(record)

            listening.listen(self.source, take, span_us)


def _in_columns(decoder: Decoder) -> bool:
    """Return whether only DBC files decode before the standard does."""
    return all(isinstance(one, DbcFile) for one in decoder.first)
