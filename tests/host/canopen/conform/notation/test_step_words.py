from __future__ import annotations

import pytest

from tickrig.host.canopen.conform.notation import parse_step, step_words
from tickrig.host.canopen.conform.suite import suite_checks

STEPS = [step for check in suite_checks() for step in check.steps]


def test_each_step_of_the_suite_is_written_as_it_was_read() -> None:
    assert [parse_step(step_words(step)) for step in STEPS] == STEPS


@pytest.mark.parametrize(
    ("step", "words"),
    [
        ({"holds": "1000:00", "type": "UNSIGNED32", "value": "91010F00"}, "read 1000:00"),
        ({"holds": (0x1018, 1), "type": "UNSIGNED32"}, "read 1018:01"),
        ({"refuse rewrite": "1000:00", "grow": 0, "codes": ["06010002"]}, "write 1000:00 again"),
        ({"refuse rewrite": (0x1017, 0), "grow": 1, "codes": []}, "write 1017:00 a byte longer"),
        ({"refuse rewrite": (0x1017, 0), "grow": -1}, "write 1017:00 a byte shorter"),
        ({"write": (0x1017, 0), "data": "6400"}, "write 1017:00 6400"),
        ({"macro": ["map", (0x1800, 0), "85010000", "FF"]}, "macro map 1800:00 85010000 FF"),
    ],
)
def test_a_step_of_an_object_or_of_a_node_is_written_likewise(
    step: dict[str, object], words: str
) -> None:
    assert step_words(step) == words
