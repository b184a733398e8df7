from __future__ import annotations

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.trace import DisplayFilter, FrameTrace

TEXT = "1 181#01\n2 705#7F\n3 181#02\n4 20000020#0000000000000000\n5 705#05"


def feed(trace: FrameTrace, text: str) -> None:
    decoder = Decoder()
    for record in hear(text):
        trace.take(record, decoder.take(record))


def latest(sieve: DisplayFilter) -> list[tuple[str, int]]:
    return [(str(one.row.record.frame), one.frames) for one in sieve.latest()]


def test_without_a_filter_all_rows_pass() -> None:
    trace = FrameTrace()
    feed(trace, TEXT)
    sieve = DisplayFilter(trace)
    assert sieve.passed is trace
    assert [count for _, count in latest(sieve)] == [2, 2, 1]
    assert latest(sieve)[0] == ("181#02", 2)


def test_a_filter_counts_what_came_before_and_after_it() -> None:
    trace = FrameTrace()
    feed(trace, TEXT)
    sieve = DisplayFilter(trace, parse_filter("heartbeat"))
    feed(trace, "6 705#04\n7 181#03")
    sieve.follow()
    sieve.follow()
    assert [row.number for row in sieve.passed.tail(9)] == [1, 4, 5]
    assert latest(sieve) == [("705#04", 3)]


def test_rows_without_a_meaning_pass_no_filter() -> None:
    trace = FrameTrace()
    trace.take(hear("1 181#01")[0])
    assert latest(DisplayFilter(trace, parse_filter("181"))) == []


def test_a_copy_stays_as_it_is() -> None:
    trace = FrameTrace(capacity=3)
    feed(trace, TEXT)
    held = trace.copy()
    feed(trace, "6 705#04")
    assert (held.first, held.count, [row.number for row in held.tail(9)]) == (2, 5, [2, 3, 4])


def test_a_cleared_sieve_begins_anew_with_its_trace() -> None:
    trace = FrameTrace()
    feed(trace, TEXT)
    sieve = DisplayFilter(trace, parse_filter("181"))
    sieve.clear()
    assert (trace.count, sieve.passed.count, latest(sieve)) == (0, 0, [])
    feed(trace, "9 181#09")
    sieve.follow()
    assert latest(sieve) == [("181#09", 1)]
