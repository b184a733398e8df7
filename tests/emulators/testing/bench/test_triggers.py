from __future__ import annotations

import pytest

from tickrig import Bench
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.testing.bench.tasks import LineTrigger, check_condition, text_of
from tickrig.host.text.trace import Mark


def line(text: bytes, mark: Mark = Mark.FROM_DEVICE, source: str = "rrc") -> WireLine:
    return WireLine(1, 0, mark, text, source)


def test_a_line_counts_that_fits_whole_on_its_wire() -> None:
    trigger = LineTrigger("OK:*put", nth=2, source="rrc")
    for passed in (
        *(line(b"OK:out"), line(b"xOK:output"), line(b"OK:output", source="scanner")),
        *(line(b"OK:output", Mark.PHYSICAL), line(b"ok:output")),
    ):
        trigger.hear(passed)
    assert (trigger.count, trigger()) == (0, False)
    trigger.hear(line(b"OK:output"))
    assert not trigger()
    trigger.hear(line(b"OK:a\nput", Mark.TO_DEVICE))
    trigger.hear(line(b"OK:put"))
    assert (trigger.count, trigger()) == (3, True)


def test_any_wire_is_heard_unless_one_is_named() -> None:
    trigger = LineTrigger("a.c")
    for passed in (line(b"abc"), line(b"a.c", source="can")):
        trigger.hear(passed)
    assert (trigger.count, trigger()) == (1, True)


def test_lines_are_counted_from_one() -> None:
    with pytest.raises(ValueError, match="nth counts from 1, got 0"):
        LineTrigger("a", nth=0)


def test_what_is_waited_for_has_a_text() -> None:
    def is_off() -> bool:
        return True

    class Never:
        def __call__(self) -> bool:
            return False

    texts = [text_of(one) for one in (LineTrigger("A", 11), LineTrigger("B", 22), Never(), is_off)]
    place = f"test_triggers.py:{is_off.__code__.co_firstlineno}"
    assert texts == ["the 11th A", "the 22nd B", "a Never", f"the condition of {place}"]


def test_numbers_are_written_as_people_count() -> None:
    numbers = (1, 2, 3, 4, 11, 12, 13, 21, 23, 101, 111, 113)
    texts = [str(LineTrigger("A", number)).split()[1] for number in numbers]
    wanted = "1st 2nd 3rd 4th 11th 12th 13th 21st 23rd 101st 111th 113th"
    assert " ".join(texts) == wanted


def test_what_is_so_already_needs_no_step_and_comes_once() -> None:
    with Bench("rrc") as bench:
        bench.fault("cut", when=lambda: True)
        assert "rrc ! cut" in bench.transcript()
        bench.clear("cut")
        bench.run_for("100ms")
        assert bench.transcript().count("rrc ! cut") == 2  # it came, and was cleared


def test_what_is_no_question_is_refused() -> None:
    check_condition(LineTrigger("A"))
    with pytest.raises(TypeError, match="True cannot be waited for: give a function"):
        check_condition(True)
