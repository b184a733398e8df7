"""A fork goes on as the rig would have gone on, and the rig goes on as if there were no fork."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.can.test_can_rig import BURST
from tests.emulators.echo import Echo
from tests.emulators.rig import forks
from tests.emulators.rig.forks import STATUS, Bench, go_on
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.bridge import Bridge
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.can import CanFrame

waits = st.integers(0, 60_000)
line_sends = st.tuples(
    st.just(0),
    st.sampled_from((b"device\n", b"version\nstatus 1\n", b"speed", STATUS, b"\n"))
    | st.binary(max_size=9),
)
can_sends = st.tuples(st.integers(0, 1), st.lists(st.sampled_from(BURST), max_size=4))

SDO = ("000#0100", "000#8101", "080#", "000#8000", "601#4000100000000000", "602#2F60600003000000")
DRIVE = ("602#2B4060000F000000", "604#2B40600006000000", "604#2B4060000F000000")
sdos = st.tuples(st.just(0), st.lists(st.sampled_from((*SDO, *DRIVE)), max_size=4))


def acts(sends: st.SearchStrategy[Any], faults: list[Any], names: list[str]) -> Any:
    things = [
        st.tuples(waits, st.just("send"), sends),
        st.tuples(waits, st.just("arm"), st.sampled_from(faults)),
        st.tuples(waits, st.just("clear"), st.sampled_from([fault[0] for fault in faults])),
    ]
    if names:
        inputs = st.tuples(st.just(0), st.sampled_from(names), st.integers(0, 1))
        things.append(st.tuples(waits, st.just("set"), inputs))
    return st.lists(st.one_of(things), max_size=12)


BYTES = [
    ("flip", "0.01"),
    ("drop", "0.1"),
    ("dup", "0.1"),
    ("cut",),
    ("split", "rate=0.5"),
    ("jitter",),
    ("swap", "frame"),
    ("repeat",),
]
FRAMES = [("corrupt", "0.2"), ("drop", "0.2"), ("duplicate", "0.2"), ("delay", "0.2"), ("short",)]
RIGS: dict[str, tuple[Callable[[], Bench], Any]] = {
    "serial": (forks.serial, acts(line_sends, BYTES, ["power_button", "bus_noise", "rrc_power"])),
    "rs485": (forks.rs485, acts(line_sends, BYTES, ["emergency_stop", "power_cut"])),
    "CANopen": (forks.canopen, acts(sdos, [*FRAMES, ("babble",)], [])),
    "CAN": (forks.can, acts(can_sends, [*FRAMES, ("babble",)], [])),
    "both": (forks.both, acts(st.tuples(st.just(0), can_sends.map(lambda it: it[1])), FRAMES, [])),
}


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[ProcessPoolExecutor]:
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        yield pool


@pytest.mark.parametrize("name", RIGS)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_a_fork_goes_on_alike_and_leaves_the_rig_alone(name: str, data: st.DataObject) -> None:
    make, strategy = RIGS[name]
    before, after, otherwise = (data.draw(strategy) for _ in range(3))
    bench, alone = make(), make()
    assert bench.act(before) == alone.act(before)
    fork, other = bench.fork(), bench.fork()
    other.act(otherwise)
    wanted = alone.act(after)
    assert fork.act(after) == wanted
    assert bench.act(after) == wanted


@pytest.mark.parametrize("name", RIGS)
@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_a_rig_goes_on_in_another_process(
    name: str, elsewhere: ProcessPoolExecutor, data: st.DataObject
) -> None:
    make, strategy = RIGS[name]
    before, after = data.draw(strategy), data.draw(strategy)
    bench = make()
    bench.act(before)
    answer = elsewhere.submit(go_on, pickle.dumps(bench), after)
    assert answer.result() == bench.act(after)


def test_a_copy_and_a_fork_of_a_fork_are_twins_too() -> None:
    bench = forks.can()
    bench.act([(30_000, "send", (0, ["100#0102"]))])
    rig, ends = copy.deepcopy((bench.rig, bench.ends))
    twins = [Bench(rig, ends, bench.faults), bench.fork().fork().fork()]
    wanted = bench.act([(50_000, "send", (0, ["101#"])), (100_000, "send", (1, []))])
    for twin in twins:
        assert twin.act([(50_000, "send", (0, ["101#"])), (100_000, "send", (1, []))]) == wanted


def test_a_fork_has_the_faults_and_the_events() -> None:
    bench = forks.serial()
    done: list[int] = []
    bench.faults.arm("cut")
    bench.rig.event_queue.put("gone", 10, done.append)
    bench.rig.event_queue.drop("gone")
    bench.rig.event_queue.put("set", 400_000, done.append)
    fork = bench.fork()
    assert fork.faults.armed == ("cut",)
    fork.rig.run_for(300_000)
    assert fork.rig.event_queue.due_us == 400_000
    assert fork.ends[0].poll(fork.rig.now_us) == b""


def test_nobody_outside_hears_a_fork() -> None:
    heard: list[object] = []
    wire = CanWire()
    wire.observers.append(lambda at_us, frame: heard.append(frame))
    node, host = Echo(), wire.end()
    host.on_error_state = lambda at_us, state: heard.append(state)
    _, twin_wire, end = Rig(Station(node, SerialLine().a)).fork(wire, host)
    assert end.wire is twin_wire
    assert (twin_wire.observers, end.on_error_state) == ([], None)
    twin_wire.faults.arm("short")
    end.send(0, (CanFrame.parse("123#"),))
    twin_wire.advance(1_000_000)
    assert heard == []


def test_a_link_can_be_wanted_of_a_fork() -> None:
    line = SerialLine()
    link = SimLink(Rig(Station(Rrc(), line.a)), line.b)
    link.receive(100_000)
    rig, other = link._rig.fork(link)
    other.send(b"device\n")
    assert b"RRC" in other.receive(500_000)
    assert (rig.now_us > link.now_us, link.receive(100_000)) == (True, b"")


class LateClock:
    """Of the kind of `RealClock`: whoever waits for it is late."""

    def wait_until(self, t_us: int) -> int:
        return 1


def test_a_rig_in_real_time_is_forked_without_its_bridges() -> None:
    port = PtyPort()
    line = SerialLine()
    rig = Rig(Station(Rrc(), line.a), bridges=[Bridge(line.b, port)], clock=LateClock())
    rig.run_for(20_000)
    fork, end = rig.fork(line.b)
    end.send(fork.now_us, b"device\n")
    fork.run_for(3_600_000_000)
    assert (fork.now_us, rig.now_us) == (3_600_020_000, 20_000)
    assert end.poll(fork.now_us) == b"OK:device\nRRC\n"
    port.close()


def test_what_cannot_be_copied_says_why() -> None:
    port = PtyPort()
    rig = Rig(Station(Rrc(), port))
    with pytest.raises(TypeError, match=r"^PtyPort cannot be copied .*: it is a pty of this mach"):
        rig.fork()
    port.close()
    rig = Rig(Station(Rrc(), SerialLine().a))
    rig.event_queue.put("later", 5, lambda now_us: None)
    with pytest.raises(TypeError, match=r"^Rig cannot be copied: .*<lambda>"):
        rig.fork()
    with pytest.raises(TypeError, match=r"^Rig cannot be copied by copy\.copy"):
        copy.copy(rig)
