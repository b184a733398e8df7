"""A sequence that is carried out on a session.

>>> sequence_name('name = "start"', 1), sequence_name("# sync" + chr(10) + "+10 080#", 2)
('start', 'sync')
>>> sequence_name("", 3)
'sequence 3'
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final

from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.sequence import (
    DecodedCondition,
    EventType,
    SequenceEvent,
    SequenceRun,
    TomlSequence,
    parse_lines,
)
from tickrig.host.canmon.model.sequence import Sequence as Steps
from tickrig.host.canmon.model.transmit import PdoFrames
from tickrig.host.canmon.tui.session import DecodedFrame, Task
from tickrig.host.canmon.workspace import below, tables, text_of
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

NEW: Final = """\
name = "new"

[[step]]
send = "080#"

[[step]]
wait = "100ms"
"""
"""What a new sequence begins with."""

_NAME: Final = re.compile(r"""\s*(?:name\s*=\s*["'](.+?)["']|#\s*(.+?))\s*""")


def sequence_name(text: str, number: int) -> str:
    """Return what a sequence is called: by its name, or a comment on its first line."""
    match = _NAME.fullmatch(text.partition("\n")[0])
    return (match[1] or match[2]) if match else f"sequence {number}"


def read_texts(settings: Mapping[str, Any]) -> list[str]:
    """Return the texts of `[[item]]`; SettingError if one is none."""
    texts = []
    for number, item in enumerate(tables(settings, "item")):
        with below("item", number):
            texts.append(text_of(item, "text", ""))
    return texts


def texts_settings(texts: list[str]) -> list[dict[str, Any]]:
    """Return them as settings, each over as many lines as it has."""
    import tomlkit  # noqa: PLC0415 - an extra
    from tomlkit.exceptions import InvalidStringError  # noqa: PLC0415

    def written(text: str) -> Any:
        text = text.lstrip("\n")  # TOML drops the first one
        if "\r" in text:  # tomlkit up to 0.15.0 writes it as it is, and cannot read it
            return text
        try:
            return tomlkit.string(text, literal=True, multiline=True)
        except InvalidStringError:
            return text

    return [{"text": written(text)} for text in texts]


_KEPT: Final = 1_000
"""Notes that are kept."""

_LINES: Final = ("+", "loop")
"""What a sequence of plain lines begins with; others are TOML."""


class SequenceTask(Task):
    """Carries out one sequence at a time.

    Args:
        eds: what files say, by node-ID.
        channel: the bus it sends on; empty for the first.

    Attributes:
        events: what happened, the latest last; times count from the beginning.
    """

    def __init__(self, eds: Mapping[int, EdsObjects], channel: str = "") -> None:
        self.channel = channel
        self.events: deque[SequenceEvent] = deque(maxlen=_KEPT)
        self._pdos, self._decoded = PdoFrames(eds), DecodedCondition()
        self._run: SequenceRun | None = None
        self._begin_us: int | None = None

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._run is not None

    @property
    def due_us(self) -> int:
        """When it next wants to be called without a frame."""
        return NEVER if self._run is None else self._run.due_us

    def parse(self, text: str, name: str) -> Steps:
        """Read a sequence, plain lines or TOML; StepError if it is none."""
        lines = (line.strip() for line in text.splitlines())
        begin = next((line for line in lines if line and not line.startswith("#")), "")
        if begin.startswith(_LINES):
            return parse_lines(text, name)
        resolve, condition = self._pdos.frame, self._decoded.condition
        return TomlSequence(text, name, resolve=resolve, condition=condition).parse()

    def start(self, sequence: Steps) -> None:
        """Carry it out from the next call on, in the place of one that runs."""
        self.events.clear()
        self._begin_us, self._run = None, SequenceRun(sequence)

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Take what was heard; return what the sequence sends."""
        run = self._run
        if run is None:
            return ()
        if self._begin_us is None:
            self._begin_us = now_us
        out = list(run.tick(now_us))
        for one, decoded in records:
            self._decoded.take(one, decoded)
            out += run.tick(now_us, (one,))
        begin_us = self._begin_us
        self.events += (event._replace(at_us=event.at_us - begin_us) for event in run.events)
        run.events.clear()
        if run.done:
            self._run = None
        return tuple(out)

    def stop(self) -> None:
        """Give it up."""
        if self._run is not None:
            self._run = None
            at_us = self.events[-1].at_us if self.events else 0
            self.events.append(SequenceEvent(at_us, EventType.END, "stopped"))
