"""Mistakes that have nothing to do with each other are all told, as each is alone."""

from __future__ import annotations

from random import Random

import pytest

from tests.emulators.testing.rig_file.test_reader import HERE, WHOLE
from tickrig.emulators.testing.rig_file.plan import RigFileError
from tickrig.emulators.testing.rig_file.reader import parse_rig_file
from tickrig.host.text.toml_reader import Mistake

EDITS = [
    ("seed = 3", "sead = 3"),
    ("bitrate = 500000\n\n[wire.rs]", "bitrate = 5\n\n[wire.rs]"),
    ("baud = 57600", "baud = [57600"),
    ('framing = "8E1"', "framing = 8E1"),
    ("echo = true", "echo = 1"),
    ("node_id = 1\n", "node_id = 0\n"),
    ('store = "left.json"', "store = {}"),
    ('over = "2s"', 'ovr = "2s"'),
    ('"0x6081" = 5', '"0x6081" = "fast"'),
    ("start.stick = [100, -20]", "start.stick = [100, -200]"),
    ('wire = "rs"', 'wire = "sr"'),
    ('room = "4,3"', 'room = "4"'),
    ('post = ["1,0.5,0.1"]', 'pst = ["1,0.5,0.1"]'),
    ('"left.load_nm * 2"', '"left.lood_nm * 2"'),
    ("shaft_blocked@2s-3s", "shaft_blocked@3s-2s"),
    ('"drop=0.1@1s-2s"', '"drop=11@1s-2s"'),
    ('vr2 = "cut"', 'vr2 = "cat"'),
    ('kind = "differential"', 'kind = "differential" # \x01'),
    ("tread_m = 0.3", "tread_m = -0.3"),
    ('mirrored = ["right"]', 'mirrored = ["rite"]'),
    ('control = "/tmp/bench.ctl"', 'contrl = "/tmp/bench.ctl"'),
    ('serve = "rfc2217://7000"', 'serve = "rfc2217://70000"'),
    ('interface = "socketcan"', 'interface = "socketcan'),
    ("baud = 9600", "baud = 9600.5"),
    ("power_on = \"switch -n 'socket 1' on\"", 'power_on = "switch -n \'socket 1 on"'),
    ('port = "COM3"', "port = COM3"),
    ("sleep_after_open = 0.1", "sleep_after_open = 0.1.2"),
    ("stick_pct = 5", "stick_pct = 500"),
]


def mistakes(*edits: tuple[str, str]) -> set[Mistake]:
    """Return what is told, without the names that there are."""
    text = WHOLE
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    with pytest.raises(RigFileError) as caught:
        parse_rig_file(text, HERE)
    return {Mistake(line, reason.partition("; known")[0]) for line, reason in caught.value.mistakes}


ALONE = {edit: mistakes(edit) for edit in EDITS}


@pytest.mark.parametrize("edit", EDITS, ids=[new for _, new in EDITS])
def test_a_mistake_is_told_once_and_in_its_line(edit: tuple[str, str]) -> None:
    old, _ = edit
    line = WHOLE[: WHOLE.index(old)].count("\n") + 1
    (mistake,) = ALONE[edit]
    assert mistake.line == line


@pytest.mark.parametrize("edit", EDITS, ids=[new for _, new in EDITS])
def test_two_mistakes_are_told_as_each_alone(edit: tuple[str, str]) -> None:
    for other in Random(edit[1]).sample(EDITS, 8):
        if other is not edit:
            assert mistakes(edit, other) == ALONE[edit] | ALONE[other]


def test_many_mistakes_are_told_as_each_alone() -> None:
    chance = Random(1)
    for size in (3, 5, 10, 20, len(EDITS)):
        some = chance.sample(EDITS, size)
        assert mistakes(*some) == set().union(*(ALONE[edit] for edit in some))
