"""Fault confinement, faults and broken lines of the CAN bus."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.can.can_bench import Log, frames
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.fault_confinement import ErrorCounters
from tickrig.emulators.can.wire import CanWire
from tickrig.wire.can import BIT_ERROR, NO_ACK, CanFrame, ErrorState, frame_bits
from tickrig.wire.instant import NEVER

ACTIVE, PASSIVE, BUS_OFF = ErrorState.ACTIVE, ErrorState.PASSIVE, ErrorState.BUS_OFF


def counters(*ends: CanEnd) -> list[tuple[int, int, ErrorState]]:
    return [(end.controller.tec, end.controller.rec, end.controller.state) for end in ends]


def test_the_counters_follow_the_standard() -> None:
    controller = ErrorCounters()
    for _ in range(15):
        controller.transmit_failed()
    assert (controller.tec, controller.state) == (120, ACTIVE)
    controller.transmit_failed()
    assert (controller.tec, controller.state) == (128, PASSIVE)
    controller.transmitted()
    assert (controller.tec, controller.state) == (127, ACTIVE)
    for _ in range(17):
        controller.transmit_failed()
    assert (controller.tec, controller.state) == (263, BUS_OFF)
    controller.restart()
    assert (controller.clean, controller.state) == (True, ACTIVE)


def test_a_passive_receiver_comes_back_with_a_good_frame() -> None:
    controller = ErrorCounters()
    for _ in range(200):
        controller.receive_failed()
    assert (controller.rec, controller.state) == (128, PASSIVE)
    controller.received()
    assert (controller.rec, controller.state) == (119, ACTIVE)
    controller.received()
    assert controller.rec == 118


def test_a_node_alone_becomes_passive_and_never_bus_off() -> None:
    wire = CanWire()
    log, node = Log(wire), wire.end()
    told = list[tuple[int, ErrorState]]()
    node.on_error_state = lambda at_us, state: told.append((at_us, state))
    node.send(0, frames("705#00"))
    wire.advance(10_000_000)
    assert counters(node) == [(128, 0, PASSIVE)]
    assert {heard for _, heard in log.heard} == {NO_ACK}
    bits = frame_bits(frames("705#00")[0]) + 6  # cut off after the ACK slot, then 17 bits
    assert log.times_us[:2] == [bits - 3, 2 * bits - 3]
    assert told == [(16 * bits - 3, PASSIVE)]
    assert wire.due_us == NEVER


def test_a_frame_that_nobody_acknowledged_is_sent_when_somebody_comes() -> None:
    wire = CanWire()
    node = wire.end()
    node.send(0, frames("705#00"))
    wire.advance(1_000_000)
    host = wire.end()
    assert host.poll(1_000_200) == frames("705#00")
    assert counters(node, host) == [(127, 0, ACTIVE), (0, 0, ACTIVE)]


def test_a_corrupt_frame_is_told_and_sent_again() -> None:
    wire = CanWire(seed=3)
    log, node, host = Log(wire), wire.end(), wire.end()
    wire.faults.arm("corrupt", "1")
    node.send(0, frames("185#0102"))
    wire.advance(wire.due_us)
    assert (log.text, counters(node, host)) == (str(BIT_ERROR), [(8, 0, ACTIVE), (0, 1, ACTIVE)])
    wire.faults.clear("corrupt")
    assert host.poll(10_000) == frames("185#0102")
    assert counters(node, host) == [(7, 0, ACTIVE), (0, 0, ACTIVE)]
    node.send(10_000, frames("185#") * 7)
    wire.advance(20_000)
    assert counters(node) == [(0, 0, ACTIVE)]


def test_a_sender_of_nothing_but_corrupt_frames_ends_bus_off() -> None:
    wire = CanWire()
    log, node, host = Log(wire), wire.end(), wire.end()
    wire.faults.arm("corrupt", "1")
    node.send(0, frames("185#0102"))
    node.send(0, frames("186#"))
    wire.advance(1_000_000)
    assert counters(node, host) == [(256, 0, BUS_OFF), (0, 32, ACTIVE)]
    assert len(log.heard) == 32
    assert (node.waiting, node.lost) == (0, 2)
    node.send(1_000_000, frames("187#"))
    assert (node.lost, wire.due_us) == (3, NEVER)


def bus_off(wire: CanWire, node: CanEnd) -> None:
    wire.faults.arm("corrupt", "1")
    node.send(0, frames("185#0102"))
    wire.advance(100_000)
    wire.faults.clear("corrupt")
    assert counters(node) == [(256, 0, BUS_OFF)]


def test_a_node_returns_from_bus_off_after_128_times_11_recessive_bits() -> None:
    wire = CanWire()
    node, host = wire.end(), wire.end()
    bus_off(wire, node)
    told = list[tuple[int, ErrorState]]()
    node.on_error_state = lambda at_us, state: told.append((at_us, state))
    node.recover(100_000)
    node.recover(100_500)
    wire.advance(200_000)
    assert told == [(100_000 + 128 * 11, ACTIVE)]
    node.send(200_000, frames("185#01"))
    assert host.poll(201_000) == frames("185#01")


def test_traffic_makes_the_return_from_bus_off_longer() -> None:
    wire = CanWire()
    node, host, third = wire.end(), wire.end(), wire.end()
    bus_off(wire, node)
    told = list[int]()
    node.on_error_state = lambda at_us, state: told.append(at_us)
    node.recover(100_000)
    host.send(100_000 + 16, frames("555#") * 100)  # once before, once in each gap
    wire.advance(200_000)
    bits = frame_bits(frames("555#")[0])
    assert told == [100_000 + 16 + 100 * bits - 11 + 28 * 11]
    assert len(third.poll(200_000)) == 100


def test_a_node_that_is_not_bus_off_has_nothing_to_recover_from() -> None:
    wire = CanWire()
    node = wire.end()
    node.recover(0)
    assert wire.due_us == NEVER


def test_recovery_may_be_asked_for_in_the_middle_of_a_frame() -> None:
    wire = CanWire()
    node, host, _ = wire.end(), wire.end(), wire.end()
    bus_off(wire, node)
    host.send(100_000, frames("555#"))
    node.recover(100_020)
    wire.advance(200_000)
    assert node.controller.state is ACTIVE


def test_a_node_may_ask_to_recover_the_moment_it_is_bus_off() -> None:
    wire = CanWire()
    node, _ = wire.end(), wire.end()
    states = list[ErrorState]()

    def follow(at_us: int, state: ErrorState) -> None:
        states.append(state)
        if state is BUS_OFF:
            node.recover(at_us)

    node.on_error_state = follow
    wire.faults.arm("corrupt", "1")
    node.send(0, frames("185#0102"))
    wire.advance(100_000)
    assert states == [PASSIVE, BUS_OFF, ACTIVE]


def test_passive_nodes_let_others_go_first() -> None:
    wire = CanWire()
    log, node, other = Log(wire), wire.end(), wire.end()
    node.controller.tec = 135
    node.controller.transmit_failed()
    wire.bus.leave(node, 0)
    wire.bus.join(node, 0)
    node.send(0, frames("100# 101#"))
    other.send(0, frames("200#"))
    wire.advance(10_000)
    assert log.text == "100# 200# 101#"


def test_one_identifier_with_different_contents_collides_until_somebody_is_passive() -> None:
    wire = CanWire()
    log, first, second, third = Log(wire), wire.end(), wire.end(), wire.end()
    first.send(0, frames("185#0002"))
    second.send(0, frames("185#0102"))
    wire.advance(100_000)
    assert [heard for _, heard in log.heard].count(BIT_ERROR) == 16
    assert log.text.endswith("185#0002 185#0102")
    assert third.poll(100_000) == frames("185#0002 185#0102")
    assert log.times_us[0] == 19 + 7 + 6 + 6 + 8


def test_different_lengths_collide_at_the_length() -> None:
    wire = CanWire()
    log, first, second, _ = Log(wire), wire.end(), wire.end(), wire.end()
    first.send(0, frames("185#00"))
    second.send(0, frames("185#0000"))
    wire.advance(100)
    assert log.times_us[0] == 19 + 6 + 6 + 8


def test_a_dropped_frame_is_on_the_bus_and_reaches_nobody() -> None:
    wire = CanWire()
    log, node, host = Log(wire), wire.end(), wire.end()
    wire.faults.arm("drop", "1")
    node.send(0, frames("705#7F"))
    assert host.poll(1_000) == ()
    assert log.lines == ["55 705#7F"]


def test_a_duplicated_frame_arrives_again() -> None:
    wire = CanWire(seed=1)
    node, host = wire.end(), wire.end()
    wire.faults.arm("duplicate", "0.5")
    node.send(0, frames("705#7F 705#05"))
    heard = host.poll(10_000)
    assert set(heard) == {*frames("705#7F 705#05")}
    assert len(heard) > 2
    assert node.controller.tec > 0


def test_a_delayed_node_sends_later_and_nobody_else_does() -> None:
    wire = CanWire()
    log, node, other = Log(wire), wire.end(), wire.end()
    wire.faults.arm("delay", "1")
    node.send(500, frames("100#"))
    wire.faults.clear("delay")
    other.send(500, frames("200#"))
    other.send(5_000, frames("201#"))
    wire.advance(20_000)
    assert log.text == "200# 201# 100#"
    assert log.times_us[2] == 10_500 + frame_bits(frames("100#")[0]) - 3


def test_a_babbler_takes_the_whole_bus_until_it_is_cut_off() -> None:
    wire = CanWire()
    log, node, host = Log(wire), wire.end(), wire.end()
    wire.faults.arm("babble")
    node.send(0, frames("001#"))
    wire.advance(100_000)
    assert {str(heard) for _, heard in log.heard} == {"000#"}
    assert wire.load_permille(50_000) == 1_000
    wire.faults.clear("babble")
    assert host.poll(101_000)[-1:] == frames("001#")
    wire.faults.clear("babble")


def test_on_shorted_lines_whoever_sends_ends_bus_off() -> None:
    wire = CanWire()
    node, host = wire.end(), wire.end()
    wire.faults.arm("short")
    node.send(0, frames("100#"))
    assert host.poll(10_000) == ()
    assert counters(node, host) == [(256, 0, BUS_OFF), (0, 0, ACTIVE)]
    wire.faults.clear("short")
    node.recover(10_000)
    wire.advance(20_000)
    node.send(20_000, frames("100#"))
    assert host.poll(30_000) == frames("100#")


def test_a_babbler_goes_on_after_a_short() -> None:
    wire = CanWire()
    _, host = wire.end(), wire.end()
    wire.faults.arm("babble")
    wire.faults.arm("short")
    wire.advance(100_000)
    wire.faults.clear("short")
    assert host.poll(200_000)


def test_a_node_without_its_plug_is_alone_and_the_others_are_not() -> None:
    wire = CanWire()
    log, node, host, third = Log(wire), wire.end(), wire.end(), wire.end()
    wire.disconnect(node)
    wire.disconnect(node)
    node.send(0, frames("100#"))
    host.send(0, frames("200#"))
    assert (third.poll(10_000), node.poll(10_000)) == (frames("200#"), ())
    assert counters(node) == [(128, 0, PASSIVE)]
    wire.reconnect(node)
    wire.reconnect(node)
    assert host.poll(20_000) == frames("100#")
    assert log.text == "200# 100#"


def test_a_frame_whose_sender_is_unplugged_is_broken_off_and_sent_later() -> None:
    wire = CanWire()
    log, node, host, _ = Log(wire), wire.end(), wire.end(), wire.end()
    node.send(0, frames("100#"))
    wire.advance(20)
    wire.disconnect(node)
    host.send(20, frames("200#"))
    wire.advance(20 + 23 + 40)  # an error frame, and not all of the next frame
    assert log.text == ""
    wire.reconnect(node)
    wire.advance(100_000)
    assert log.text == "200# 100#"


@pytest.mark.parametrize(
    ("name", "rate", "reason"),
    [
        ("drop", "0", "drop takes a rate above 0 and up to 1, as drop=0.01; got 0"),
        ("corrupt", "2", "got 2"),
        ("short", "0.5", "short takes no argument, got 0.5"),
    ],
)
def test_a_fault_that_cannot_be_armed_is_told(name: str, rate: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        CanWire().faults.arm(name, rate)


@settings(deadline=None)
@given(
    st.integers(0, 99), st.lists(st.tuples(st.integers(0, 2_000), st.integers(0, 3)), max_size=40)
)
def test_a_bad_line_delays_frames_but_loses_none(seed: int, sent: list[tuple[int, int]]) -> None:
    wire = CanWire(seed=seed)
    log, ends = Log(wire), [wire.end() for _ in range(5)]
    wire.faults.arm("corrupt", "0.1")
    wire.faults.arm("delay", "0.1")
    now_us, wanted = 0, Counter[CanFrame]()
    for wait_us, who in sent:
        now_us += wait_us
        frame = CanFrame(0x100 + who, now_us.to_bytes(4, "big"))
        ends[who].send(now_us, (frame,))
        wanted[frame] += 1
    assert Counter(ends[4].poll(now_us + 1_000_000)) == wanted
    assert log.times_us == sorted(set(log.times_us))


@given(st.integers(0, 99))
def test_looking_ahead_draws_no_chance(seed: int) -> None:
    def run(*, look: bool) -> list[str]:
        wire = CanWire(seed=seed)
        log, ends = Log(wire), [wire.end() for _ in range(3)]
        wire.faults.arm("corrupt", "0.3")
        wire.faults.arm("drop", "0.2")
        for now_us in range(0, 5_000, 500):
            for who in (0, 1):
                ends[who].send(now_us, (CanFrame(0x200 - now_us // 50 + who, b"x"),))
                if look:
                    assert wire.due_us > now_us
        wire.advance(100_000)
        return log.lines

    assert run(look=True) == run(look=False)


def test_a_frame_may_be_broken_at_each_bit_from_the_data_to_the_crc() -> None:
    frame = frames("185#0102")
    bits, times = frame_bits(frame[0]), set[int]()
    for seed in range(400):
        wire = CanWire(seed=seed)
        log, node, _ = Log(wire), wire.end(), wire.end()
        wire.faults.arm("corrupt", "1")
        node.send(0, frame)
        wire.advance(wire.due_us)
        wire.faults.clear("corrupt")
        wire.advance(10_000)
        broken_us, sent_us = log.times_us
        times.add(broken_us)
        assert sent_us - broken_us == bits
    # 19 bits of header, then the turned one; 6 + 6 bits of error flags and 8 of delimiter
    assert times == {19 + place + 20 for place in range(bits - 19 - 11)}


def test_a_duplicated_frame_is_followed_by_an_error_frame_and_itself() -> None:
    wire = CanWire(seed=6)  # the first is duplicated, the second is not
    log, node, host = Log(wire), wire.end(), wire.end()
    wire.faults.arm("duplicate", "0.5")
    node.send(0, frames("705#7F"))
    wire.advance(2_000)
    bits = frame_bits(frames("705#7F")[0])
    assert log.times_us == [bits - 3 + 6 + 6 + 8, 2 * bits - 3 + 6 + 6 + 8]
    assert host.poll_stamped(2_000) == tuple((at_us, frames("705#7F")[0]) for at_us in log.times_us)
    assert counters(node, host) == [(7, 0, ACTIVE), (0, 0, ACTIVE)]


def test_on_shorted_lines_each_start_of_frame_is_an_error() -> None:
    wire = CanWire()
    log, node, _ = Log(wire), wire.end(), wire.end()
    wire.faults.arm("short")
    node.send(0, frames("100#"))
    wire.advance(10_000)
    active = [15 + 18 * n for n in range(16)]  # 1 + 6 + 8 bits, then 3 between frames
    assert log.times_us == [*active, *(285 + 26 * n for n in range(1, 17))]  # 8 more if passive


def test_a_passive_node_alone_waits_8_bits_longer() -> None:
    wire = CanWire()
    log, node = Log(wire), wire.end()
    node.send(0, frames("705#00"))
    wire.advance(10_000)
    bits = frame_bits(frames("705#00")[0]) + 6
    assert log.times_us == [*(n * bits - 3 for n in range(1, 17)), 17 * bits - 3 + 8]


def test_a_collision_ends_when_the_one_that_sends_recessive_is_passive() -> None:
    wire = CanWire()
    log, first, second, third = Log(wire), wire.end(), wire.end(), wire.end()
    first.send(0, frames("185#0002"))
    second.send(0, frames("185#0102"))
    wire.advance(100_000)
    bits = frame_bits(frames("185#0002")[0])
    collisions = [46 + 49 * n for n in range(16)]
    # passive nodes wait 8 bits after an attempt: both before the first frame, then the second
    assert log.times_us == [*collisions, 781 + 8 + bits, 781 + 2 * (8 + bits)]
    assert counters(first, second, third) == [(127, 0, ACTIVE), (135, 0, PASSIVE), (0, 14, ACTIVE)]
