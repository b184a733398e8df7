from __future__ import annotations

import pytest

from tickrig.host.canopen.conform.check import Action, Hold, Macro, RefuseRewrite, Step, Write
from tickrig.host.canopen.conform.notation import parse_step, step_words
from tickrig.host.canopen.conform.suite import suite_checks

STEPS = [step for check in suite_checks() for step in check.steps]


def test_each_step_of_the_suite_is_written_as_it_was_read() -> None:
    assert [parse_step(step_words(step)) for step in STEPS] == STEPS


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (Hold("1000:00", "UNSIGNED32", value="91010F00"), "read 1000:00"),
        (Hold((0x1018, 1), "UNSIGNED32"), "read 1018:01"),
        (RefuseRewrite("1000:00", 0, ("06010002",)), "write 1000:00 again"),
        (RefuseRewrite((0x1017, 0), 1, ()), "write 1017:00 a byte longer"),
        (RefuseRewrite((0x1017, 0), -1, ()), "write 1017:00 a byte shorter"),
        (Write((0x1017, 0), "6400"), "write 1017:00 6400"),
        (Macro("map", ((0x1800, 0), "85010000", "FF")), "macro map 1800:00 85010000 FF"),
    ],
)
def test_a_step_of_an_object_or_of_a_node_is_written_likewise(action: Action, words: str) -> None:
    assert step_words(Step(action)) == words
