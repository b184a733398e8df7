"""Logs with chance in them, each as the page of a report: frame by frame and in blocks the same."""

from __future__ import annotations

from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from tests.host.canmon.model.logs import mutations as logs
from tickrig.host.canmon.model.check.diagnosis import Diagnoser
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.columns.column_survey import ColumnSurvey
from tickrig.host.canmon.model.columns.columns import Columns, NoColumnsError
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.survey import Survey
from tickrig.host.canmon.output.report_page import ReportHead, Verdict, report_page


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return the name and the bytes of a log, as for `tools/fuzz logs`."""
    return logs.mutated(chance)


def judge(name: str, data: bytes) -> str:
    """Write the page of a log; say whether the log was read to its end."""
    with TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(data)
        records, ended = logs.read(path)
        page = page_of_records(records)
        assert page.count("</script>") == 2
        try:
            blocks = list(read_columns(path))
        except (NoColumnsError, LogError):
            return ended
    assert page_of_blocks(blocks) == page
    return ended


def page_of_records(records: list[Record]) -> str:
    """Return the page of frames."""
    decoder = Decoder()
    survey, diagnoser = Survey(decoder), Diagnoser()
    for record in records:
        decoded = decoder.take(record)
        survey.count(record)
        survey.take(record, decoded)
        survey.take_signals(record, decoded)
    diagnoser.take(records)
    return _page(survey, diagnoser)


def page_of_blocks(blocks: list[Columns]) -> str:
    """Return the page of blocks."""
    decoder = Decoder()
    survey, diagnoser = Survey(decoder), Diagnoser()
    feed = ColumnSurvey(decoder, survey)
    for block in blocks:
        feed.take(block)
        diagnoser.take(block)
    return _page(survey, diagnoser)


def _page(survey: Survey, diagnoser: Diagnoser) -> str:
    survey.end()
    return report_page(survey, Verdict(diagnoser.diagnosis(), {}), ReportHead("log", "log", ()))
