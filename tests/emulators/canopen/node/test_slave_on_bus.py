"""A slave on the bus does what the slave alone does with the same frames."""

from __future__ import annotations

import random
from collections import deque

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.conformance import Check, run_check
from tests.device.canopen.profile_objects import make_dictionary
from tests.device.canopen.reference import NODE_ID
from tests.device.canopen.test_conformance import every_check, profile
from tests.emulators.canopen.node.bus_runner import BusRunner, Unfiltered
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import TICK_US, CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.nmt import NmtState

END_US = 60_000
ANSWER = "585#4300100091010F00"


def frames(text: str) -> Frames:
    return tuple(CanFrame.parse(word) for word in text.split())


class SlaveOnBus:
    """R1 on a bus with a master that sends back to back."""

    def __init__(self, dictionary: Dictionary | None = None, node_id: int = NODE_ID) -> None:
        self.wire = CanWire()
        self.slave = make_slave(dictionary or make_dictionary(()), node_id)
        self.master, self.end = self.wire.end(), self.wire.end()
        self.rig = Rig(Station(self.slave, self.end))

    def send(self, text: str, *, wait_us: int = 5_000) -> str:
        """Send frames; return what the slave answers."""
        self.master.send(self.rig.now_us, frames(text))
        self.rig.run_for(wait_us)
        return " ".join(map(str, self.master.poll(self.rig.now_us)))

    def number(self, index: int, sub: int = 0) -> int:
        return self.slave.dictionary[index, sub].number


def test_an_rpdo_right_behind_nmt_start_is_taken() -> None:
    bus = SlaveOnBus()
    bus.send("")
    bus.send("000#0105 205#AB00")
    assert (bus.slave.state, bus.number(0x6200, 1)) == (NmtState.OPERATIONAL, 0xAB)


def test_an_sdo_request_right_behind_the_end_of_stopped_is_answered() -> None:
    bus = SlaveOnBus()
    bus.send("")
    bus.send("000#0205")
    assert bus.send("000#8005 605#4000100000000000") == ANSWER


def test_frames_that_come_before_power_on_are_not_heard() -> None:
    bus = SlaveOnBus()
    heard = bus.send("000#0105 605#4000100000000000 205#AB00")
    assert (heard, bus.number(0x6200, 1)) == ("705#00", 0)


def test_the_same_after_a_reset_from_the_inside() -> None:
    bus = SlaveOnBus()
    bus.send("")
    bus.send("000#0205")
    bus.slave.reset()
    assert bus.send("000#0105 605#4000100000000000") == "705#00"


def test_a_reset_over_the_bus_and_what_follows_it() -> None:
    bus = SlaveOnBus()
    bus.send("")
    bus.send("000#0205")
    heard = bus.send("000#8105 000#0105 205#AB00 605#4000100000000000")
    assert {"705#00", ANSWER} < set(heard.split())
    assert bus.number(0x6200, 1) == 0xAB


def test_a_server_answers_right_behind_the_requests_that_make_it() -> None:
    bus = SlaveOnBus()
    bus.send("")
    heard = bus.send("605#2301120140040000 605#2301120241040000 440#4000100000000000")
    assert "441#4300100091010F00" in heard


def test_a_heartbeat_counts_right_behind_the_request_to_watch_it() -> None:
    bus = SlaveOnBus()
    bus.send("")
    bus.send("605#2316100114007000 770#05")
    assert "085#3081" in bus.send("", wait_us=30_000)


def test_a_slave_that_got_its_node_id_hears_its_first_request() -> None:
    bus = SlaveOnBus(node_id=255)
    bus.send("")
    heard = bus.send(
        "7E5#0401000000000000 7E5#1107000000000000 7E5#0400000000000000 607#4000100000000000"
    )
    assert {"707#00", "587#4300100091010F00"} < set(heard.split())


@pytest.mark.parametrize("transmission_type", [0xFF, 1])
def test_an_rpdo_that_changes_a_cob_id_lets_the_next_frame_pass(transmission_type: int) -> None:
    dictionary = make_dictionary(())  # a mapping of an object that no EDS should call mappable
    dictionary[0x1600, 0].description.default = b"\x01"
    dictionary[0x1600, 1].description.default = (0x1005_0020).to_bytes(4, "little")
    dictionary[0x1400, 2].description.default = bytes([transmission_type])
    bus, counters = SlaveOnBus(dictionary), list[int]()
    bus.slave.on_sync.append(counters.append)
    bus.send("")
    bus.send("000#0105")
    bus.send("205#81000000")
    assert not counters
    bus.send("080# 081#" if transmission_type == 1 else "205#82000000 082#")
    assert counters == ([0, 0] if transmission_type == 1 else [0])


def test_what_is_done_from_the_inside_counts_for_the_frames_of_the_tick() -> None:
    wire = CanWire()
    node = Node("r1", make_slave(make_dictionary(()), NODE_ID), wire)
    master, rig = wire.end(), Rig(Station(node, node.port))
    rig.run_for(5_000)
    signal = node.signal("0x1005")
    assert signal is not None
    signal.write(0x81)
    heard: list[int] = []
    node.slave.on_sync.append(heard.append)
    master.send(rig.now_us, frames("081#"))
    rig.run_for(5_000)
    assert heard == [0]


def test_what_was_received_is_lost_with_the_power() -> None:
    bus = SlaveOnBus()
    bus.send("")
    bus.send("000#0105", wait_us=500)
    bus.wire.cut_power(bus.end)
    bus.slave.reset()
    bus.wire.reconnect(bus.end)
    bus.rig.run_for(5_000)
    assert bus.slave.state is NmtState.PRE_OPERATIONAL


def test_an_end_that_was_pulled_out_while_unfiltered_hears_well_again() -> None:
    bus = SlaveOnBus()
    bus.send("000#0205", wait_us=900)
    bus.send("000#8005", wait_us=80)
    bus.wire.disconnect(bus.end)
    bus.wire.reconnect(bus.end)
    bus.send("605#4000100000000000", wait_us=5_000)
    assert not bus.end.unfiltered
    assert bus.slave.state is NmtState.PRE_OPERATIONAL


@every_check
def test_the_slave_conforms_on_the_bus(check: Check) -> None:
    assert transcript(check, filtered=True) == transcript(check, filtered=False)


def transcript(check: Check, *, filtered: bool) -> list[str]:
    application, actions = profile(check)
    slave = make_slave(make_dictionary(check.needs), NODE_ID, application=application)
    run = BusRunner(slave, filtered=filtered)
    run_check(run, check, actions(slave))
    return run.transcript


class Recorded:
    """A slave whose answers are kept, tick by tick; its filter is in use."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave, self.reset = slave, slave.reset
        self.tick_us, self.on_accepts = slave.tick_us, slave.on_accepts
        self.sent: dict[int, Frames] = {}

    @property
    def due_us(self) -> int:
        return self._slave.due_us

    @property
    def accepts(self) -> frozenset[int] | None:
        return self._slave.accepts

    @property
    def reconfigured_by(self) -> frozenset[int]:
        return self._slave.reconfigured_by

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        sent = self._slave.tick(now_us, rx)
        if sent:
            self.sent[now_us] = sent
        return sent


def sdo(index: int, sub: int, value: int, size: int) -> str:
    head = bytes([0x23 | (4 - size) << 2, index & 0xFF, index >> 8, sub])
    return f"605#{(head + value.to_bytes(4, 'little')).hex().upper()}"


COMMANDS = [
    *(
        f"000#{command}{node}"
        for command in ("01", "02", "80", "81", "82")
        for node in ("05", "00")
    ),
    *("605#4000100000000000", "605#4001100000000000", "440#4000100000000000"),
    *(sdo(0x1201, sub, cob_id, 4) for sub in (1, 2) for cob_id in (0x440, 0x441, 0x8000_0000)),
    *(sdo(0x1400, 1, cob_id, 4) for cob_id in (0x205, 0x8000_0205, 0x207, 0x707)),
    *(sdo(0x1016, 1, value, 4) for value in (0x0070_0014, 0x0071_0003, 0)),
    *(sdo(0x1005, 0, cob_id, 4) for cob_id in (0x80, 0x81)),
    *(sdo(0x1017, 0, 10, 2), sdo(0x1801, 2, 1, 1), sdo(0x1012, 0, 0x8000_0100, 4)),
    *("205#AB00", "205#0102", "207#CD00", "305#0100020003000400", "305#01"),
    *("080#", "081#", "770#05", "771#7F", "705#R", "100#000000000000"),
    *("7E5#0401000000000000", "7E5#1107000000000000", "7E5#0400000000000000"),
    *("7E5#4600000000000000", "607#4000100000000000", "7E5#5E00000000000000", "123#00"),
]
bursts = st.lists(
    st.tuples(st.lists(st.sampled_from(COMMANDS), max_size=9), st.integers(0, 4_000)), max_size=5
)


@settings(max_examples=60)
@given(bursts, st.sampled_from((NODE_ID, 255)))
def test_random_frames_back_to_back(script: list[tuple[list[str], int]], node_id: int) -> None:
    wire, heard = CanWire(), list[tuple[int, CanFrame]]()
    wire.observers.append(lambda at_us, frame: heard.append((at_us, as_frame(frame))))
    recorded = Recorded(make_slave(make_dictionary(()), node_id))
    master, rig = wire.end(), Rig(Station(recorded, wire.end()))
    for texts, wait_us in script:
        master.send(rig.now_us, frames(" ".join(texts)))
        rig.run_for(wait_us)
    rig.run_to(END_US)
    alone = make_slave(make_dictionary(()), node_id)
    assert recorded.sent == answers(alone, not_from(recorded.sent, heard))


def as_frame(heard: object) -> CanFrame:
    assert isinstance(heard, CanFrame), f"{heard} on a bus without faults"
    return heard


def not_from(
    sent: dict[int, Frames], heard: list[tuple[int, CanFrame]]
) -> deque[tuple[int, CanFrame]]:
    """Leave out what a slave sent itself: in its order, and of the master nothing is the same."""
    own = deque(frame for now_us in sorted(sent) for frame in sent[now_us])
    others = deque[tuple[int, CanFrame]]()
    for at_us, frame in heard:
        if own and own[0] == frame:
            own.popleft()
        else:
            others.append((at_us, frame))
    return others


def answers(slave: CanopenSlave, heard: deque[tuple[int, CanFrame]]) -> dict[int, Frames]:
    """Tick a slave that is alone; return what it sends in which tick."""
    sent = {}
    for now_us in range(TICK_US, END_US + 1, TICK_US):
        rx = []
        while heard and heard[0][0] <= now_us:
            rx.append(heard.popleft()[1])
        if tx := slave.tick(now_us, tuple(rx)):
            sent[now_us] = tx
    return sent


@pytest.mark.parametrize("seed", [1, 2])
def test_random_frames_to_127_nodes(seed: int) -> None:
    assert network(seed, filtered=True) == network(seed, filtered=False)


def network(seed: int, *, filtered: bool) -> list[str]:
    """Run 127 nodes, whose log is the same if each hears what it would hear alone."""
    wire, log, chance = CanWire(), list[str](), random.Random(seed)
    wire.observers.append(lambda at_us, heard: log.append(f"{at_us} {heard}"))
    slaves = [make_slave(make_dictionary(()), node_id) for node_id in range(1, 128)]
    stations = [Station(s if filtered else Unfiltered(s), wire.end()) for s in slaves]
    master, rig = wire.end(), Rig(*stations)
    for _ in range(8):
        master.send(rig.now_us, frames(" ".join(chance.choices(COMMANDS, k=12))))
        rig.run_for(chance.randrange(6_000))
    values = [entry.data.hex() for slave in slaves for entry in slave.dictionary]
    return [*log, *values]
