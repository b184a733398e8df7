"""Nodes that lie, hosts that sleep and buses that are full: each run ends, and accuses nobody."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest

from tests.device.canopen.actions import SlaveActions
from tests.host.canopen.conform.fuzzing import FuzzNode, judge_conversation
from tests.host.canopen.conform.r1 import EDS, R1, Stimulus, yes
from tests.host.canopen.conform.test_safety import SpyLink, failing
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.report.text import text_report
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report
from tickrig.host.canopen.eds import read_sound
from tickrig.wire.can import CanFrame, Frames, data_frame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import RO, RW, DeviceInfo, ObjectTable
from tickrig.wire.instant import NEVER

LONGEST_S = 600
CARE_US = 90_000_000
"""What is done after the last check: the node is brought back and restored."""


class Liar:
    """A device on the bus that is no node.

    Args:
        lie: called with the time and what arrived in each millisecond.
        busy: it says something without being asked.
    """

    tick_us = 1_000

    def __init__(self, lie: Callable[[int, Frames], Frames], *, busy: bool = False) -> None:
        self._lie, self._busy, self._now_us = lie, busy, 0

    @property
    def due_us(self) -> int:
        return self._now_us + self.tick_us if self._busy else NEVER

    def reset(self) -> None:
        """Nothing is kept."""

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        self._now_us = now_us
        return self._lie(now_us, rx)


def judge(
    liar: Liar, *only: str, longest_s: float = LONGEST_S, device: EdsDevice | None = None
) -> Report:
    plan = ConformancePlan(Level.INTRUSIVE, only, confirm=yes, longest_s=longest_s)
    wire = CanWire()
    rig = Rig(Station(liar, wire.end()))
    link = CanHost(rig, wire.end())
    report = ConformRun(link, 5, plan, device=device).run()
    assert report.duration_us < longest_s * 1_000_000 + CARE_US
    assert report.exit_status != 0
    return report


def late(r1: R1, late_us: int) -> Liar:
    """Let what R1 sends be so much late."""
    waiting, tick = list[tuple[int, Frames]](), r1.slave.tick

    def lie(now_us: int, rx: Frames) -> Frames:
        waiting.append((now_us + late_us, tick(now_us, rx)))
        return waiting.pop(0)[1] if waiting[0][0] <= now_us else ()

    return Liar(lie, busy=True)


def settings(r1: R1) -> dict[tuple[int, int], bytes]:
    """Return what the tester could have written: no history of errors."""
    return {at: value for at, value in r1.values().items() if at[0] != 0x1003}


def test_a_node_that_never_answers_blocks_all_at_once() -> None:
    report = judge(Liar(lambda now_us, rx: ()))
    assert {r.outcome.verdict for r in report.results} == {CheckVerdict.BLOCKED}
    assert report.duration_us < 10_000_000
    assert report.aborted == "node 5 does not answer; other nodes: none"
    assert report.absent


def test_who_is_heard_is_named_where_nobody_answers() -> None:
    def beat(now_us: int, rx: Frames) -> Frames:
        return (data_frame(0x710, b"\x05"),) if now_us % 100_000 == 0 else ()

    report = judge(Liar(beat, busy=True))
    assert report.aborted == "node 5 does not answer; other nodes: 16"


@pytest.mark.parametrize("level", [Level.READ_ONLY, Level.INTRUSIVE])
def test_two_nodes_of_one_id_are_told_and_neither_has_failed(level: Level) -> None:
    first, second = R1(), R1()
    wire = CanWire()
    rig = Rig(Station(first.slave, wire.end()), Station(late(second, 2_000), wire.end()))
    link = CanHost(rig, wire.end())
    rig.run_for(2_000_000)
    before = settings(first), settings(second)
    report = ConformRun(link, 5, ConformancePlan(level, confirm=yes)).run()
    assert {r.outcome.verdict for r in report.results} == {CheckVerdict.INCONCLUSIVE}
    assert report.aborted == "each request is answered twice: two nodes have ID 5?"
    assert report.exit_status == 4
    assert (settings(first), settings(second)) == before


def test_hands_that_are_slower_than_an_inhibit_time_accuse_nobody() -> None:
    r1 = R1()
    fast = Stimulus(r1, SlaveActions(r1.slave))

    def slow(verb: str, *words: str) -> str:
        r1.rig.run_for(120_000)
        return fast(verb, *words)

    report = r1.judge(
        ConformancePlan(Level.INTRUSIVE, ("EM-08", "PR-03"), stimulus=slow, confirm=yes)
    )
    assert {r.check.id: r.outcome.reason for r in report.results} == {
        "EM-08": "emergency 3100 01 took 120 ms, which is more than 30 ms",
        "PR-03": "input 6000:01 02 took 120 ms, which is more than 20 ms",
    }
    assert report.count(CheckVerdict.INCONCLUSIVE) == 2


def test_a_tpdo_that_comes_late_after_its_sync_is_no_failure() -> None:
    r1, wire = R1(), CanWire()
    rig = Rig(Station(late(r1, 15_000), wire.end()))
    link = CanHost(rig, wire.end())
    rig.run_for(100_000)
    plan = ConformancePlan(Level.INTRUSIVE, ("PR-04", "PR-05", "PR-06"), confirm=yes)
    report = r1.judge(plan, link=link)
    assert failing(report) == []
    assert report.count(CheckVerdict.PASS) == 3


def test_a_node_that_answers_by_chance() -> None:
    chance = random.Random(16)

    def lie(now_us: int, rx: Frames) -> Frames:
        return tuple(data_frame(0x585, chance.randbytes(8)) for f in rx if f.can_id == 0x605)

    judge(Liar(lie))


def test_a_node_that_floods_the_bus() -> None:
    chance = random.Random(16)

    def lie(now_us: int, rx: Frames) -> Frames:
        can_ids = (0x585, 0x705, 0x185, 0x085)
        return tuple(data_frame(can_id, chance.randbytes(8)) for can_id in can_ids)

    judge(Liar(lie, busy=True), "NMT", "UE", longest_s=10)


@pytest.mark.parametrize("segments", [b"\x00" + bytes(7), b"\x10" + bytes(7)])
def test_a_node_whose_transfers_never_end(segments: bytes) -> None:
    def lie(now_us: int, rx: Frames) -> Frames:
        return tuple(_answer(frame) for frame in rx if frame.can_id == 0x605)

    def _answer(frame: CanFrame) -> CanFrame:
        if frame.data[:1] == b"\x40":
            return data_frame(0x585, b"\x41" + frame.data[1:4] + bytes(4))
        toggle = frame.data[0] & 0x10 if frame.data else 0
        return data_frame(0x585, bytes([segments[0] ^ toggle]) + segments[1:])

    judge(Liar(lie), longest_s=60)


@pytest.mark.parametrize("late_us", [200_000, 1_500_000])
def test_a_node_that_answers_late(late_us: int) -> None:
    judge(late(R1(), late_us), "NMT", "UE", "US", longest_s=60)


def test_a_silent_object_blocks_no_check_of_others() -> None:
    r1, multiplexer = R1(), bytes.fromhex("191000")
    r1.slave.tick(0, ())

    def lie(now_us: int, rx: Frames) -> Frames:
        heard = tuple(frame for frame in rx if frame.data[1:4] != multiplexer)
        return r1.slave.tick(now_us, heard)

    device = read_sound(EDS)[0]
    report = judge(Liar(lie, busy=True), "NMT", "DE-0*", "SY", "HB-01", "OD-1019*", device=device)
    assert report.count(CheckVerdict.BLOCKED) == 0
    assert report.count(CheckVerdict.PASS) > 20
    assert report.findings == ("1019h:00 Synchronous counter overflow value was not answered",)


@pytest.mark.parametrize("part", range(4))
def test_a_conversation_with_a_node_of_chance_ends_and_leaves_nothing_behind(part: int) -> None:
    ended = Counter(judge_conversation(Random(f"conform {part} {n}")) for n in range(500))
    assert ended["restored"] > 400
    assert ended["unrestored"] > 5


def test_a_cob_id_of_eight_bytes_is_written_back_as_it_was() -> None:
    chance = Random(1)
    table = ObjectTable()
    table.variable(0x1000, "Device type", DataType.UNSIGNED32, RO)
    table.variable(0x1005, "COB-ID SYNC", DataType.UNSIGNED32, RW)
    device = EdsDevice(DeviceInfo(), tuple(table), table.objects)
    node = FuzzNode(chance, device)
    node.wild = 0
    node.values[0x1005, 0] = node.before[0x1005, 0] = bytes.fromhex("8000004001020304")
    plan = ConformancePlan(Level.INTRUSIVE, ("SY-0*", "UE-01"), confirm=yes)
    report = ConformRun(node, 5, plan, device=device).run()
    assert report.unrestored == ()
    assert node.values == node.before


def test_what_could_not_be_restored_is_told_with_the_commands_that_would() -> None:
    r1, spoilt = R1(), list[int]()

    def refuse(receives: int) -> None:
        if not spoilt and r1.slave.dictionary[0x1017, 0].data == b"\x64\0":
            spoilt.append(receives)
            r1.powered.switch(on=False)

    report = r1.judge(
        ConformancePlan(Level.COMMUNICATION, ("HB-01",), confirm=yes), link=SpyLink(r1, refuse)
    )
    assert report.unrestored == ("1017h:00 was 0000; not verified: the node was lost",)
    assert report.repairs == ("1017h:00=u16:0x0",)
    text = text_report(replace(report, source="can0"))
    assert "canmon net can0 write 5 1017h:00=u16:0x0 --yes\n" in text


def test_a_node_that_resets_by_itself() -> None:
    r1 = R1()

    def lie(now_us: int, rx: Frames) -> Frames:
        if now_us % 700_000 == 0:
            r1.slave.reset()
        return r1.slave.tick(now_us, rx)

    report = judge(Liar(lie, busy=True))
    assert report.count(CheckVerdict.PASS) > 50


@pytest.mark.parametrize("stop_us", [15_000, 300_000])
def test_a_host_that_was_stopped_accuses_nobody(stop_us: int) -> None:
    def sleep(receives: int) -> None:
        if receives % 97 == 0:
            r1.rig.run_for(stop_us)

    r1 = R1()
    plan = ConformancePlan(Level.COMMUNICATION, ("[!O]*",), confirm=yes)
    report = r1.judge(plan, link=SpyLink(r1, sleep))
    assert failing(report) == []
    assert report.count(CheckVerdict.PASS) > 100


def test_a_full_bus_accuses_nobody() -> None:
    def fill(receives: int) -> None:
        if r1.rig.now_us > 1_000_000:
            others.send(tuple(data_frame(0x090 + n, b"\x55" * 8) for n in range(60)))

    r1 = R1()
    others = CanHost(r1.rig, r1.wire.end())
    plan = ConformancePlan(
        Level.COMMUNICATION, ("NMT", "HB", "UE", "PR"), confirm=yes, bit_rate=1_000_000
    )
    report = r1.judge(plan, link=SpyLink(r1, fill))
    assert failing(report) == []
    assert report.settings["other nodes"].startswith("16, 17, 18")


def test_a_pdo_of_the_node_on_another_can_id_is_no_other_node() -> None:
    r1 = R1()
    r1.slave.dictionary[0x1800, 1].value = 0x0000_01A2
    r1.slave.dictionary[0x1800, 2].value = 255
    r1.slave.dictionary[0x1800, 5].value = 10
    report = r1.judge(ConformancePlan(Level.COMMUNICATION, ("NMT",)))
    assert report.settings["other nodes"] == "none"


def test_a_node_that_comes_late_is_told_by_its_heartbeat() -> None:
    def beat(receives: int) -> None:
        if r1.rig.now_us > 5_000_000:
            other.send((data_frame(0x733, b"\x05"),))

    r1 = R1()
    other = CanHost(r1.rig, r1.wire.end())
    report = r1.judge(ConformancePlan(Level.COMMUNICATION, ("NMT",)), link=SpyLink(r1, beat))
    assert report.settings["other nodes"] == "51"


def test_another_server_of_the_node_is_no_other_node() -> None:
    report = R1().judge(ConformancePlan(Level.COMMUNICATION, ("SG",)))
    assert report.count(CheckVerdict.PASS) > 5
    assert report.settings["other nodes"] == "none"
