"""A log file that is read in blocks, where that is faster than frame by frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.logs.tally import Tally
from tickrig.host.canmon.sources.file_source import check_readable
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.sources.source_spec import FileSpec, parse_source

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns.columns import Columns

SMALL_BYTES: Final = 1 << 20
"""Below it a log is read frame by frame sooner than numpy is imported."""


class BlockLog(AnySource["Columns"]):
    """A log file as columns, a block at each poll; it holds no more than that.

    Attributes:
        no_columns: it ends before its time, for it is to be read frame by frame.

    Raises:
        SourceFailed: the file cannot be read.
    """

    no_columns = False

    def __init__(self, path: Path) -> None:
        from tickrig.host.canmon.model.columns.column_reader import read_columns  # noqa: PLC0415 - numpy

        check_readable(path)
        self._path, self._reader = path, read_columns(path)
        self._blocks = iter(self._reader)

    def tallies(self) -> Iterable[tuple[str, Tally]]:
        """Return the tally of the file."""
        return [(str(self._path), self._reader.tally)]

    def poll(self, timeout_us: int, /) -> list[Columns]:
        """Return the next block; it never waits."""
        from tickrig.host.canmon.model.columns.columns import NoColumnsError  # noqa: PLC0415 - numpy

        try:
            return [next(self._blocks)]
        except StopIteration:
            pass
        except NoColumnsError:
            self.no_columns = True
        except LogError as error:
            self.failed = str(error)
        except OSError as error:
            self.failed = f"{self._path}: {error.strerror or error}"
        self._ended = True
        return []


def block_log(words: Sequence[str]) -> BlockLog | None:
    """Open the log that SOURCE words name; None if it is better read frame by frame.

    Raises:
        Refused: words that name nothing.
        SourceFailed: a file that cannot be read.
    """
    if len(words) != 1 or find_spec("numpy") is None:
        return None
    word = parse_source(words[0])
    if not isinstance(word, FileSpec) or word.chosen is not None:
        return None
    try:
        return BlockLog(word.path) if word.path.stat().st_size >= SMALL_BYTES else None
    except OSError:
        return None  # who reads it frame by frame says so
