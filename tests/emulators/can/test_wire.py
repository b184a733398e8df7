from __future__ import annotations

from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.can.can_bench import Log, frames, some_frames
from tickrig.emulators.can.arbitration import priority
from tickrig.emulators.can.wire import CanWire
from tickrig.wire.can import CanFrame, frame_bits
from tickrig.wire.instant import NEVER

BIT_RATES = (10_000, 20_000, 33_333, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)


def test_a_frame_arrives_when_its_end_of_frame_has_passed() -> None:
    wire = CanWire(bit_rate=500_000)
    node, host = wire.end(), wire.end()
    node.send(1_000, frames("705#7F"))
    assert frame_bits(frames("705#7F")[0]) == 58
    assert host.due_us == 1_000 + (58 - 3) * 2
    assert (host.poll(1_109), host.poll(1_110)) == ((), frames("705#7F"))
    assert (node.poll(2_000), host.poll(2_000), host.due_us) == ((), (), NEVER)


def test_a_node_does_not_hear_itself_but_all_others_do() -> None:
    wire = CanWire()
    ends = [wire.end() for _ in range(3)]
    ends[1].send(0, frames("123#"))
    assert [end.poll(1_000) for end in ends] == [frames("123#"), (), frames("123#")]


def test_the_lowest_identifier_goes_first_whoever_was_asked_first() -> None:
    wire = CanWire()
    log, ends = Log(wire), [wire.end() for _ in range(4)]
    for end, text in zip(ends, ("705#00", "080#0000", "185#01", "000#8105"), strict=True):
        end.send(0, frames(text))
    wire.advance(10_000)
    assert log.text == "000#8105 080#0000 185#01 705#00"


def test_arbitration_takes_data_before_remote_and_standard_before_extended() -> None:
    wire = CanWire()
    log = Log(wire)
    for text in ("04000000#R", "04000000#", "100#R", "101#", "100#", "03FFFFFF#"):
        wire.end().send(0, frames(text))
    wire.advance(10_000)
    assert log.text == "03FFFFFF# 100# 100#R 04000000# 04000000#R 101#"


def test_a_frame_that_comes_while_the_bus_is_busy_waits_for_the_next_arbitration() -> None:
    wire = CanWire()
    log = Log(wire)
    first, second = wire.end(), wire.end()
    first.send(0, frames("700#"))
    second.send(1, frames("001#"))
    wire.advance(10_000)
    assert log.text == "700# 001#"


def test_frames_of_one_node_keep_their_order() -> None:
    wire = CanWire()
    log, node = Log(wire), wire.end()
    wire.end()
    node.send(0, frames("700# 001# 300#"))
    wire.advance(10_000)
    assert log.text == "700# 001# 300#"


@pytest.mark.parametrize("bit_rate", BIT_RATES)
def test_a_full_bus_does_not_drift(bit_rate: int) -> None:
    wire = CanWire(bit_rate)
    log, node = Log(wire), wire.end()
    wire.end()
    traffic = tuple(CanFrame(0x100 + n, bytes([n % 256]) * (n % 9)) for n in range(1_000))
    node.send(7, traffic)
    wire.advance(100_000_000)
    bits = 0
    for (at_us, heard), frame in zip(log.heard, traffic, strict=True):
        bits += frame_bits(frame)
        assert heard == frame
        assert at_us == 7 - (-(bits - 3) * 1_000_000 // bit_rate)


@pytest.mark.parametrize("bit_rate", [0, 9_999, 1_000_001])
def test_an_impossible_bit_rate_is_told(bit_rate: int) -> None:
    with pytest.raises(ValueError, match=f"bit rate {bit_rate} is not in 10000..1000000 bit/s"):
        CanWire(bit_rate)


def test_the_same_frame_of_several_nodes_is_one_frame_on_the_bus() -> None:
    wire = CanWire()
    log, ends = Log(wire), [wire.end() for _ in range(3)]
    for end in ends[:2]:
        end.send(0, frames("7E4#4F00000000000000 100#"))
    wire.advance(1_000)
    assert log.text == "7E4#4F00000000000000 100#"
    assert [end.poll(1_000) for end in ends] == [(), (), frames("7E4#4F00000000000000 100#")]


def test_an_end_receives_what_its_filter_lets_through() -> None:
    wire = CanWire()
    sender, every, some, none = (
        wire.end(),
        wire.end(),
        wire.end(frozenset({0x80})),
        wire.end(frozenset()),
    )
    sender.send(0, frames("080# 00000080# 081#"))
    assert every.poll(1_000) == frames("080# 00000080# 081#")
    assert some.poll(1_000) == frames("080#")
    assert none.poll(1_000) == ()


def test_a_filter_of_29_bit_identifiers_has_bit_29_set() -> None:
    wire = CanWire()
    sender, some = wire.end(), wire.end(frozenset({0x2000_0080}))
    sender.send(0, frames("080# 00000080#"))
    assert some.poll(1_000) == frames("00000080#")


def test_a_filter_may_change_while_the_bus_runs() -> None:
    wire = CanWire()
    sender, some = wire.end(), wire.end(frozenset({0x100}))
    sender.send(0, frames("100# 200#"))
    assert some.poll(1_000) == frames("100#")
    some.accepts = frozenset({0x200})
    sender.send(1_000, frames("100# 200#"))
    assert some.poll(2_000) == frames("200#")


def test_many_identifiers_do_not_fill_the_memory() -> None:
    wire = CanWire()
    sender, host = wire.end(), wire.end()
    for n in range(10_000):
        sender.send(n * 1_000, (CanFrame(n << 10, n.to_bytes(2, "big"), extended=True),))
        assert len(host.poll((n + 1) * 1_000)) == 1
    assert len(wire.bus.routes._table) <= 4_096


def test_the_time_of_each_frame_is_known() -> None:
    wire = CanWire()
    sender, host = wire.end(), wire.end()
    sender.send(0, frames("705#7F 705#7F"))
    assert host.poll_stamped(1_000) == ((55, frames("705#7F")[0]), (113, frames("705#7F")[0]))


def test_queues_are_finite_and_losses_are_counted() -> None:
    wire = CanWire()
    sender, host = wire.end(), wire.end()
    sender.send(0, frames("100#") * 5_000)
    assert (sender.waiting, sender.lost) == (4_096, 904)
    sender.send(1_000_000, frames("101#"))
    assert (len(host.poll(2_000_000)), host.lost) == (4_096, 1)


def test_the_bus_load_is_what_the_frames_take() -> None:
    wire = CanWire(bit_rate=500_000)
    node = wire.end()
    wire.end()
    node.send(0, frames("705#7F"))  # 58 bits of 2 us
    wire.advance(1_160)
    assert wire.load_permille() == 100
    assert wire.load_permille(580) == 0
    wire.advance(1_160_000)
    assert (wire.load_permille(), wire.load_permille(0)) == (0, 0)


def test_a_look_at_the_next_time_changes_nothing() -> None:
    wire = CanWire()
    log = Log(wire)
    first, second = wire.end(), wire.end()
    first.send(0, frames("700#"))
    assert wire.due_us > 0
    second.send(0, frames("100#"))
    wire.advance(1_000)
    assert log.text == "100# 700#"


sends = st.lists(
    st.tuples(st.integers(0, 900), st.integers(0, 3), st.lists(some_frames(), max_size=4)),
    max_size=25,
)


@settings(deadline=None)
@given(sends, st.sampled_from(BIT_RATES))
def test_no_frame_is_lost_or_invented(
    sent: list[tuple[int, int, list[CanFrame]]], bit_rate: int
) -> None:
    wire = CanWire(bit_rate)
    log, ends = Log(wire), [wire.end() for _ in range(5)]
    now_us, wanted = 0, [Counter[CanFrame]() for _ in ends]
    for wait_us, who, traffic in sent:
        now_us += wait_us
        own = tuple(f._replace(can_id=f.can_id & ~7 | who) for f in traffic)  # as on a sound bus
        ends[who].send(now_us, own)
        for number, counter in enumerate(wanted):
            counter.update(own if number != who else ())
    wire.advance(now_us + 100_000_000)
    heard = [Counter(end.poll(now_us + 100_000_000)) for end in ends]
    assert heard == wanted
    assert sum(wanted[4].values()) == len(log.heard)
    assert all(a < b for a, b in pairwise(log.times_us))


@settings(deadline=None)
@given(sends, st.lists(st.integers(1, 400), max_size=30))
def test_when_it_is_looked_at_makes_no_difference(
    sent: list[tuple[int, int, list[CanFrame]]], looks: list[int]
) -> None:
    def run(*, often: bool) -> list[str]:
        wire = CanWire()
        log, ends = Log(wire), [wire.end() for _ in range(5)]
        now_us = 0
        for number, (wait_us, who, traffic) in enumerate(sent):
            for step_us in range(0, wait_us, looks[number % len(looks)]) if often and looks else ():
                ends[4].poll(now_us + step_us)
                assert wire.due_us >= now_us + step_us
            now_us += wait_us
            ends[who].send(now_us, tuple(traffic))
        wire.advance(now_us + 1_000_000)
        return log.lines

    assert run(often=True) == run(often=False)


@settings(deadline=None)
@given(st.lists(some_frames(), min_size=1, max_size=8, unique_by=priority))
def test_who_sends_first_at_one_time_makes_no_difference(
    traffic: list[CanFrame],
) -> None:
    def run(order: list[int]) -> list[str]:
        wire = CanWire()
        log, ends = Log(wire), [wire.end() for _ in range(9)]
        for number in order:
            ends[number].send(500, (traffic[number],))
        wire.advance(100_000)
        return log.lines

    numbers = list(range(len(traffic)))
    assert run(numbers) == run(numbers[::-1])
    assert [line.split()[1] for line in run(numbers)] == [
        str(f) for f in sorted(traffic, key=priority)
    ]
