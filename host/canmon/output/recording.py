"""A log file, or a recording in parts, that a verb writes, with its options."""

from __future__ import annotations

import shlex
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogError, LogFormatError, Mark, log_format
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.canmon.model.recorder.files import AtLimit, RecordingPlan, read_plan
from tickrig.host.canmon.model.recorder.recorder import (
    FilterTrigger,
    Recorder,
    RuleTrigger,
    Trigger,
)
from tickrig.host.canmon.output.listening import Stopwatch
from tickrig.host.canmon.output.printer import DecodedFrame
from tickrig.host.canmon.sources.source import FileSpec, parse_source
from tickrig.host.cli.messages import Refused, SourceFailed, refusing
from tickrig.host.cli.options import PATH, Choice, Decorator, add_options
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import replacing

if TYPE_CHECKING:
    from tickrig.host.canmon import extensions
    from tickrig.host.canmon.model.check import checker, rule_parser
    from tickrig.host.canmon.model.check import rules as check_rules
    from tickrig.host.canmon.model.decode import filter as filters
    from tickrig.host.canmon.model.frames import AnyRecord
    from tickrig.host.canmon.model.logs.log_writer import TextBlock
else:  # slow
    extensions = LazyModule("tickrig.host.canmon.extensions")
    checker = LazyModule("tickrig.host.canmon.model.check.checker")
    rule_parser = LazyModule("tickrig.host.canmon.model.check.rule_parser")
    check_rules = LazyModule("tickrig.host.canmon.model.check.rules")
    filters = LazyModule("tickrig.host.canmon.model.decode.filter")


# A log file, or a recording in parts, that a verb writes.


class LogFile:
    """A running recording of a command such as `canmon dump -l`: the files and the recorder.

    Args:
        plan: settings of the recording. A single file replaces an existing file.
        source: SOURCE words of the recorded source.
        live: whether time also passes while no frame arrives.
        triggers: triggers that start the recording, if the plan has a trigger.
        wanted: filter for the recorded frames, or None for all frames.
        kept: whether to keep the file if writing fails.

    Raises:
        Refused: the name of the file indicates no format, the format needs a package that is not
            installed, or the file is the one that is being read.
        SourceFailed: the file cannot be written. Methods raise it, too.
    """

    def __init__(  # noqa: PLR0913 - what a recording can be
        self,
        plan: RecordingPlan,
        source: Sequence[str],
        live: bool = False,
        triggers: Sequence[Trigger] = (),
        wanted: FilterTrigger | None = None,
        *,
        kept: bool = True,
    ) -> None:
        _check_not_read(plan.path, source)
        self._kept = kept
        self._watch, self._live = Stopwatch(), live
        try:
            self.recorder = Recorder(plan, self._now_us, triggers, wanted)
        except (LogFormatError, LogError) as error:
            raise Refused(str(error)) from None
        except OSError as error:
            raise SourceFailed(f"{error.filename or plan.path}: {error.strerror}") from error

    def take(
        self, decoded_frames: Sequence[DecodedFrame], lost: int, marks: Sequence[Mark] = ()
    ) -> bool:
        """Record frames and marks, and pass them to the operating system.

        Returns:
            Whether the recording has ended.
        """
        if decoded_frames:
            self._watch.take((decoded_frames[-1][0],))
        self.recorder.take(decoded_frames, lost, self._now_us, marks)
        if self.recorder.failed:
            raise SourceFailed(self.recorder.failed)
        return bool(self.recorder.ended)

    def take_block(self, block: TextBlock) -> bool:
        """Add many frames at once. Return False if `take` must add them."""
        self._watch.latest_us = block.last_us
        taken = self.recorder.take_block(block, self._now_us)
        if self.recorder.failed:
            raise SourceFailed(self.recorder.failed)
        return taken

    def trigger(self, why: str) -> None:
        """Trigger a waiting recording: write the kept frames and the following frames."""
        self.recorder.trigger(why, self._now_us)

    def close(self) -> None:
        """End the recording and report the result."""
        failed = self.recorder.failed
        self.recorder.close()
        for word in self.recorder.messages() if self._kept or not self.recorder.failed else ():
            click.echo(word, err=True)
        if self.recorder.failed != failed:
            raise SourceFailed(self.recorder.failed)

    @property
    def _now_us(self) -> int:
        """The time at the source, which is the time of this machine until a frame has a time."""
        if not self._live:
            return self._watch.latest_us
        return self._watch.now_us if self._watch.latest_us else time.time_ns() // 1_000


@contextmanager
def whole_log(path: Path, source: Sequence[str]) -> Iterator[Path]:
    """Context manager that yields the path to which a log must be written.

    If the source consists only of files, the context manager yields the path of a temporary file.
    At the end, this file gets the name `path`, so that `path` is always a complete log. For any
    other source, such as a bus, the context manager yields `path`, because writing may take long
    and other programs may read the log during this time.

    Raises:
        Refused: the name of the file indicates no format, or the file is being read.
        SourceFailed: the file cannot be written.
    """
    _check_not_read(path, source)
    with refusing("", LogFormatError):
        log_format(path)
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


def _check_not_read(path: Path, source: Sequence[str]) -> None:
    """Raise Refused for a file that is being read."""
    read = (parsed.path for word in source if isinstance(parsed := parse_source(word), FileSpec))
    if path.exists() and any(one.exists() and one.samefile(path) for one in read):
        raise Refused(f"{path} is read, so it cannot be written")


def write_records(path: Path, records: Sequence[AnyRecord]) -> list[str]:
    """Write frames into a new log file.

    Return lines to display. The first line reports the number of written frames. Further lines
    report items that the format cannot hold.

    Raises:
        ValueError: the file exists already, or cannot be written.
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


# The options of a recording, and what they make.

_RULE_FILE: Final = ".toml"

recording_options: Final[Decorator] = add_options(
    click.option(
        "--rotate",
        multiple=True,
        metavar="SIZE|TIME",
        help="With -l: begin a new file after SIZE or TIME, such as 100M or 10min. Files are"
        " numbered.",
    ),
    click.option(
        "--disk", metavar="SIZE", help="With -l: limit all files together to SIZE, such as 2G."
    ),
    click.option(
        "--at-limit",
        type=Choice([limit.value for limit in AtLimit]),
        help="At the limit of --disk, delete the oldest file (default), or end the recording.",
    ),
    click.option(
        "--trigger",
        multiple=True,
        metavar="WHEN",
        help="With -l: record only around a trigger. WHEN is a filter as for -F, or a .toml rule"
        " file of check.",
    ),
    click.option("--pre", metavar="N|TIME", help="Record N frames or TIME before a trigger.  [5s]"),
    click.option("--post", metavar="N|TIME", help="Record N frames or TIME after a trigger.  [5s]"),
)
"""Decorator that adds the options of `RecordingOptions`."""

WORDS_METAVAR: Final = "FILE [--rotate 100M] [--disk 2G] [--trigger emcy]"

NAMES: Final = ("rotate", "disk", "at_limit", "trigger", "pre", "post")


class RecordingOptions:
    """The parsed options of a recording on the command line or in the monitor.

    Args:
        path: path of the file.
        options: values of the options by name.
        bit_rate: bit rate of the bus in bit/s. A trigger needs it if its rule is about the bus
            load.
        parts: True to write numbered files with an index in any case. False to do this only if an
            option such as `rotate` requires it.

    Attributes:
        plan: settings of the recording.
        triggers: triggers that start the recording.
        decodes: whether a trigger needs decoded frames.

    Raises:
        Refused: an option is invalid.
    """

    def __init__(
        self, path: Path, options: dict[str, Any], bit_rate: int | None, parts: bool = False
    ) -> None:
        words: Sequence[str] = options["trigger"]
        self.plan = _read_recording_plan(path, options, parts)
        self.triggers = [_trigger(word, bit_rate) for word in words]
        self.decodes = any(trigger.decodes for trigger in self.triggers)


def read_recording(words: str, bit_rate: int | None) -> RecordingOptions:
    """Parse the file name and options of a recording, as after `canmon dump -l`.

    The recording will be written in parts.

    Args:
        words: text with the file name and the options.
        bit_rate: bit rate of the bus in bit/s, or None if unknown.

    Raises:
        Refused: the text is invalid.
    """
    try:
        command = click.Command("record", params=_params())
        context = command.make_context("record", shlex.split(words))
    except (click.ClickException, click.exceptions.Exit) as error:
        text = error.format_message() if isinstance(error, click.ClickException) else "--help"
        raise Refused(f"{text.rstrip('.')}: write {WORDS_METAVAR}") from None
    except ValueError as error:
        raise Refused(f"{words!r}: {error}") from None
    return RecordingOptions(context.params.pop("file"), context.params, bit_rate, parts=True)


def _params() -> list[click.Parameter]:
    @click.argument("file", type=PATH)
    @recording_options
    def record() -> None:
        """Store the options."""

    return click.command(record).params


def _read_recording_plan(path: Path, options: dict[str, Any], parts: bool = False) -> RecordingPlan:
    """Read the settings of the files from options. Raise Refused if an option is wrong."""
    try:
        return read_plan(
            path,
            **{name: options[name] for name in NAMES if name != "trigger"},
            waits=bool(options["trigger"]),
            parts=parts,
        )
    except ValueError as error:
        text = str(error)
        option = text.partition(" ")[0]
        raise Refused(f"--{text}" if option in ("at-limit", *NAMES) else text) from None


def _trigger(word: str, bit_rate: int | None) -> Trigger:
    if word.endswith(_RULE_FILE):
        return _rules(word, bit_rate)
    with refusing("--trigger:", filters.FilterError):
        wanted = filters.parse_filter(word)
        matches = rule_parser.errors_alone(wanted.matches, filters.tokens_of(word), wanted.signals)
        return FilterTrigger(word, replace(wanted, matches=matches))


def _rules(word: str, bit_rate: int | None) -> Trigger:
    try:
        words = check_rules.parse_rule_file(Path(word).read_text("utf-8"), extensions.load_rule)
        rules = check_rules.parse_rules(words, extensions.load_rule)
        if rules == check_rules.Rules(bit_rate=rules.bit_rate):
            raise ValueError("it has no rule")
        return RuleTrigger(Path(word).name, checker.Alarms(rules, bit_rate))
    except OSError as error:
        raise Refused(f"--trigger {word}: {error.strerror}") from error
    except ValueError as error:
        raise Refused(f"--trigger {word}: {error}") from None
