from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.echo import Echo
from tickrig.emulators.rig.station import Station, Timetable
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.instant import NEVER


def stations(count: int) -> list[Station[bytes]]:
    return [Station(Echo(tick_us=1), SerialLine().a) for _ in range(count)]


def test_a_station_stands_at_the_earliest_tick_it_was_entered_for() -> None:
    table, (one, two) = Timetable(), stations(2)
    for at_us in (30, 10, 20):
        table.enter(one, at_us)
    table.enter(two, 20)
    assert (table.first_us, one.at_us) == (10, 10)
    assert table.take(9) == []
    assert table.take(10) == [one]
    assert (table.first_us, one.at_us) == (20, NEVER)
    assert table.take(50) == [two]
    assert (table.first_us, table.take(NEVER)) == (NEVER, [])


def test_a_tick_that_all_have_left_is_passed_over() -> None:
    table, (one, two) = Timetable(), stations(2)
    table.enter(one, 20)
    table.enter(two, 30)
    table.enter(one, 10)
    assert table.take(10) == [one]
    assert table.first_us == 30


def test_a_tick_is_a_multiple_of_the_period_and_none_that_has_been() -> None:
    table, station = Timetable(), Station(Echo(tick_us=10), SerialLine().a)
    table.open_us = 31
    table.enter(station, 21)
    assert (table.first_us, station.at_us) == (40, 40)
    table.enter(station, 39)
    assert table.take(40) == [station]
    table.enter(station, 50)
    assert table.first_us == 50


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(1, 9)) | st.integers(1, 4), max_size=60))
def test_it_does_what_a_plain_table_of_times_does(acts: list[tuple[int, int] | int]) -> None:
    table, all_of_them = Timetable(), stations(4)
    plain, now_us = dict[int, int](), 0
    for act in acts:
        if isinstance(act, tuple):
            number, wait_us = act
            table.enter(all_of_them[number], now_us + wait_us)
            plain[number] = min(plain.get(number, NEVER), now_us + wait_us)
        else:
            now_us += act
            taken = {all_of_them.index(station) for station in table.take(now_us)}
            assert taken == {number for number, at_us in plain.items() if at_us <= now_us}
            plain = {number: at_us for number, at_us in plain.items() if at_us > now_us}
        assert table.first_us == min(plain.values(), default=NEVER)
