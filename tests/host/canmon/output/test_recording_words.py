"""Words of a recording, as people write them."""

from __future__ import annotations

import shlex
from contextlib import suppress

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.recorder.files import AtLimit
from tickrig.host.canmon.output.recording import read_recording
from tickrig.host.cli.messages import Refused

OPTIONS = ("--rotate", "--disk", "--at-limit", "--trigger", "--pre", "--post", "--help", "-l", "--")
VALUES = ("run.log", "100M", "0s", "1h", "9" * 30, "emcy", "(((", "x.toml", "end", "-1", "\\0", "ü")


def test_words_are_those_of_dump() -> None:
    words = "run.log --rotate 1M --rotate 1h --disk 1G --at-limit end --trigger emcy --pre 5"
    recording = read_recording(words, None)
    assert (recording.plan.numbered, recording.plan.at_limit) == (True, AtLimit.END)
    assert [trigger.name for trigger in recording.triggers] == ["emcy"]


@given(st.lists(st.one_of(st.sampled_from((*OPTIONS, *VALUES)), st.text(max_size=8)), max_size=6))
def test_any_words_make_a_recording_or_are_refused(words: list[str]) -> None:
    with suppress(Refused):
        assert read_recording(shlex.join(words), None).plan.numbered


@given(st.text(max_size=40))
def test_any_text_makes_a_recording_or_is_refused(text: str) -> None:
    with suppress(Refused):
        assert read_recording(text, None).plan.numbered
