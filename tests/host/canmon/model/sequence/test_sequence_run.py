from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.sequence import EventType, SequenceRun, TomlSequence, parse_lines
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

START = """
[vars]
id = 3

[[step]]
send = "000#01{id}"

[[step]]
expect = "{0x700+id:3}#05"
within = "300ms"

[[step]]
wait = "10ms"

[[step]]
repeat = 2
steps = [{ send = "080#" }, { wait = "20ms" }]
"""


def run(text: str, **variables: int) -> SequenceRun:
    return SequenceRun(TomlSequence(text, "start.toml", variables).parse())


def record(*texts: str, sent: bool = False) -> list[Record]:
    return [Record(0, "vcan0", CanFrame.parse(text), sent) for text in texts]


def frames(*texts: str) -> Frames:
    return tuple(map(CanFrame.parse, texts))


def events(of: SequenceRun) -> list[str]:
    return [f"{event.at_us} {event.mark} {event.text}" for event in of.events]


def test_a_sequence_sends_waits_expects_and_repeats() -> None:
    start = run(START)
    assert start.tick(1_000) == frames("000#0103")
    assert start.due_us == 301_000
    assert start.tick(50_000, record("703#7F", "704#05")) == ()
    assert start.tick(70_000, record("703#05")) == ()
    assert start.due_us == 80_000
    assert start.tick(80_000) == frames("080#")
    assert start.tick(100_000) == frames("080#")
    assert start.tick(120_000) == ()
    assert (start.done, start.met, start.missed, start.due_us) == (True, 1, 0, NEVER)


def test_what_did_not_come_is_told_with_its_line_and_ends_the_sequence() -> None:
    start = run(START, id=5)
    start.tick(0)
    assert start.tick(300_000) == ()
    assert start.done
    assert events(start) == [
        "0 > 000#0105",
        "300000 ? start.toml:9: no 705#05 within 300 ms",
        "300000 . 0 met, 1 missed",
    ]


def test_a_sequence_goes_on_where_it_says_so() -> None:
    text = """
    [[step]]
    expect = "705#05"
    within = "5ms"
    on-fail = "go-on"
    [[step]]
    send = "080#"
    """
    both = run(text)
    both.tick(0)
    assert both.tick(5_000) == frames("080#")
    assert (both.done, both.missed) == (True, 1)


def test_steps_for_a_failure_are_done_before_the_end() -> None:
    text = """
    [[step]]
    expect = "705#05"
    within = "5ms"
    on-fail = [{ send = "000#8105" }, { wait = "1ms" }, { send = "000#8005" }]
    [[step]]
    send = "080#"
    """
    reset = run(text)
    reset.tick(0)
    assert reset.tick(5_000) == frames("000#8105")
    assert reset.tick(6_000) == frames("000#8005")
    assert reset.done


def test_several_frames_are_expected_in_any_order() -> None:
    text = '[[step]]\nexpect = ["701#05", "702#05"]\nwithin = "1s"\n'
    both = run(text)
    both.tick(0)
    both.tick(10, record("702#05", "702#05"))
    assert not both.done
    both.tick(20, record("701#05"))
    assert (both.done, both.met) == (True, 1)
    half = run(text)
    half.tick(0, record("702#05"))
    half.tick(1_000_000)
    assert half.events[-2].text == "start.toml:2: no 701#05 within 1000 ms"


def test_two_answers_in_one_call_meet_two_expectations() -> None:
    text = '[[step]]\nexpect = "581#60*"\n[[step]]\nexpect = "582#??"\n'
    two = run(text)
    two.tick(0)
    two.tick(5, record("581#60001000", "582#AA"))
    assert (two.done, two.met) == (True, 2)


def test_what_this_program_sent_meets_nothing() -> None:
    echo = run('[[step]]\nexpect = "080#"\n')
    echo.tick(0)
    echo.tick(10, record("080#", sent=True))
    assert not echo.done


def test_a_failure_inside_a_repetition_ends_all_of_it() -> None:
    text = '[[step]]\nrepeat = 5\nsteps = [{ expect = "080#", within = "1ms" }]\n'
    five = run(text)
    five.tick(0)
    five.tick(1_000_000)
    assert (five.done, five.missed) == (True, 1)


def test_waits_do_not_drift_when_a_caller_is_late() -> None:
    forever = run('[[step]]\nrepeat = "forever"\nsteps = [{ send = "080#" }, { wait = "10ms" }]\n')
    assert forever.tick(0) == frames("080#")
    assert forever.tick(37_000) == frames("080#", "080#", "080#")
    assert forever.due_us == 40_000


@given(st.lists(st.integers(1, 5_000), max_size=30))
def test_calling_more_often_changes_nothing(steps_us: list[int]) -> None:
    dense, sparse = run(START), run(START)
    sent, now_us = list(dense.tick(0)), 0
    for step_us in steps_us:
        now_us += step_us
        sent += dense.tick(now_us)
    answer = now_us + 1
    sent += dense.tick(answer, record("703#05"))
    other = [*sparse.tick(0), *sparse.tick(answer, record("703#05"))]
    while not sparse.done:
        other += sparse.tick(sparse.due_us)
    for now_us in range(answer, answer + 60_000, 500):
        sent += dense.tick(now_us)
    assert (sent, dense.events) == (other, sparse.events)


def test_lines_send_at_their_times_as_often_as_they_say() -> None:
    lines = SequenceRun(parse_lines("loop 2  # twice\n+0 000#0105\n\n+2.5 080#\n", "a.seq"))
    assert lines.tick(100) == frames("000#0105")
    assert lines.due_us == 2_600
    assert lines.tick(2_600) == frames("080#", "000#0105")
    assert lines.tick(5_100) == frames("080#")
    assert (lines.done, lines.events[-1].mark) == (True, EventType.END)


def test_lines_may_go_on_for_ever() -> None:
    lines = SequenceRun(parse_lines("loop forever\n+10 080#\n", "a.seq"))
    assert lines.tick(0) == ()
    assert len(lines.tick(1_000_000)) == 100
    assert not lines.done
