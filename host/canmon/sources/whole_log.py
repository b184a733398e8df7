"""A log file that is read at once, where that is faster than frame by frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.sources.source_spec import FileSpec, parse_source
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.log_file import LogError
from tickrig.host.monitor.logs.tally import Tally
from tickrig.host.monitor.traffic.traffic import Snapshot

if TYPE_CHECKING:
    from tickrig.host.monitor.columns.columns import Columns

SMALL_BYTES: Final = 1 << 20
"""Below it a log is read frame by frame sooner than numpy is imported."""


class WholeLog(AnySource[Record]):
    """All of a log file, as a source whose end is reached.

    Attributes:
        columns: its frames.
    """

    _ended = True

    def __init__(self, path: Path, columns: Columns) -> None:
        self._name, self.columns = str(path), columns

    def tallies(self) -> Iterable[tuple[str, Tally]]:
        """Return the tally of the file."""
        return [(self._name, self.columns.tally)]

    def snapshot(self) -> Snapshot:
        """Return the statistics of all frames."""
        from tickrig.host.monitor.columns.column_traffic import snapshot_of  # noqa: PLC0415 - numpy

        return snapshot_of(self.columns)


def whole_log(words: Sequence[str]) -> WholeLog | None:
    """Read the log that SOURCE words name; None if it is better read frame by frame.

    Raises:
        Refused: words that name nothing.
        SourceFailed: a file that cannot be read.
    """
    path = _large_log(words)
    if path is None:
        return None
    from tickrig.host.monitor.columns.column_reader import read_columns  # noqa: PLC0415 - numpy
    from tickrig.host.monitor.columns.columns import NoColumnsError  # noqa: PLC0415 - numpy

    try:
        return WholeLog(path, read_columns(path))
    except NoColumnsError:
        return None
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror}") from error
    except LogError as error:
        raise SourceFailed(str(error)) from error


def _large_log(words: Sequence[str]) -> Path | None:
    if len(words) != 1 or find_spec("numpy") is None:
        return None
    word = parse_source(words[0])
    if not isinstance(word, FileSpec) or word.chosen is not None:
        return None
    try:
        return word.path if word.path.stat().st_size >= SMALL_BYTES else None
    except OSError:
        return None  # who reads it frame by frame says so
