"""The files of a conformance run, asked before it and written after it, and frames in them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, read_eds_objects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canopen.conform.bus.exchange import LEFT_OUT
from tickrig.host.canopen.conform.report.baseline import Baseline, baseline_text
from tickrig.host.canopen.conform.report.ci import badge, report_junit
from tickrig.host.canopen.conform.report.issue import issue_text
from tickrig.host.canopen.conform.report.overview import ShowFrames, frame_of, plain_frame
from tickrig.host.canopen.conform.verdict import Direction, FrameLine, Report
from tickrig.host.cli.messages import Refused, say
from tickrig.host.text.whole_file import check_file, check_not_read, write_whole

# The files of a conformance run: asked before it whether they can be, and written after it.

_HTML: Final = "--html"


def check_files(files: Mapping[str, Path]) -> None:
    """See whether the files could be written; Refused if one could not.

    Args:
        files: by the option that names it.
    """
    for option, path in files.items():
        try:
            check_file(path, option)
        except ValueError as error:
            raise Refused(str(error)) from None
    if _HTML in files and find_spec("jinja2") is None:
        raise Refused(f"{_HTML} needs Jinja2: pip install 'tickrig[report]'")
    places = [path.resolve() for path in files.values()]
    if len(set(places)) < len(places):
        raise Refused("two reports cannot go into one file")


def keep_inputs(files: Mapping[str, Path], inputs: Iterable[Path]) -> None:
    """See that no report goes into what the run reads; Refused if one would.

    Args:
        files: by the option that names it.
        inputs: what is read; what is no file is none.
    """
    read = tuple(inputs)
    for option, path in files.items():
        try:
            check_not_read(path, option, read)
        except ValueError as error:
            raise Refused(str(error)) from None


def write_files(
    report: Report, files: Mapping[str, Path], baseline: Baseline, show: ShowFrames
) -> bool:
    """Write the files; say which could not be, and return whether all could.

    Args:
        report: the run.
        files: by the option that names it.
        baseline: failures that are known.
        show: writes frames.
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
    """Return what the file that an option names holds.

    Args:
        option: `--html`, `--junit`, `--badge`, `--issue`, else the failures as a baseline.
        report: the run.
        baseline: failures that are known.
        show: writes frames.
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


# The frames of a conformance check, and what they mean: lines as `canmon dump` shows them.


def decoded_frames(eds: Mapping[int, Path | EdsObjects]) -> ShowFrames:
    """Return what writes the lines of a check; each call begins anew, knowing only the EDS.

    Between two checks there are frames that no evidence has: what was open or mapped in one
    says nothing of the next.

    Args:
        eds: an EDS, or what was read of one, by node-ID.

    Raises:
        OSError: an EDS cannot be read.
        EdsError: an EDS is malformed.
    """
    known = {
        node: read_eds_objects(item, node) if isinstance(item, Path) else item
        for node, item in eds.items()
    }

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
