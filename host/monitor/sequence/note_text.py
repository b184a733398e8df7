"""What a sequence did as lines of text."""

from __future__ import annotations

from tickrig.host.monitor.sequence.sequence_run import Note
from tickrig.host.text.values import format_time


def note_line(note: Note) -> str:
    """Write a note: seconds, mark, and what happened.

    >>> from tickrig.host.monitor.sequence.sequence_run import Mark
    >>> note_line(Note(4_718, Mark.MET, "703#05"))
    '0.004718 ok 703#05'
    """
    return f"{format_time(note.at_us)} {note.mark} {note.text}"
