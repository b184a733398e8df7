"""A recorder that keeps all arriving frames, or the frames around triggers."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from itertools import groupby
from typing import TYPE_CHECKING, Final, Protocol, cast

from tickrig.host.canmon.model.decode.filter import MissingSignals
from tickrig.host.canmon.model.frames import Record, decoded_text
from tickrig.host.canmon.model.logs.log_file import LogError, Mark, dropped, triggered
from tickrig.host.canmon.model.recorder.files import (
    DEFAULT_SPAN,
    MAX_PRE_FRAMES,
    Files,
    RecordingPlan,
    TriggerSpan,
)
from tickrig.host.text.values import counted

if TYPE_CHECKING:
    from tickrig.host.canmon.model.check.checker import Alarms
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.decode.filter import Filter
    from tickrig.host.canmon.model.frames import AnyRecord
    from tickrig.host.canmon.model.logs.log_writer import TextBlock


# Triggers of a recording: a frame that passes a filter, a rule that is broken.


class Trigger(Protocol):
    """A condition that starts a recording. The recorder calls it with each frame.

    Attributes:
        name: name of the trigger for display.
        decodes: whether the trigger needs the decoded meaning of frames.
    """

    name: str
    decodes: bool

    def why(self, record: Record, decoded: Decoded | None, /) -> str:
        """Return the reason why a frame is a trigger, or an empty text if it is not."""

    def missing(self, now_us: int, lost: int, /) -> str:
        """Return a reason if missing or lost frames start the recording, otherwise an empty text.

        Args:
            now_us: current time.
            lost: total number of frames lost so far.
        """
        return ""

    def messages(self) -> list[str]:
        """Return other notes about the trigger."""
        return []


class FilterTrigger(Trigger):
    """Trigger that starts a recording at a frame that passes a filter.

    Args:
        name: text of the filter.
        wanted: filter that frames must pass.
    """

    def __init__(self, name: str, wanted: Filter) -> None:
        self.name, self.decodes, self._wanted = name, True, wanted
        self._missing = MissingSignals(wanted.signals, wanted.words)

    def why(self, record: Record, decoded: Decoded | None, /) -> str:
        """Return the filter text if the frame passes."""
        assert decoded is not None, "who filters has decoded"
        if self._missing:
            self._missing.take(record, decoded)
        return self.name if self._wanted.matches(record, decoded) else ""

    def messages(self) -> list[str]:
        """Return the signals of the filter that never occurred."""
        return self._missing.messages()


class RuleTrigger(Trigger):
    """Trigger that starts a recording when a rule of a check is broken.

    Args:
        name: name of the set of rules, such as the name of their file.
        alarms: evaluation of the rules, which reports findings.
    """

    def __init__(self, name: str, alarms: Alarms) -> None:
        self.name, self._alarms = name, alarms
        self.decodes = bool(alarms.rules.expressions)

    def why(self, record: Record, decoded: Decoded | None, /) -> str:
        """Return the violation in the frame."""
        self._alarms.take(record, decoded)
        return self._found()

    def missing(self, now_us: int, lost: int, /) -> str:
        """Return the violation by a missing frame."""
        self._alarms.check_missing(now_us, lost)
        return self._found()

    def _found(self) -> str:
        """Return the first of the new findings. The other findings are of the same moment."""
        findings = self._alarms.findings
        if not findings:
            return ""
        first = findings[0]
        findings.clear()
        return f"{first.rule}: {first.text}"


# Theory of operation
# ===================
#
# A recorder is fed by `take` and never reads anything itself. It is one of three, by its
# plan: all frames into files; frames around triggers (`around`), where `_before` keeps the latest
# frames in a ring and `_window` is the recording after a trigger; and either of these through a
# filter (`wanted`). Triggers see every frame, also those that do not pass the filter.
#
# The order for one frame in `_watch`: the frame ends a window that it does not belong to; then it
# is recorded or kept; then the triggers see it. So the frame that triggers is the last of those
# before and is recorded with them, if it passes the filter.
#
# Two clocks. Frames have times of their source, `now_us` continues from the latest of them. A
# window in time ends by a frame that is later, or by `now_us` with a second's grace
# (`_LATE_US`), because frames may still be on their way through this machine. Marks (gaps of a bus,
# losses, triggers) have the time of this machine if no frame has a time, so they are ordered by
# their place among the frames and never by their time; they leave the ring after all frames before
# them.
#
# What may be lost. `store` passes frames to the current file, `flush` passes them to the operating
# system; `safe_frames` counts only those. If writing fails, everything after that is counted as
# `missing`, and `rescue` truncates the file after the last flush. A running recorder never raises:
# it fails, and `failed` has the reason, because its caller must continue.
#
# files.py has parts, limits and the index; a mark that waited in the ring is written into
# the file but not into the index again (`mark_again`), which got it when it happened.

# The frames before a trigger.

_Entry = Record | Mark


_MAX_MARKS: Final = 1_000
"""Number of marks that are kept among frames. The index has all marks."""


class PreTrigger:
    """Buffer that keeps the latest frames and marks, to record the traffic before a trigger.

    Args:
        span: amount of traffic to keep, as a number of frames or a time.

    Attributes:
        short: whether too many frames arrived within the wanted time, so that the buffer could not
            hold all of them.
    """

    def __init__(self, span: TriggerSpan) -> None:
        self._us, self._most = span.us, 1 + (MAX_PRE_FRAMES if span.frames is None else span.frames)
        self._entries: deque[_Entry] = deque()
        self._frames, self.short = 0, False

    def add(self, record: Record) -> None:
        """Keep one more frame. Drop frames that are too old."""
        self._entries.append(record)
        self._frames += 1
        if self._us is not None:
            # a mark has the time of another clock: it goes when all frames before it are gone
            begin_us, first = record.at_us - self._us, self._entries[0]
            while first.at_us < begin_us or isinstance(first, Mark):
                self._give_up()
                first = self._entries[0]
            self.short = self.short or self._frames > self._most
        while self._frames > self._most:
            self._give_up()

    def mark(self, mark: Mark) -> None:
        """Keep a mark."""
        if len(self._entries) - self._frames < _MAX_MARKS:
            self._entries.append(mark)

    def drain(self) -> list[_Entry]:
        """Return all kept items in order of time, and clear the buffer."""
        found = list(self._entries)
        self._entries.clear()
        self._frames = 0
        return found

    def _give_up(self) -> None:
        self._frames -= isinstance(self._entries.popleft(), Record)


_LATE_US: Final = 1_000_000
"""Time until which a frame has arrived, if only time shows that a recording is over."""

_MOST_CHARACTERS: Final = 200
"""Length limit of the text about a frame that was a trigger."""

_LOOK_US: Final = 100_000
"""Interval at which rules are asked for missing frames."""


class RecorderState(StrEnum):
    """State of a recorder."""

    WAITING = "waiting"
    RECORDING = "recording"
    ENDED = "ended"
    FAILED = "failed"


class _Window:
    """The span that is recorded after a trigger. Another trigger extends the span."""

    def __init__(self, span: TriggerSpan, at_us: int) -> None:
        self._span = span
        self.names: set[str] = set()
        self.extend(at_us)

    def extend(self, at_us: int) -> None:
        self._left = self._span.frames
        self._until_us = at_us + (self._span.us or 0)

    def takes(self, record: Record) -> bool:
        if self._left is None:
            return record.at_us <= self._until_us
        self._left -= 1
        return self._left >= 0

    def over(self, now_us: int) -> bool:
        return self._left == 0 if self._left is not None else now_us > self._until_us + _LATE_US


class Recorder:
    """Recorder that writes received frames to files.

    Times are those of the source. Frames contain them, and `now_us` continues from the latest
    frame. If a file cannot be written, the recording ends. Later frames are counted as missing.

    Args:
        plan: settings of the recording.
        now_us: current time.
        triggers: triggers that start the recording, if the plan has a trigger.
        wanted: filter for the frames that are recorded, or None for all. Triggers see all frames.
        lost: number of frames that the source lost before.

    Attributes:
        plan: settings of the recording.
        failed: reason why the recording ended early, empty if it did not.
        triggers: number of triggers that occurred.

    Raises:
        OSError: the file cannot be written.
        LogFormatError: the name of the file has no known format.
        LogError: the format cannot be written on this machine.
    """

    def __init__(
        self,
        plan: RecordingPlan,
        now_us: int = 0,
        triggers: Sequence[Trigger] = (),
        wanted: FilterTrigger | None = None,
        lost: int = 0,
    ) -> None:
        self.plan, self._triggers, self._wanted = plan, triggers, wanted
        self._files = Files(plan, now_us)
        before, self._behind = plan.around or (None, DEFAULT_SPAN)
        self._before = None if before is None else PreTrigger(before)
        self._window: _Window | None = None
        self._lost, self._missing, self._look_us = lost, 0, 0
        self.failed, self.triggers, self._closed = "", 0, False

    @property
    def state(self) -> RecorderState:
        """The state of the recorder."""
        if self.failed:
            return RecorderState.FAILED
        if self._files.ended or self._closed:
            return RecorderState.ENDED
        waits = self._before is not None and self._window is None
        return RecorderState.WAITING if waits else RecorderState.RECORDING

    @property
    def running(self) -> bool:
        """Whether the recorder records, or waits for a trigger."""
        return self.state in (RecorderState.WAITING, RecorderState.RECORDING)

    @property
    def ended(self) -> str:
        """Reason why the recording has ended, empty while it continues."""
        return self.failed or self._files.ended

    @property
    def frames(self) -> int:
        """The number of frames in files, including removed files."""
        return self._files.safe_frames

    @property
    def missing(self) -> int:
        """The number of frames that should be in files, but are not."""
        return self._files.frames - self._files.safe_frames + self._missing if self.failed else 0

    def take(
        self,
        decoded_frames: Sequence[tuple[AnyRecord, Decoded | None]],
        lost: int,
        now_us: int,
        marks: Sequence[Mark] = (),
    ) -> None:
        """Process arrived frames and marks: store them, or search the frames for a trigger.

        Args:
            decoded_frames: frames in order, each with its decoded meaning if a filter needs it.
            lost: total number of frames lost so far.
            now_us: current time.
            marks: events that happened after these frames.
        """
        if not self.running:
            self._missing += len(decoded_frames)
            return
        with self._failing():
            if self._before is None and self._wanted is None:
                self._files.store([cast("Record", record) for record, _ in decoded_frames])
            else:
                self._watch(decoded_frames)
            self._take_marks(lost, marks, now_us)
            self._pass_time(now_us, lost)
            self._files.flush(now_us)

    def take_block(self, block: TextBlock, now_us: int) -> bool:
        """Record many frames at once.

        The result is False if the caller must pass the frames to `take` one by one.

        Args:
            block: block of at least one frame. If the log has marks after these frames, such as
                lost frames, the caller must use `take` instead.
            now_us: current time.
        """
        whole = self._before is None and self._wanted is None
        if not whole or self.state is not RecorderState.RECORDING:
            return False
        with self._failing():
            if not self._files.store_block(block):
                return False
            self._files.flush(now_us)
        return True

    def trigger(self, why: str, now_us: int) -> None:
        """Record the kept frames and the following frames, because the user pressed a key."""
        if self._before is not None and self.running:
            with self._failing():
                self._fire(why, why, now_us)
                self._files.flush(now_us)

    def close(self, why: str = "closed") -> None:
        """End the recording."""
        if self._closed:
            return
        self._closed = True
        with self._failing():
            if not self.failed:
                self._files.close(self._files.ended or why)

    def messages(self) -> list[str]:
        """Report the result, with one line per message."""
        said = self._files.messages()
        if self._before is not None and self._before.short:
            said = [*said, "too many frames came before a trigger: the oldest of them had to go"]
        said = [*said, *(text for one in self._triggers for text in one.messages())]
        said += self._wanted.messages() if self._wanted else []
        if self.plan.numbered or self.failed:
            said.append(self._summary())
        return said

    def _summary(self) -> str:
        files = self._files
        said = f"{counted(self.frames, 'frame')} in {counted(files.parts, 'file')}"
        said += f", {counted(self.triggers, 'trigger')}" if self._before is not None else ""
        said += f", {counted(files.removed, 'old file')} removed" if files.removed else ""
        said += f"; {files.ended}" if files.ended else ""
        missing = f"{self.missing} that came are" if self.missing else "none that came is"
        said += f"; {missing} missing" if self.failed else ""
        return f"{said}; {self.plan.index}" if self.plan.numbered else said

    def _watch(self, decoded_frames: Sequence[tuple[AnyRecord, Decoded | None]]) -> None:
        """Examine each frame. Keep or record it."""
        pending: list[Record] = []
        for one, decoded in decoded_frames:
            record = cast("Record", one)
            if self._wanted is None or self._wanted.why(record, decoded):
                if self._window is not None and not self._window.takes(record):
                    self._files.store(pending)
                    pending = []
                    self._end_window()
                if self._before is None or self._window is not None:
                    pending.append(record)
                else:
                    self._before.add(record)
            for trigger in self._triggers:
                if why := trigger.why(record, decoded):
                    self._files.store(pending)
                    pending = []
                    self._fire(trigger.name, why, record.at_us, (record, decoded))
        self._files.store(pending)

    def _fire(
        self, name: str, why: str, at_us: int, seen: tuple[Record, Decoded | None] | None = None
    ) -> None:
        self.triggers += 1
        if self._window is None:
            self._window = _Window(self._behind, at_us)
            self._store([] if self._before is None else self._before.drain())
        else:
            self._window.extend(at_us)
        if name not in self._window.names:  # a filter that passes each frame is reported once
            self._window.names.add(name)
            # a rule says what is wrong; a filter is its own name
            what = f": {_what(*seen)}" if seen is not None and why == name else ""
            self._files.mark(triggered(at_us, f"{why}{what}"))

    def _store(self, entries: Sequence[_Entry]) -> None:
        """Add frames with the marks among them. The index has these marks already."""
        for is_mark, group in groupby(entries, lambda entry: isinstance(entry, Mark)):
            if is_mark:
                for mark in group:
                    self._files.mark_again(cast("Mark", mark))
            else:
                self._files.store([cast("Record", record) for record in group])

    def _take_marks(self, lost: int, marks: Sequence[Mark], now_us: int) -> None:
        if lost != self._lost:
            # The source counts what it lost; the difference is a mark at this place.
            marks = [dropped(now_us, lost - self._lost), *marks]
            self._lost = lost
        for mark in marks:
            self._files.mark(mark)
            if self._before is not None and self._window is None:
                self._before.mark(mark)

    def _pass_time(self, now_us: int, lost: int) -> None:
        if self._window is not None and self._window.over(now_us):
            self._end_window()
        # `not 0 <=`: the clock of the source may be set back, and rules must not sleep
        # until it is there.
        if self._triggers and not 0 <= now_us - self._look_us < _LOOK_US:
            self._look_us = now_us
            for trigger in self._triggers:
                if why := trigger.missing(now_us, lost):
                    self._fire(trigger.name, why, now_us)

    def _end_window(self) -> None:
        self._window = None
        self._files.end_part()

    @contextmanager
    def _failing(self) -> Iterator[None]:
        """End the recording if the block cannot write, and keep what can be read."""
        try:
            yield
        except (OSError, LogError) as error:
            self.failed = str(error)
            if isinstance(error, OSError):
                self.failed = f"{error.filename or self._files.path}: {error.strerror}"
            self._files.rescue(self.failed)


def _what(record: Record, decoded: Decoded | None) -> str:
    """Return the frame with its meaning as text."""
    text = decoded_text(decoded)
    return f"{record.channel} {record.frame}{f', {text}' if text else ''}"[:_MOST_CHARACTERS]
