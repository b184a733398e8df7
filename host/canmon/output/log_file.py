"""A log file that a verb writes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.output.filtered_decoder import DecodedFrame
from tickrig.host.canmon.sources.source_spec import FileSpec, parse_source
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.log_file import LogError, LogFormatError
from tickrig.host.monitor.logs.log_writer import in_blocks, write_log
from tickrig.host.monitor.logs.mark import Mark

BLOCK_S: Final = 1.0
"""What a compressed log may lose if this program is killed."""


class LogFile:
    """A log under way.

    Args:
        path: the file; one that exists is replaced.
        source: SOURCE words of what is read meanwhile.

    Raises:
        Refused: the name tells no format, the format needs what is not there, or the file is
            read meanwhile.
        SourceFailed: it cannot be written, now or later.
    """

    def __init__(self, path: Path, source: Sequence[str]) -> None:
        self._path, self._due_s = path, 0.0
        read = (
            parsed.path for word in source if isinstance(parsed := parse_source(word), FileSpec)
        )
        if path.exists() and any(one.exists() and one.samefile(path) for one in read):
            raise Refused(f"{path} is read, so it cannot be written")
        try:
            self._writer = write_log(path)
        except (LogFormatError, LogError) as error:
            raise Refused(str(error)) from None
        except OSError as error:
            raise SourceFailed(f"{path}: {error.strerror}") from error

    def take(
        self, decoded_frames: Sequence[DecodedFrame], lost: int, marks: Sequence[Mark] = ()
    ) -> None:
        """Add frames; what came is with the operating system then."""
        try:
            for record, _ in decoded_frames:
                assert isinstance(record, Record), "who opens serial ports does not write a log"
                self._writer.write(record)
            for mark in marks:
                self._writer.mark(mark)
            if decoded_frames and time.monotonic() >= self._due_s:
                self._writer.flush()
                if in_blocks(self._path):
                    self._due_s = time.monotonic() + BLOCK_S
        except OSError as error:
            raise SourceFailed(f"{self._path}: {error.strerror}") from error

    def close(self) -> None:
        """End the log, and say what it could not hold."""
        try:
            self._writer.close()
        except OSError as error:
            raise SourceFailed(f"{self._path}: {error.strerror}") from error
        for word in self._writer.messages():
            click.echo(word, err=True)
