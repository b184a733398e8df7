"""One call of `canmon conform`: opening the source, asking the user, running checks, reporting."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.canmon.conform.chosen import check_chosen, patterns, unknown
from tickrig.host.canmon.conform.conform_source import RIG_FILE, ConformSource, open_conform_source
from tickrig.host.canmon.conform.stimulus import (
    CONTROL,
    Consent,
    Progress,
    list_nodes,
    nodes_heard,
    open_stimulus,
)
from tickrig.host.canmon.eds_document import chosen_eds, read_device_document
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.output.listening import until_interrupted
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.conform.binding.capabilities import NodeDescription
from tickrig.host.canopen.conform.bus.exchange import LEFT_OUT
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline, baseline_text
from tickrig.host.canopen.conform.report.ci import badge, report_junit
from tickrig.host.canopen.conform.report.issue import issue_text
from tickrig.host.canopen.conform.report.overview import ShowFrames, frame_of, plain_frame
from tickrig.host.canopen.conform.report.report_json import report_json
from tickrig.host.canopen.conform.report.text import text_report
from tickrig.host.canopen.conform.verdict import BUS_FAILED, Direction, FrameLine, Report
from tickrig.host.canopen.data_sheet.check import check, severities
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, refusing, say, until_unread
from tickrig.host.cli.options import VERSION
from tickrig.host.cli.start import INTERRUPTED
from tickrig.host.text.page_text import one_line
from tickrig.host.text.whole_file import check_file, check_not_read, write_whole

# The files of a conformance run: checked before it, and written after it.

_HTML: Final = "--html"


def _check_files(files: Mapping[str, Path]) -> None:
    """Check before the run that all output files of the command can be written.

    Args:
        files: path of each output file by its option, such as `--html`.

    Raises:
        Refused: a file cannot be written.
    """
    for option, path in files.items():
        with refusing():
            check_file(path, option)
    if _HTML in files and find_spec("jinja2") is None:
        raise Refused(f"{_HTML} needs Jinja2: pip install 'tickrig[report]'")
    places = [path.resolve() for path in files.values()]
    if len(set(places)) < len(places):
        raise Refused("two reports cannot go into one file")


def _keep_inputs(files: Mapping[str, Path], inputs: Iterable[Path]) -> None:
    """Check that no report overwrites an input of the run. Raise Refused if a report would.

    Args:
        files: path of each file by option.
        inputs: paths that are read. Paths that are not files are ignored.
    """
    read = tuple(inputs)
    for option, path in files.items():
        with refusing():
            check_not_read(path, option, read)


def _write_files(
    report: Report, files: Mapping[str, Path], baseline: Baseline, show: ShowFrames
) -> bool:
    """Write the files. Report files that fail, and return whether all files were written.

    Args:
        report: report of the run.
        files: path of each file by option.
        baseline: baseline of known failures.
        show: function that formats frames.
    """
    written = True
    for option, path in files.items():
        try:
            write_whole(path, file_text(option, report, baseline, show))
        except OSError as error:
            say(f"Error: {option} {path}: {error.strerror}")
            written = False
    return written


def file_text(option: str, report: Report, baseline: Baseline, show: ShowFrames) -> str:
    """Return the text of the output file that an option of `canmon conform` requests.

    Args:
        option: name of the option. The options `--html`, `--junit`, `--badge` and `--issue` each
            request a report in a different form. The option `--write-baseline` requests a baseline
            file, which lists the failures of the run.
        report: report of the run.
        baseline: failures that the user has declared as known. Only the reports use them.
        show: function that formats the recorded frames as lines.
    """
    match option:
        case "--html":
            from tickrig.host.canopen.conform.report.page import html_page  # noqa: PLC0415 - an extra

            return html_page(report, baseline, show)
        case "--junit":
            return report_junit(report, baseline, show)
        case "--badge":
            return badge(report, baseline)
        case "--issue":
            return issue_text(report, baseline, show)
        case _:
            return baseline_text(report)


# The decoded frames of a conformance check, as in `canmon dump`.


def decoded_frames(eds: Mapping[int, Path]) -> ShowFrames:
    """Return a function that formats the recorded frames of a check and their meaning.

    Each call of the returned function decodes the frames of one check. At the beginning of a call,
    the decoder knows only the content of the EDS. It does not know the SDO transfers and PDO
    mappings of earlier checks, because the frames between two checks are not recorded.

    Args:
        eds: EDS file, or the objects that were read from it, by node-ID.

    Raises:
        OSError: an EDS cannot be read.
        EdsError: an EDS is malformed.
    """
    known = {node: read_eds_objects(path, node) for node, path in eds.items()}

    def show(lines: Sequence[FrameLine]) -> list[str]:
        shown, decoder = list[str](), Decoder(known)
        for line in lines:
            if line.direction is Direction.REMARK and line.text.endswith(LEFT_OUT):
                decoder = Decoder(known)
            shown.append(plain_frame(line, _meaning(decoder, line)))
        return shown

    return show


def _meaning(decoder: Decoder, line: FrameLine) -> str:
    frame = None if line.direction is Direction.REMARK else frame_of(line)
    if frame is None:
        return ""
    record = Record(line.at_us, "", frame, sent=line.direction is Direction.SENT)
    return decoder.take(record).text


_FILES: Final = ("html", "junit", "badge", "issue", "write_baseline")


class Conformance:
    """One run of the command `canmon conform`, from its options to its report.

    Args:
        word: SOURCE argument of the command line, or None if the options name a bus.
        bus: bus options of the command line.
        options: values of the other options by name.

    Raises:
        Refused: the options are invalid, or contradict each other. No frame has been sent.
    """

    def __init__(self, word: str | None, bus: BusOptions, options: dict[str, Any]) -> None:
        self._word, self._bus, self._options = word, bus, options
        self._files: dict[str, Path] = {
            f"--{name.replace('_', '-')}": options[name] for name in _FILES if options[name]
        }
        _check_files(self._files)
        _keep_inputs(self._files, self._inputs())
        self._only = patterns(options["only"])
        self._baseline = _read_baseline(options["baseline"])
        self._allow = _indices("--allow", options["allow"])
        self._never = _indices("--never", options["never"])
        self._level = Level[options["level"].upper().replace("-", "_")]
        check_chosen(self._only, self._level)
        moved_by: str | None = options["stimulus"]
        self._stimulus = None if moved_by is None else open_stimulus(moved_by)
        self._eds: Path | None = options["eds"] if isinstance(options["eds"], Path) else None
        self._document = read_device_document(self._eds, "--eds") if self._eds else None

    def _inputs(self) -> Iterator[Path]:
        """Yield the files that are read. A baseline may be overwritten."""
        options = self._options
        if self._word and self._word.lower().endswith(RIG_FILE):
            yield Path(self._word)
        if isinstance(options["eds"], Path):
            yield options["eds"]
        if options["baseline"] and options["baseline"] != options["write_baseline"]:
            yield options["baseline"]
        if options["stimulus"]:
            words = options["stimulus"].removeprefix(CONTROL)
            yield from map(Path, (words, *words.split()))

    def run(self) -> int:
        """Run the command. Return the exit status."""
        node_id: int | None = self._options["node"]
        if node_id is None and (self._files or self._options["as_json"]):
            raise Refused("--node is missing: it is needed for checks and reports")
        with ExitStack() as held:
            source = open_conform_source(self._word, node_id, self._bus)
            held.callback(source.close)
            if node_id is None:
                return list_nodes(source)
            _keep_inputs(self._files, map(Path, source.eds.values()))
            report = self._judge(source, node_id)
        return INTERRUPTED if report is None else self._show(report)

    def _judge(self, source: ConformSource, node_id: int) -> Report | None:
        """Return the report, or None if the run was interrupted before the start."""
        consent = Consent(
            yes=self._options["yes"], virtual=source.virtual, alone=len(source.nodes) == 1
        )
        plan = self._plan(source, node_id, consent)
        progress = Progress(shown=sys.stderr.isatty())
        known = self._describe(source, node_id)
        judged: list[Report] = []
        with until_interrupted():
            if not source.virtual and self._level > Level.READ_ONLY:
                heard = nodes_heard(source.link)
                heard.pop(node_id, None)
                consent.begin(node_id, self._level, heard)
            run = ConformRun(
                *(source.link, node_id, plan),
                device=known.device if known else None,
                claims=known.claims if known else None,
                source=source.name,
                on_result=progress.take,
            )
            source.watch(node_id, run)
            progress.begin(node_id)
            judged.append(run.run())
        progress.end()
        return self._completed(judged[0], source, known) if judged else None

    def _describe(self, source: ConformSource, node_id: int) -> NodeDescription | None:
        """Return what an EDS says about the node.

        The EDS is from --eds, --eds-dir, or the source.
        """
        if self._eds is None and self._options["eds"] is not None:
            self._eds = chosen_eds(self._options["eds"], NodeBus(source.link), node_id)
            self._document = read_device_document(self._eds, "--eds-dir") if self._eds else None
        if self._document is not None:
            return NodeDescription.of_file(self._document.file)
        return source.describe(node_id)

    def _completed(
        self, report: Report, source: ConformSource, known: NodeDescription | None
    ) -> Report:
        """Add data from outside the tester, such as versions, adapter, and findings in the EDS."""
        settings = {"tickrig": VERSION, "adapter": source.adapter, **report.settings}
        if known is None:
            return replace(report, settings=settings)
        document = self._document
        settings["EDS"] = Path(document.file.name if document else source.eds[report.node_id]).name
        if document is not None:
            settings["EDS findings"] = _findings(document)
        return replace(report, settings=settings, findings=(*known.wrong, *report.findings))

    def _plan(self, source: ConformSource, node_id: int, consent: Consent) -> ConformancePlan:
        options, stimulus = self._options, self._stimulus
        if stimulus is None and source.stimulus is not None:
            stimulus = source.stimulus(node_id)
        return ConformancePlan(
            level=self._level,
            only=self._only,
            allow=self._allow,
            never=self._never,
            bit_rate=source.bit_rate,
            max_load=options["max_load"] / 100,
            seed=options["seed"],
            stimulus=stimulus,
            confirm=consent.confirm,
            shared_host=source.shared_host,
        )

    def _show(self, report: Report) -> int:
        """Write all requested files. Return the exit status."""
        eds = {} if self._eds is None else {report.node_id: self._eds}
        with until_unread():
            if self._options["as_json"]:
                click.echo(report_json(report, self._baseline), nl=False)
            elif not report.absent:
                show = decoded_frames(eds)
                text = text_report(report, self._baseline, show, self._again(report))
                click.echo(text, nl=False)
        written = _write_files(report, self._files, self._baseline, decoded_frames(eds))
        if report.absent:
            say(f"Error: {report.aborted}")
            return report.exit_status if written else BUS_FAILED
        status = self._baseline.ends_with(report)
        return status if written or status else BUS_FAILED

    def _again(self, report: Report) -> str:
        """Return the command that repeats the run."""
        words = ["canmon", "conform", *([self._word] if self._word else []), *self._bus.arguments()]
        words += ["--node", str(report.node_id), f"--{report.level.word}"]
        words += ["--eds", str(self._eds)] if self._eds else []
        words += ["--stimulus", self._options["stimulus"]] if self._options["stimulus"] else []
        for name in ("allow", "never"):
            words += [word for index in self._options[name] for word in (f"--{name}", index)]
        words += ["--seed", str(self._options["seed"])] if self._options["seed"] else []
        return shlex.join(words)


def _read_baseline(path: Path | None) -> Baseline:
    if path is None:
        return NONE_KNOWN
    with refusing("--baseline"):
        baseline = Baseline.read(path)
    for text in unknown(sorted(baseline.known)):
        say(one_line(f"--baseline {path}: {text}"))
    return baseline


def _findings(document: Document) -> str:
    """Return the number of findings of `canmon eds check` in an EDS."""
    command = shlex.join(["canmon", "eds", "check", document.name])
    return f"{severities(check(document))}: {command}"


def _indices(option: str, words: Iterable[str]) -> frozenset[int]:
    return frozenset(_index(option, word) for word in words)


def _index(option: str, word: str) -> int:
    """Read an index, such as 6200h or 0x6200."""
    digits = word.lower().removeprefix("0x").removesuffix("h")
    try:
        index = int(digits, 16)
    except ValueError:
        index = -1
    if not 0x1000 <= index <= 0xFFFF:
        raise Refused(f"{option} {word!r} is no index as 6200h: 1000h to FFFFh")
    return index
