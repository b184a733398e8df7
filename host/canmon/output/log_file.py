"""A log file, or a recording in parts, that a verb writes."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import LogError, LogFormatError, log_format
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.canmon.model.logs.mark import Mark
from tickrig.host.canmon.model.recorder.plan import Plan
from tickrig.host.canmon.model.recorder.recorder import Recorder
from tickrig.host.canmon.output.clocks import Stopwatch
from tickrig.host.canmon.output.filtered_decoder import DecodedFrame
from tickrig.host.canmon.sources.source_spec import FileSpec, parse_source
from tickrig.host.cli.refused import Refused
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import replacing

if TYPE_CHECKING:
    from tickrig.host.canmon.model.frames.record import AnyRecord
    from tickrig.host.canmon.model.recorder.trigger import FilterTrigger, Trigger


class LogFile:
    """A recording under way.

    Args:
        plan: what it shall be; where it is one file, one that exists is replaced.
        source: SOURCE words of what is read meanwhile.
        live: time goes on while no frame comes.
        triggers: what it waits for, where the plan has it wait.
        wanted: which frames are recorded; None for all.
        kept: what is written stays there if it cannot be written on.

    Raises:
        Refused: the name tells no format, the format needs what is not there, or the file is
            read meanwhile.
        SourceFailed: it cannot be written, now or later.
    """

    def __init__(  # noqa: PLR0913 - what a recording can be
        self,
        plan: Plan,
        source: Sequence[str],
        live: bool = False,
        triggers: Sequence[Trigger] = (),
        wanted: FilterTrigger | None = None,
        *,
        kept: bool = True,
    ) -> None:
        check_not_read(plan.path, source)
        self._kept = kept
        self._watch, self._live = Stopwatch(), live
        try:
            log_format(plan.path)
            self.recorder = Recorder(plan, self._now_us, triggers, wanted)
        except (LogFormatError, LogError) as error:
            raise Refused(str(error)) from None
        except OSError as error:
            raise SourceFailed(f"{error.filename or plan.path}: {error.strerror}") from error

    def take(
        self, decoded_frames: Sequence[DecodedFrame], lost: int, marks: Sequence[Mark] = ()
    ) -> bool:
        """Add frames; what came is with the operating system then.

        Returns:
            Whether it takes no more.
        """
        if decoded_frames:
            self._watch.take((decoded_frames[-1][0],))
        self.recorder.take(decoded_frames, lost, self._now_us, marks)
        if self.recorder.failed:
            raise SourceFailed(self.recorder.failed)
        return bool(self.recorder.ended)

    def trigger(self, why: str) -> None:
        """Record what was kept and what comes, where it waits for that."""
        self.recorder.trigger(why, self._now_us)

    def close(self) -> None:
        """End the recording, and say how it went."""
        failed = self.recorder.failed
        self.recorder.close()
        for word in self.recorder.messages() if self._kept or not self.recorder.failed else ():
            click.echo(word, err=True)
        if self.recorder.failed != failed:
            raise SourceFailed(self.recorder.failed)

    @property
    def _now_us(self) -> int:
        """The time at the source: that of this machine until a frame has told it."""
        if not self._live:
            return self._watch.latest_us
        return self._watch.now_us if self._watch.latest_us else time.time_ns() // 1_000


@contextmanager
def whole_log(path: Path, source: Sequence[str]) -> Iterator[Path]:
    """Give where a log is written: a new file, which takes the place of `path` in the end.

    Where something else than files is read, this may be long, and somebody may read on: then it is
    `path` itself.

    Raises:
        Refused: its name tells no format, or it is read meanwhile.
        SourceFailed: it cannot be written.
    """
    check_not_read(path, source)
    try:
        log_format(path)
    except LogFormatError as error:
        raise Refused(str(error)) from None
    if not all(isinstance(parse_source(word), FileSpec) for word in source):
        yield path
        return
    beside = path
    try:
        with replacing(path) as beside:
            yield beside
    except click.ClickException as error:
        raise type(error)(error.message.replace(str(beside), str(path))) from error
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror}") from error


def check_not_read(path: Path, source: Sequence[str]) -> None:
    """Refuse a file that is read meanwhile."""
    read = (parsed.path for word in source if isinstance(parsed := parse_source(word), FileSpec))
    if path.exists() and any(one.exists() and one.samefile(path) for one in read):
        raise Refused(f"{path} is read, so it cannot be written")


def write_records(path: Path, records: Sequence[AnyRecord]) -> list[str]:
    """Write frames into a new log; say how many, and what could not be held.

    Raises:
        ValueError: it is there already, or cannot be written.
    """
    frames = [record for record in records if isinstance(record, Record)]
    if path.exists():
        raise ValueError(f"{path} is there already: choose another name")
    try:
        with replacing(path) as beside, closing(write_log(beside)) as writer:
            for frame in frames:
                writer.write(frame)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    lines = len(records) - len(frames)
    left_out = [f"{counted(lines, 'line')} of serial ports left out"] if lines else []
    return [f"{counted(len(frames), 'frame')} written to {path}", *left_out, *writer.messages()]
