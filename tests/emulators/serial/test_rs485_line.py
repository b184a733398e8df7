from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.wire.instant import NEVER


def test_a_byte_arrives_at_all_others_when_its_stop_bit_has_passed() -> None:
    line = Rs485Line(baud=100_000, ends=3)  # 100 us a byte
    first, second, third = line.ends
    first.send(50, b"ab")
    assert (second.due_us, second.idle_us) == (150, 250)
    assert [second.poll(t) for t in (149, 150, 249, 250)] == [b"", b"a", b"", b"b"]
    assert (third.poll(1_000), first.poll(1_000)) == (b"ab", b"")
    assert second.due_us == second.idle_us == NEVER


def test_a_receiver_of_bursts_takes_what_was_sent_back_to_back_at_once() -> None:
    line = Rs485Line(baud=100_000, bursts=True)
    line.a.send(50, b"ab")
    line.a.send(60, b"c")
    assert line.b.due_us == 250
    assert [line.b.poll(t) for t in (249, 250, 349, 350)] == [b"", b"ab", b"", b"c"]
    assert line.b.due_us == NEVER


def test_an_end_waits_for_itself() -> None:
    line = Rs485Line(baud=100_000)
    line.a.send(0, b"ab")
    line.a.send(50, b"c")
    assert line.b.poll(250) == b"ab"
    assert line.b.poll(300) == b"c"
    assert line.collisions == 0


def test_two_who_speak_at_once_are_both_garbled() -> None:
    line = Rs485Line(baud=100_000, ends=3)
    first, second, third = line.ends
    first.send(0, b"\x0f\xff\x55")
    second.send(150, b"\x3c")  # overlaps the second byte and the third
    assert line.collisions == 2
    assert third.poll(1_000) == b"\x0f\x3c\x14\x14"
    assert first.poll(1_000) == b"\x14"
    assert second.poll(1_000) == b"\x0f\x3c\x14"


def test_one_after_the_other_nothing_is_garbled() -> None:
    line = Rs485Line(baud=100_000)
    line.a.send(0, b"\x0f")
    line.b.send(100, b"\xf0")
    assert (line.b.poll(100), line.a.poll(200), line.collisions) == (b"\x0f", b"\xf0", 0)


def test_with_echo_an_end_hears_itself() -> None:
    line = Rs485Line(echo=True)
    line.a.send(0, b"me")
    assert line.a.poll(1_000) == b"me"


def test_what_finds_a_buffer_full_is_lost_and_counted() -> None:
    line = Rs485Line(baud=100_000, buffer_bytes=10)
    line.a.send(0, bytes(12))
    assert (line.a.room(0), line.a.lost) == (0, 2)
    assert line.a.room(500) == 5
    line.a.send(500, bytes(5))
    assert (len(line.b.poll(10_000)), line.b.lost) == (10, 5)


@given(
    st.lists(st.tuples(st.integers(0, 300), st.sampled_from([0, 1]), st.binary(max_size=5))),
    st.lists(st.integers(1, 500), max_size=20),
)
def test_when_it_is_polled_makes_no_difference(
    sent: list[tuple[int, int, bytes]], waits: list[int]
) -> None:
    often, once = Rs485Line(ends=3), Rs485Line(ends=3)
    now_us, heard = 0, b""
    for delay_us, sender, data in sent:
        now_us += delay_us
        often.ends[sender].send(now_us, data)
        once.ends[sender].send(now_us, data)
        heard += often.ends[2].poll(now_us)
    for wait_us in waits:
        now_us += wait_us
        heard += often.ends[2].poll(now_us)
    assert heard + often.ends[2].poll(10**9) == once.ends[2].poll(10**9)


@pytest.mark.parametrize("what", ["baud", "frame_bits", "buffer_bytes", "ends"])
def test_a_line_that_cannot_be_is_refused(what: str) -> None:
    with pytest.raises(ValueError, match="at least 1, ends 2"):
        Rs485Line(**{what: 0})  # type: ignore[arg-type]


def test_what_is_queued_does_not_hide_what_is_on_the_wires() -> None:
    line = Rs485Line(baud=100_000)
    line.a.send(0, b"aaaa")
    line.a.send(100, b"bbbb")  # from 400 us on
    line.b.send(200, b"\0")
    assert line.b.poll(1_000) == b"aa\0abbbb"
    assert (line.a.poll(1_000), line.collisions) == (b"\0", 1)


def test_what_has_not_begun_can_be_dropped() -> None:
    line = Rs485Line(baud=100_000, ends=3)
    line.a.send(0, b"abcdef")
    line.a.send(150, b"later")  # behind the others
    assert (line.a.unsent(150), line.a.sent_us) == (10, 1_100)
    line.a.drop_unsent(150)
    assert (line.a.unsent(150), line.a.sent_us) == (1, 200)
    line.a.send(150, b"x")
    assert [end.poll(2_000) for end in line.ends] == [b"", b"abx", b"abx"]
    line.a.drop_unsent(2_000)
    assert line.a.unsent(2_000) == 0


def test_what_is_on_its_way_is_not_known_for_it_can_be_garbled() -> None:
    line = Rs485Line(baud=100_000)
    line.a.send(0, b"ab")
    assert (line.b.coming, line.b.arrival_us(2)) == (b"", 100)
