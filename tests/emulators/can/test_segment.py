"""When a bus does what: bit rates, plugs, faults and returns, to the bit."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.emulators.can.can_bench import Log, frames
from tests.emulators.can.test_errors import ACTIVE, BUS_OFF, bus_off, counters
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.wire import CanWire
from tickrig.wire.can import BIT_ERROR, NO_ACK, CanFrame, ErrorState, frame_bits
from tickrig.wire.instant import NEVER

RETURN_BITS = 128 * 11


def bits(text: str) -> int:
    return frame_bits(frames(text)[0])


def make_passive(wire: CanWire, *ends: CanEnd) -> None:
    for end in ends:
        end.controller.tec = 135
        end.controller.transmit_failed()
        wire.bus.leave(end, 0)
        wire.bus.join(end, 0)


class Play:
    """A bus on which times are given in bits, and all that happens on it."""

    def __init__(self, bit_rate: int, nodes: int, seed: int = 3) -> None:
        self.bit_rate, self.wire = bit_rate, CanWire(bit_rate, seed=seed)
        self.log, self.ends = Log(self.wire), [self.wire.end() for _ in range(nodes)]
        self.states = list[tuple[int, ErrorState]]()
        self.ends[0].on_error_state = lambda at_us, state: self.states.append((at_us, state))

    def us(self, bit: int) -> int:
        assert bit * 1_000_000 % self.bit_rate == 0
        return bit * 1_000_000 // self.bit_rate

    def send(self, bit: int, end: int, text: str) -> None:
        self.ends[end].send(self.us(bit), frames(text))

    def run_to(self, bit: int) -> None:
        self.wire.advance(self.us(bit))


def return_in_traffic(play: Play) -> None:
    play.wire.faults.arm("corrupt", "1")
    play.send(0, 0, "185#0102")
    play.run_to(100_000)
    play.wire.faults.clear("corrupt")
    play.ends[0].recover(play.us(100_000))
    play.send(100_016, 1, "555# 556# 557#")


def return_asked_for_in_a_frame(play: Play) -> None:
    play.wire.faults.arm("corrupt", "1")
    play.send(0, 0, "185#0102")
    play.run_to(100_000)
    play.wire.faults.clear("corrupt")
    play.send(100_000, 1, "555#")
    play.ends[0].recover(play.us(100_020))


def plug_pulled_in_a_frame(play: Play) -> None:
    play.send(0, 0, "100#")
    play.run_to(20)
    play.wire.disconnect(play.ends[0])
    play.send(20, 1, "200#")
    play.run_to(84)
    play.wire.reconnect(play.ends[0])


def plug_put_back(play: Play) -> None:
    play.wire.disconnect(play.ends[0])
    play.send(4_000, 0, "100#")
    play.run_to(20_000)
    play.wire.reconnect(play.ends[0])


def company_for_a_node_alone(play: Play) -> None:
    for end in play.ends[1:]:
        play.wire.disconnect(end)
    play.send(0, 0, "705#00")
    play.run_to(20_000)
    play.wire.end()


def collision(play: Play) -> None:
    play.send(0, 0, "185#0002")
    play.send(0, 1, "185#0102")


def short_circuit(play: Play) -> None:
    play.wire.faults.arm("short")
    play.send(0, 0, "100#")


@pytest.mark.parametrize("bit_rate", [10_000, 125_000, 800_000])
@pytest.mark.parametrize(
    "act",
    [
        *(return_in_traffic, return_asked_for_in_a_frame, plug_pulled_in_a_frame, plug_put_back),
        *(company_for_a_node_alone, collision, short_circuit),
    ],
)
def test_the_bit_rate_only_stretches_time(act: Callable[[Play], None], bit_rate: int) -> None:
    whole, stretched = Play(1_000_000, 3), Play(bit_rate, 3)
    for play in (whole, stretched):
        act(play)
        play.run_to(200_000)
    assert whole.log.heard
    assert stretched.log.heard == [
        (-(-at * 1_000_000 // bit_rate), heard) for at, heard in whole.log.heard
    ]
    assert stretched.states == [
        (-(-at * 1_000_000 // bit_rate), state) for at, state in whole.states
    ]


def test_a_delay_is_in_microseconds_whatever_the_bit_rate() -> None:
    wire = CanWire(800_000)
    log, node, _ = Log(wire), wire.end(), wire.end()
    wire.faults.arm("delay", "1")
    node.send(500, frames("100#"))
    wire.advance(20_000)
    assert log.times_us == [10_500 - (-(bits("100#") - 3) * 5 // 4)]


def test_an_idle_bus_has_no_load() -> None:
    wire = CanWire()
    wire.end()
    wire.advance(1)
    assert wire.load_permille() == 0


class Deaf:
    """A device that listens to one CAN-ID."""

    tick_us, due_us = 1_000, NEVER
    accepts: frozenset[int] | None = frozenset({0x80})
    reconfigured_by: frozenset[int] = frozenset()

    def __init__(self) -> None:
        self.on_accepts = list[Callable[[], None]]()

    def reset(self) -> None:
        raise AssertionError

    def tick(self, now_us: int, rx: object, /) -> tuple[()]:
        raise AssertionError


def test_only_a_frame_that_a_station_receives_is_heard() -> None:
    wire, woken = CanWire(), list[int]()
    host, end = wire.end(frozenset()), wire.end()
    end.attach(Deaf(), woken.append)
    host.send(0, frames("080# 123#"))
    assert wire.advance_until_received(1_000) is True
    assert woken == [bits("080#") - 3]
    assert wire.advance_until_received(1_000) is False
    assert wire.load_permille() == 0


def test_a_filter_that_is_open_stays_so_at_another_plug() -> None:
    wire = CanWire()
    host, end, _ = wire.end(), wire.end(frozenset({0x80})), wire.end()
    end.pass_all()
    wire.disconnect(end)
    host.send(0, frames("123#"))
    wire.advance(1_000)
    assert (end.inbox, end.unfiltered) == ((), True)
    wire.reconnect(end)
    host.send(1_000, frames("123#"))
    assert end.poll(2_000) == frames("123#")


def test_a_delayed_node_that_is_plugged_in_again_sends_at_once() -> None:
    wire = CanWire()
    log, node, _ = Log(wire), wire.end(), wire.end()
    wire.faults.arm("delay", "1")
    node.send(0, frames("100#"))
    wire.faults.clear("delay")
    wire.advance(100)
    wire.disconnect(node)
    wire.reconnect(node)
    wire.advance(1_000)
    assert log.times_us == [100 + bits("100#") - 3]


def test_a_plug_that_is_pulled_before_the_first_bit_breaks_nothing() -> None:
    wire = CanWire()
    log, node, host, _ = Log(wire), wire.end(), wire.end(), wire.end()
    node.send(1_000, frames("100#"))
    assert wire.due_us < NEVER
    wire.disconnect(node)
    host.send(1_000, frames("200#"))
    wire.advance(2_000)
    assert log.lines == [f"{1_000 + bits('200#') - 3} 200#"]


def test_a_node_whose_only_companion_is_unplugged_is_alone() -> None:
    wire = CanWire()
    log, node, other = Log(wire), wire.end(), wire.end()
    wire.disconnect(other)
    node.send(0, frames("100#"))
    wire.advance(1_000)
    assert {heard for _, heard in log.heard} == {NO_ACK}


def test_an_unplugged_node_counts_nothing_and_hears_nothing_of_the_bus() -> None:
    wire = CanWire(seed=3)
    node, third, host = wire.end(), wire.end(), wire.end()
    wire.faults.arm("corrupt", "1")
    node.send(0, frames("185#"))
    wire.advance(wire.due_us)
    wire.faults.clear("corrupt")
    wire.disconnect(third)
    node.send(1_000, frames("185#"))
    assert (len(host.poll(2_000)), third.poll(2_000)) == (2, ())
    assert counters(third, host) == [(0, 1, ACTIVE), (0, 0, ACTIVE)]
    wire.reconnect(third)
    node.send(2_000, frames("185#"))
    assert third.poll(3_000) == frames("185#")


def test_a_node_that_is_unplugged_must_ask_again_to_return_from_bus_off() -> None:
    wire = CanWire()
    node, _ = wire.end(), wire.end()
    bus_off(wire, node)
    node.recover(100_000)
    wire.disconnect(node)
    wire.reconnect(node)
    wire.advance(200_000)
    assert node.controller.state is BUS_OFF
    node.recover(200_000)
    wire.advance(200_000 + RETURN_BITS)
    assert node.controller.state is ACTIVE


def test_recovery_begins_when_it_is_asked_for_however_far_the_bus_was_moved_on() -> None:
    wire, told = CanWire(), list[int]()
    node, host, third = wire.end(), wire.end(), wire.end()
    bus_off(wire, node)
    node.on_error_state = lambda at_us, state: told.append(at_us)
    host.send(100_000, frames("555# 556#"))
    node.recover(105_000)
    assert third.inbox == frames("555# 556#")
    wire.advance(200_000)
    assert told == [105_000 + RETURN_BITS]


def test_recovery_in_the_middle_of_a_frame_begins_with_its_last_recessive_bits() -> None:
    wire, told = CanWire(), list[int]()
    node, host, _ = wire.end(), wire.end(), wire.end()
    bus_off(wire, node)
    node.on_error_state = lambda at_us, state: told.append(at_us)
    host.send(100_000, frames("555#"))
    node.recover(100_020)
    wire.advance(200_000)
    assert told == [100_000 + bits("555#") - 11 + RETURN_BITS]


def test_a_frame_that_begins_when_a_node_is_back_does_not_hold_it_up() -> None:
    wire, told = CanWire(), list[int]()
    node, host, _ = wire.end(), wire.end(), wire.end()
    bus_off(wire, node)
    node.on_error_state = lambda at_us, state: told.append(at_us)
    wire.faults.arm("delay", "1")
    host.send(100_000 + RETURN_BITS, frames("555#"))  # 10 ms later
    wire.faults.clear("delay")
    node.recover(110_000)
    assert node.poll(120_000) == frames("555#")
    assert told == [110_000 + RETURN_BITS]


def test_a_frame_that_waits_while_a_node_returns_is_sent() -> None:
    wire = CanWire()
    node, host, third = wire.end(), wire.end(), wire.end()
    bus_off(wire, node)
    node.recover(100_000)
    wire.faults.arm("delay", "1")
    host.send(100_000, frames("555#"))
    wire.faults.clear("delay")
    assert wire.due_us == 100_000 + RETURN_BITS
    assert third.poll(120_000) == frames("555#")
    assert node.controller.state is ACTIVE


def test_a_fault_that_is_armed_when_a_frame_begins_strikes_it() -> None:
    wire = CanWire()
    log, node, _ = Log(wire), wire.end(), wire.end()
    node.send(1_000, frames("100#"))
    assert wire.due_us < NEVER
    wire.faults.arm("corrupt", "1")
    wire.advance(wire.due_us)
    assert log.text == str(BIT_ERROR)


def test_a_node_that_is_bus_off_acknowledges_nothing() -> None:
    wire = CanWire()
    node, host = wire.end(), wire.end()
    bus_off(wire, node)
    log = Log(wire)
    host.send(100_000, frames("100#"))
    wire.advance(101_000)
    assert {heard for _, heard in log.heard} == {NO_ACK}


def test_a_node_that_was_alone_sends_when_another_comes() -> None:
    wire = CanWire()
    log, node = Log(wire), wire.end()
    node.send(0, frames("705#00"))
    wire.advance(1_000_000)
    wire.end()
    wire.advance(2_000_000)
    assert log.times_us[-1] == 1_000_000 + bits("705#00") - 3


def test_nobody_hears_the_error_flag_of_a_passive_loser() -> None:
    wire = CanWire()
    log, first, second, _ = Log(wire), wire.end(), wire.end(), wire.end()
    make_passive(wire, second)
    first.send(0, frames("185#0002"))
    second.send(0, frames("185#0102"))
    wire.advance(wire.due_us)
    assert log.lines == [f"{bits('185#0002') - 3} 185#0002"]


def test_a_collision_goes_on_while_one_of_the_losers_is_active() -> None:
    wire = CanWire()
    log, first, second, third, _ = Log(wire), *(wire.end() for _ in range(4))
    make_passive(wire, third)
    first.send(0, frames("185#0002"))
    second.send(0, frames("185#0102"))
    third.send(0, frames("185#0202"))
    wire.advance(wire.due_us)
    assert log.text == str(BIT_ERROR)


def test_of_two_that_sent_the_same_unheard_the_passive_one_acknowledges_the_other() -> None:
    wire = CanWire()
    log, first, second = Log(wire), wire.end(), wire.end()
    make_passive(wire, first)
    for node in (first, second):
        node.send(0, frames("7E4#00"))
    wire.advance(1_000_000)
    assert log.text == f"{NO_ACK} 7E4#00 7E4#00"
    assert (first.poll(1_000_000), second.poll(1_000_000)) == (frames("7E4#00"),) * 2


# A node that is forced off the bus, as by the fault `bus_off`.


def test_a_node_that_is_forced_off_is_bus_off_at_once() -> None:
    play = Play(1_000_000, nodes=3)
    play.run_to(100)
    play.wire.force_off(play.ends[0])
    assert play.states == [(100, BUS_OFF)]
    play.send(100, 0, "185#")
    play.send(100, 1, "285#")
    play.run_to(10_000)
    assert play.log.text == "285#"


@pytest.mark.parametrize("bit_rate", [1_000_000, 800_000])
def test_a_frame_of_a_node_that_is_forced_off_is_aborted(bit_rate: int) -> None:
    play = Play(bit_rate, nodes=3)
    play.send(0, 0, "185#0102")
    play.send(0, 1, "285#")
    play.run_to(40)
    play.wire.force_off(play.ends[0])
    play.run_to(10_000)
    # two error flags, the error delimiter and the pause between frames
    end = 40 + 6 + 6 + 8 + 3 + bits("285#") - 3
    assert play.log.lines == [f"{-(-end * 1_000_000 // bit_rate)} 285#"]


def test_a_node_that_is_forced_off_before_its_first_bit_breaks_nothing() -> None:
    play = Play(1_000_000, nodes=3)
    play.wire.faults.arm("delay", "1")
    play.send(0, 0, "185#")
    play.wire.faults.clear("delay")
    play.run_to(100)
    play.wire.force_off(play.ends[0])
    play.send(100, 1, "285#")
    play.run_to(1_000)
    assert play.log.lines == [f"{100 + bits('285#') - 3} 285#"]


def test_a_node_that_was_forced_off_sends_again_after_its_return() -> None:
    play = Play(1_000_000, nodes=3)
    play.wire.force_off(play.ends[0])
    play.wire.release(play.ends[0])
    play.run_to(RETURN_BITS + 100)
    play.wire.faults.arm("delay", "1")
    play.send(RETURN_BITS + 100, 0, "185#")
    play.run_to(20_000)
    assert [state for _, state in play.states] == [BUS_OFF, ACTIVE]
    assert play.log.text == "185#"


def test_a_frame_of_another_node_goes_on_when_a_node_is_forced_off() -> None:
    play = Play(1_000_000, nodes=3)
    play.send(0, 1, "285#")
    play.run_to(30)
    play.wire.force_off(play.ends[0])
    play.run_to(10_000)
    assert play.log.lines == [f"{bits('285#') - 3} 285#"]


def test_a_frame_that_waits_is_not_sent_by_a_node_that_is_forced_off() -> None:
    play = Play(1_000_000, nodes=3)
    play.send(0, 1, "285#")
    play.send(10, 0, "185#")
    play.wire.force_off(play.ends[0])
    play.run_to(10_000)
    assert play.log.text == "285#"


# Where two frames of one identifier differ.


@pytest.mark.parametrize(
    ("first", "second", "differ"),
    [
        ("185#8002", "185#8102", 19 + 7),
        ("00000185#0002", "00000185#0102", 39 + 7),
        ("00000185#00", "00000185#0000", 39),
    ],
)
def test_a_collision_is_at_the_first_bit_that_differs(first: str, second: str, differ: int) -> None:
    play = Play(1_000_000, nodes=3)
    play.send(0, 0, first)
    play.send(0, 1, second)
    play.run_to(100)
    assert play.log.times_us[0] == differ + 6 + 6 + 8


def test_a_frame_does_not_start_before_it_is_sent_while_another_is_delayed() -> None:
    play = Play(1_000_000, nodes=3)
    play.wire.faults.arm("delay", "1")
    play.send(0, 0, "185#")
    play.wire.faults.clear("delay")
    play.send(500, 1, "285#")
    play.run_to(20_000)
    assert play.log.lines == [f"{500 + bits('285#') - 3} 285#", f"{10_000 + bits('185#') - 3} 185#"]


def test_a_segment_is_whole_while_all_ends_are_on_it() -> None:
    play = Play(1_000_000, nodes=2)
    seen = [play.wire.bus.whole]
    play.wire.disconnect(play.ends[0])
    seen.append(play.wire.bus.whole)
    play.wire.reconnect(play.ends[0])
    assert [*seen, play.wire.bus.whole] == [True, False, True]


@pytest.mark.parametrize("fault", ["", "drop"])
def test_a_frame_counts_once_for_the_load(fault: str) -> None:
    play = Play(1_000_000, nodes=2)
    if fault:
        play.wire.faults.arm(fault, str(2.0**-80))
    play.send(0, 0, "185#")
    play.run_to(1_000)
    assert play.wire.load_permille() == bits("185#")


def test_who_listens_to_faults_hears_the_frames_that_are_dropped() -> None:
    play, dropped = Play(1_000_000, nodes=2), list[str]()
    play.wire.faults.listeners.append(lambda at_us, frame: dropped.append(f"{at_us} {frame}"))
    play.wire.faults.arm("drop", "1")
    play.send(0, 0, "185#")
    play.run_to(1_000)
    assert dropped == [f"{bits('185#') - 3} 185#"]


def test_the_routes_of_4096_identifiers_are_kept() -> None:
    wire = CanWire()
    sizes: list[int] = []
    for can_id in range(4_098):
        wire.bus.routes.receivers(CanFrame(can_id, extended=True))
        sizes.append(len(wire.bus.routes._table))
    assert sizes[4_094:] == [4_095, 4_096, 1, 2]


def test_an_earlier_event_is_announced_once_until_the_bus_is_idle() -> None:
    play, announced = Play(1_000_000, nodes=3), list[int]()
    assert play.wire.due_us == NEVER
    play.wire.on_traffic.append(lambda: announced.append(1))
    for end in (2, 1, 0):
        play.send(0, end, f"{end + 1}85#")
        assert play.wire.due_us < NEVER
    assert len(announced) == 1


# What the kernel reads and sets.


def test_the_fields_that_the_kernel_reads_have_values_from_the_start() -> None:
    bus = CanWire().bus
    assert (bus._on_bus, bus._free, bus._start, bus._due_us) == (0, 0, NEVER, NEVER)
    assert (bus._sound, bus._announced, bus._finish, bus.received) == (False, False, None, False)


def test_another_end_ends_the_sound_state() -> None:
    wire = CanWire()
    wire.bus._sound = True
    wire.end()
    assert not wire.bus._sound


def delay_a_frame(play: Play) -> None:
    play.wire.faults.arm("delay", "1")
    play.send(0, 0, "185#")
    play.wire.faults.clear("delay")


def is_sound(act: Callable[[Play], object] = lambda _: None, nodes: int = 2) -> bool:
    play = Play(1_000_000, nodes)
    act(play)
    return play.wire.bus._is_sound()


def test_a_bus_is_sound_while_nothing_can_go_wrong() -> None:
    assert is_sound()
    assert is_sound(nodes=3)
    assert not is_sound(nodes=1)
    assert not is_sound(lambda play: play.wire.faults.arm("drop", "0.5"))
    assert not is_sound(lambda play: play.wire.faults.arm("short"))
    assert not is_sound(delay_a_frame)
    assert not is_sound(lambda play: make_passive(play.wire, play.ends[0]), nodes=3)
