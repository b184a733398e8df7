from __future__ import annotations

import pickle
from math import gcd

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import PS_PER_US, UartSetting

sends = st.lists(st.tuples(st.integers(0, 3_000), st.binary(max_size=30)), max_size=12)


def test_a_byte_arrives_when_its_stop_bit_has_passed() -> None:
    line = SerialLine(baud=100_000)  # 100 us a byte
    line.a.send(50, b"ab")
    assert (line.b.due_us, line.b.idle_us) == (150, 250)
    assert [line.b.poll(t) for t in (149, 150, 249, 250)] == [b"", b"a", b"", b"b"]
    assert line.b.due_us == NEVER


def test_115200_baud_carry_115_bytes_in_a_tick_of_10_ms() -> None:
    line = SerialLine()
    line.a.send(0, bytes(1_000))
    assert [len(line.b.poll(t)) for t in range(10_000, 60_000, 10_000)] == [115] * 4 + [116]


def test_the_two_directions_are_independent() -> None:
    line = SerialLine()
    line.a.send(0, b"there")
    line.b.send(0, b"back")
    assert (line.a.poll(10_000), line.b.poll(10_000)) == (b"back", b"there")


@given(sends, st.lists(st.integers(1, 2_000), max_size=40))
def test_when_it_is_polled_makes_no_difference(
    sent: list[tuple[int, bytes]], waits: list[int]
) -> None:
    often, once = SerialLine(), SerialLine()
    now_us, heard, wanted = 0, b"", b""
    for delay_us, data in sent:
        now_us += delay_us
        often.a.send(now_us, data)
        once.a.send(now_us, data)
        heard += often.b.poll(now_us)
        wanted += data
    for wait_us in waits:
        now_us += wait_us
        heard += often.b.poll(now_us)
    now_us = max(now_us, 0 if often.b.idle_us == NEVER else often.b.idle_us)
    assert heard + often.b.poll(now_us) == once.b.poll(now_us) == wanted
    assert often.b.lost == once.b.lost == 0


@given(sends)
def test_the_last_byte_arrives_at_idle_us_and_not_before(sent: list[tuple[int, bytes]]) -> None:
    line, now_us, total = SerialLine(), 0, 0
    for delay_us, data in sent:
        now_us += delay_us
        line.a.send(now_us, data)
        total += len(data)
    if total and line.b.idle_us > now_us:
        idle_us = line.b.idle_us
        assert len(line.b.poll(idle_us - 1)) == total - 1
        assert len(line.b.poll(idle_us)) == 1


def test_a_full_sender_loses_what_does_not_fit() -> None:
    line = SerialLine(buffer_bytes=4)
    assert line.a.room(0) == 4
    line.a.send(0, b"abcdef")
    assert (line.a.room(0), line.b.lost) == (0, 2)
    assert line.b.poll(1_000) == b"abcd"


def test_the_sender_has_room_again_as_bytes_leave() -> None:
    line = SerialLine(baud=100_000, buffer_bytes=4)
    line.a.send(0, b"abcd")
    assert [line.a.room(t) for t in (99, 100, 200, 400)] == [0, 1, 2, 4]


def test_a_receiver_that_does_not_read_loses_the_newest_bytes() -> None:
    line = SerialLine(buffer_bytes=4)
    line.a.send(0, b"abcd")
    line.a.send(10_000, b"efgh")
    assert line.b.poll(20_000) == b"abcd"
    assert line.b.lost == 4


def test_a_receiver_that_never_reads_costs_no_more_memory_than_its_buffers() -> None:
    line = SerialLine(buffer_bytes=4)
    for now_us in range(0, 1_000_000, 1_000):
        line.a.send(now_us, b"x")
    assert line.a.room(1_000_000) == 0
    assert line.b.poll(1_000_000) == b"xxxx"
    assert line.b.lost == 996


def test_what_is_lost_does_not_occupy_the_line() -> None:
    line = SerialLine(baud=100_000, buffer_bytes=1)
    for now_us in (0, 100, 5_000):
        line.a.send(now_us, b"x")
    assert (line.b.idle_us, line.b.lost) == (200, 1)


def test_an_unread_line_holds_one_buffer_at_each_end() -> None:
    line = SerialLine(baud=100_000, buffer_bytes=4)
    line.a.send(0, b"abcd")
    line.a.send(400, b"efg")
    assert line.a.room(10_000) == 1
    line.a.send(10_000, b"h")
    assert line.a.room(20_000) == 0


def test_a_receiver_that_keeps_reading_loses_nothing() -> None:
    line = SerialLine(buffer_bytes=4)
    for now_us in range(0, 100_000, 10_000):
        assert line.a.room(now_us) == 4
        line.a.send(now_us, b"abcd")
        assert line.b.poll(now_us + 9_000) == b"abcd"
    assert line.b.lost == 0


def test_a_thousand_bytes_take_as_long_in_both_directions() -> None:
    line = SerialLine()
    line.a.send(0, bytes(1_000))
    line.b.send(0, bytes(1_000))
    assert (line.a.idle_us, line.b.idle_us) == (86_806, 86_806)  # 10 000 bits at 115 200 bit/s
    line = SerialLine(baud=100_000)
    line.a.send(0, bytes(4_000))
    line.b.send(0, bytes(4_000))
    assert (line.a.idle_us, line.b.idle_us) == (400_000, 400_000)


def test_what_is_sent_when_the_line_is_free_again_begins_at_that_time() -> None:
    line = SerialLine(baud=70_000)  # 142.857 us a byte
    line.a.send(0, b"x")
    assert line.b.idle_us == 143
    line.a.send(143, b"abcdef")
    assert line.b.idle_us == 143 + 858


def test_a_buffer_has_4096_bytes_unless_told_otherwise() -> None:
    assert SerialLine().a.room(0) == 4_096


def test_the_slowest_and_smallest_line_carries_a_byte() -> None:
    line = SerialLine(baud=1, frame_bits=1, buffer_bytes=1)
    line.a.send(0, b"x")
    assert (line.b.due_us, line.b.poll(1_000_000)) == (1_000_000, b"x")


@pytest.mark.parametrize("wrong", [{"baud": 0}, {"frame_bits": 0}, {"buffer_bytes": 0}])
def test_an_impossible_line_cannot_be_built(wrong: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="at least 1"):
        SerialLine(**wrong)


@pytest.mark.parametrize("baud", [9_600, 57_601, 115_200])
def test_a_line_that_is_never_idle_keeps_its_times_and_little_of_what_passed(baud: int) -> None:
    line, total, sent = SerialLine(baud, buffer_bytes=64), 0, 0
    for now_us in range(0, 10_000_000, 977):
        room = line.a.room(now_us)
        line.a.send(now_us, bytes((sent + n) % 251 for n in range(room)))
        sent += room
        received = line.b.poll(now_us)
        assert received == bytes((total + n) % 251 for n in range(len(received)))
        total += len(received)
        assert total == now_us * baud // 10_000_000
        assert line.b.due_us == -(-(total + 1) * 10_000_000 // baud)
    assert len(pickle.dumps(line)) < 2_000 + baud // gcd(baud, 10_000_000)


def test_what_is_on_its_way_is_known() -> None:
    line = SerialLine(baud=100_000)
    line.a.send(0, b"ab")
    line.a.send(1_000, b"cde")
    assert (line.b.coming, line.b.poll(150), line.b.coming) == (b"abcde", b"a", b"bcde")
    assert [line.b.arrival_us(count) for count in (1, 2, 4, 9)] == [200, 1_100, 1_300, 1_300]
    assert line.b.poll(2_000) == b"bcde"
    assert (line.b.coming, line.b.arrival_us(1)) == (b"", NEVER)


def test_what_has_not_begun_can_be_dropped() -> None:
    line = SerialLine(baud=100_000)
    line.a.send(0, b"abcdef")
    assert (line.a.unsent(150), line.a.sent_us) == (5, 600)
    line.a.drop_unsent(150)
    assert (line.a.unsent(150), line.a.sent_us, line.a.room(150)) == (1, 200, 4_095)
    line.a.send(150, b"x")
    line.a.drop_unsent(1_000)
    assert (line.b.poll(1_000), line.a.unsent(1_000)) == (b"abx", 0)


def test_it_can_be_polled_byte_by_byte_as_of_the_times_of_arrival() -> None:
    line = SerialLine(baud=100_000)
    line.a.send(0, b"ab")
    line.a.send(1_000, b"cde")
    line.a.send(9_000, b"f")
    arrived = list[tuple[int, bytes]]()
    while (at_us := line.b.due_us) < NEVER:
        arrived.append((at_us, line.b.poll(at_us)))
    times = (100, 200, 1_100, 1_200, 1_300, 9_100)
    assert arrived == [
        (at_us, bytes([value])) for at_us, value in zip(times, b"abcdef", strict=True)
    ]


def test_a_byte_that_begins_now_is_not_dropped() -> None:
    line = SerialLine(baud=100_000)
    line.a.send(100, b"ab")
    line.a.drop_unsent(100)
    assert line.b.poll(1_000) == b"a"


def test_a_byte_does_not_arrive_before_it_is_sent_on_a_fast_line() -> None:
    line = SerialLine(baud=10_000_000)
    line.a.send(100, b"x")
    assert line.a.unsent(100) == 1


def test_dropped_bytes_leave_room_for_others() -> None:
    line = SerialLine(baud=100_000, buffer_bytes=4)
    line.a.send(0, b"abcd")
    line.a.drop_unsent(0)
    line.a.send(10_000, b"efgh")
    assert line.a.room(20_000) == 3  # 5 of 8 bytes in both buffers


def test_a_byte_on_the_line_needs_its_room_when_nothing_is_dropped() -> None:
    line = SerialLine(baud=100_000, buffer_bytes=4)
    line.a.send(0, b"a")
    line.a.drop_unsent(0)
    line.a.send(10_000, b"efgh")
    assert line.a.room(20_000) == 3


def test_bytes_that_have_not_arrived_can_be_withdrawn() -> None:
    line = SerialLine(baud=9_600)
    line.a.send(0, b"abcd")
    starts_ps = [number * 10_000_000 * PS_PER_US // 9_600 for number in (1, 2, 3)]
    assert line.a.withdraw(1_100) == list(zip(starts_ps, b"bcd", strict=True))
    assert (line.a.unsent(1_100), line.b.poll(10_000), line.b.due_us) == (0, b"a", NEVER)


def test_a_line_without_its_withdrawn_bytes_is_idle() -> None:
    line = SerialLine(baud=9_600)
    line.a.send(50, b"ab")
    assert [at_ps // PS_PER_US for at_ps, _ in line.a.withdraw(50)] == [50, 1_091]
    assert (line.b.due_us, line.b.idle_us, line.a.room(50)) == (NEVER, NEVER, 4_096)


# A change of the setting by the device, here the end a.


def test_the_setting_that_a_line_has_is_no_change() -> None:
    line, changes = SerialLine(), list[tuple[int, UartSetting]]()
    line.a.uart.listeners.append(lambda since_us, setting: changes.append((since_us, setting)))
    line.a.use_uart(10, UartSetting(115_200))
    line.a.use_uart(20, UartSetting(9_600))
    line.a.use_uart(30, UartSetting(9_600))
    assert changes == [(20, UartSetting(9_600))]


def test_a_byte_has_the_bits_of_the_new_setting() -> None:
    line = SerialLine()
    line.a.use_uart(0, UartSetting(1_000, parity="E"))
    line.a.send(0, b"x")
    assert line.b.idle_us == 11_000


def test_bytes_with_another_setting_follow_those_on_the_line() -> None:
    line = SerialLine(baud=9_600)
    line.a.send(0, b"abc")
    line.a.use_uart(0, UartSetting(19_200))
    line.a.send(0, b"de")
    assert [line.b.arrival_us(count) for count in (1, 3, 4, 5)] == [1_042, 3_125, 3_646, 4_167]
    assert line.b.poll(1_042) == b"a"
    assert [line.b.arrival_us(count) for count in (2, 3, 4)] == [3_125, 3_646, 4_167]


def test_bytes_with_the_setting_of_those_on_the_line_lose_no_time() -> None:
    line = SerialLine()
    line.a.send(0, b"x")
    line.a.use_uart(0, UartSetting(9_600))
    line.a.use_uart(0, UartSetting(115_200))
    line.a.send(0, bytes(35))
    assert line.b.idle_us == 3_125  # 360 bits at 115 200 bit/s


@pytest.mark.parametrize("changes", [[50_000], [50_000, 100_000]])
def test_the_other_end_keeps_the_setting_until_the_device_has_sent_all(changes: list[int]) -> None:
    line = SerialLine()
    line.a.use_uart(1_000, UartSetting(10_000))
    line.a.send(1_000, b"ab")
    for baud in changes:
        line.a.use_uart(1_000, UartSetting(baud))
    line.b.send(2_000, b"x")
    assert line.a.idle_us == 3_000  # 10 bits at 10 000 bit/s
