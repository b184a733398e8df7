"""A task that records what the session hears, while somebody wants it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from tickrig.host.canmon.model.recorder.recorder import Recorder, State
from tickrig.host.canmon.output.recording import read_recording
from tickrig.host.canmon.tui.settings import text_of
from tickrig.host.canmon.tui.tasks.session import DecodedFrame, Session, Task
from tickrig.host.cli.refused import Refused
from tickrig.host.text.values import counted
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

LOOK_US: Final = 100_000
"""How often it is called while no frame comes."""

WORDS: Final = "run.log"

Light = tuple[str, str]
"""A text and its style."""


class RecorderTask(Task):
    """Records in parts, so that no file of before is overwritten.

    Args:
        session: what is heard.

    Attributes:
        section: its table in the workspace.
        words: what is recorded, as behind `canmon dump -l`.
        recorder: what records, or did last; None before the first.
    """

    section: Final = "record"

    def __init__(self, session: Session) -> None:
        self._session = session
        self.words = WORDS
        self.recorder: Recorder | None = None
        self._due_us = NEVER
        session.tasks.append(self)

    @property
    def due_us(self) -> int:
        """When it is next called without a frame."""
        return self._due_us

    @property
    def running(self) -> bool:
        """Whether it records, or waits for a trigger."""
        recorder = self.recorder
        return recorder is not None and recorder.state in (State.WAITING, State.RECORDING)

    @property
    def failed(self) -> str:
        """Why the latest recording ended before its time; empty if it did not."""
        return "" if self.recorder is None else self.recorder.failed

    def start(self, words: str) -> None:
        """Begin a recording; buses that go away are opened again from now on.

        Raises:
            ValueError: words that name none, or it cannot be written there.
        """
        session = self._session
        self.end()
        try:
            recording = read_recording(words, session.model.top.view.bit_rate)
            with session.lock:
                model = session.model
                self.recorder = Recorder(
                    recording.plan, model.now_us, recording.triggers, lost=session.source.lost
                )
                self._due_us = session.now_us
                session.marks.clear()
        except Refused as error:
            raise ValueError(error.message) from None
        except OSError as error:
            raise ValueError(f"{error.filename}: {error.strerror}") from None
        self.words = words
        session.source.reopen()

    def end(self) -> list[str]:
        """End the recording; say how it went."""
        with self._session.lock:
            self._due_us = NEVER
            if self.recorder is None:
                return []
            self.recorder.close()
            return self.recorder.messages()

    def trigger(self) -> None:
        """Record what was kept and what comes."""
        with self._session.lock:
            if self.recorder is not None:
                self.recorder.trigger("key", self._session.model.now_us)

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Record; it sends nothing."""
        session, recorder = self._session, self.recorder
        if recorder is not None and self._due_us != NEVER:
            self._due_us = now_us + LOOK_US
            marks = [session.marks.popleft() for _ in range(len(session.marks))]
            recorder.take(records, session.source.lost, session.model.now_us, marks)
        return ()

    def light(self) -> list[Light]:
        """Return what the line at the bottom says of it."""
        recorder = self.recorder
        if recorder is None or (self._due_us == NEVER and not recorder.failed):
            return []
        said = counted(recorder.frames, "frame")
        match recorder.state:
            case State.RECORDING:
                return [(" REC ", "bold white on red"), (f" {said} ", "")]
            case State.WAITING:
                return [(" REC WAITS ", "bold black on yellow"), (f" {said} ", "")]
            case State.FAILED:
                text = f" REC FAILED: {recorder.failed}; {recorder.missing} frames missing "
                return [(text, "bold red")]
            case State.ENDED:
                return [(f" REC ENDED: {recorder.ended} ", "bold yellow")]

    def load(self, settings: Mapping[str, Any]) -> None:
        """Take what was recorded last; SettingError if it is none."""
        self.words = text_of(settings, "words", self.words)

    def save(self) -> dict[str, Any]:
        """Return what was recorded last."""
        return {"words": self.words}
