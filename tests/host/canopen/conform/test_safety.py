"""What the tester may do, and how it leaves the node: whatever happens."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import pytest

from tests.device.canopen.actions import SlaveActions
from tests.host.canopen.conform.r1 import R1, Stimulus, yes
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.node_care import KnownState
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report, Result
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import CanFrame, Frames, frame_bits
from tickrig.wire.canopen.nmt import NmtState

if TYPE_CHECKING:
    from tickrig.host.canopen.conform.bus.exchange import BusExchange
    from tickrig.host.canopen.conform.bus.sdo import SdoClient

HEARTBEAT = (0x1017, 0)


class SpyLink:
    """The link of R1, with what was sent, and something that happens at a receive."""

    def __init__(self, r1: R1, act: Callable[[int], object] = lambda number: None) -> None:
        self._inner, self._act = r1.link, act
        self.sent: list[CanFrame] = []
        self.receives = 0

    @property
    def now_us(self) -> int:
        return self._inner.now_us

    def send(self, traffic: Frames, /) -> None:
        self.sent += traffic
        self._inner.send(traffic)

    def receive(self, timeout_us: int, /) -> Frames:
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        self.receives += 1
        self._act(self.receives)
        return self._inner.receive_stamped(timeout_us)

    def close(self) -> None:
        self._inner.close()


def configured() -> R1:
    """Return R1 as a user left it: Operational, with a heartbeat and a mapping of their own."""
    r1 = R1()
    dictionary = r1.slave.dictionary
    for at, value in (
        (HEARTBEAT, 1_000),
        ((0x1400, 2), 1),
        ((0x1600, 0), 1),
        ((0x1800, 5), 250),
        ((0x1016, 1), 0x0003_07D0),
        ((0x2001, 0), 0xBEEF),
    ):
        dictionary[at].value = value
    r1.link.send((CanFrame.parse("000#0105"),))
    r1.rig.run_for(50_000)
    return r1


def failing(report: Report) -> list[str]:
    return [
        f"{r.check.id}: {r.outcome.reason}"
        for r in report.results
        if r.outcome.verdict is CheckVerdict.FAIL
    ]


def test_read_only_sends_nothing_but_uploads() -> None:
    r1 = configured()
    before, link = r1.values(), SpyLink(r1)
    report = r1.judge(ConformancePlan(), link=link)
    assert report.count(CheckVerdict.PASS) > 300
    assert {frame.can_id for frame in link.sent} == {0x605}
    assert {frame.data[0] & 0xE0 for frame in link.sent} == {0x40, 0x60, 0x80, 0xA0}
    assert r1.values() == before


@pytest.mark.parametrize("level", [Level.COMMUNICATION, Level.INTRUSIVE])
def test_a_run_leaves_the_node_as_it_was(level: Level) -> None:
    r1 = configured()
    before = r1.values()
    report = r1.judge(ConformancePlan(level, ("NMT", "HB", "PC", "PR", "SY", "DE"), confirm=yes))
    assert report.unrestored == ()
    assert r1.values() == before
    assert r1.slave.state is NmtState.OPERATIONAL


def test_what_a_run_stored_is_what_was_there_before() -> None:
    r1 = configured()
    before = r1.values()
    stimulus = Stimulus(r1, SlaveActions(r1.slave))
    groups = ("ST", "HB-05")
    report = r1.judge(ConformancePlan(Level.INTRUSIVE, groups, stimulus=stimulus, confirm=yes))
    assert failing(report) == []
    r1.power(on=False)
    r1.power(on=True)
    r1.rig.run_for(100_000)
    assert r1.values() == before


@pytest.mark.parametrize("number", [600, 1_100, 2_200, 3_700])
def test_ctrl_c_leaves_the_node_as_it_was(number: int) -> None:
    def act(receives: int) -> None:
        if receives == number:
            raise KeyboardInterrupt

    r1 = configured()
    before = r1.values()
    plan = ConformancePlan(Level.COMMUNICATION, ("NMT", "HB", "PC", "PR", "SY"), confirm=yes)
    report = r1.judge(plan, link=SpyLink(r1, act))
    assert report.aborted == "interrupted"
    assert report.unrestored == ()
    assert r1.values() == before
    assert r1.slave.state is NmtState.OPERATIONAL


def test_a_second_ctrl_c_leaves_the_node_and_tells_it() -> None:
    def act(receives: int) -> None:
        if receives in (1_160, 1_165):
            raise KeyboardInterrupt

    r1 = configured()
    report = r1.judge(ConformancePlan(Level.COMMUNICATION, ("PC",)), link=SpyLink(r1, act))
    assert report.aborted == "interrupted"
    assert "1017h:00 was E803; not verified: the node was lost" in report.unrestored


def test_an_error_of_whoever_is_told_leaves_the_node_as_it_was() -> None:
    def fail(result: Result) -> None:
        if result.check.id == "PC-03":
            raise RuntimeError("the disk is full")

    r1 = configured()
    before = r1.values()
    with pytest.raises(RuntimeError):
        r1.judge(ConformancePlan(Level.COMMUNICATION, ("PC",)), on_result=fail)
    assert r1.values() == before


def test_a_node_that_is_lost_blocks_the_rest_at_once() -> None:
    def pull_the_plug(result: Result) -> None:
        if result.check.id == "PC-05":
            r1.power(on=False)
            times.append(r1.rig.now_us)

    times: list[int] = []
    r1 = configured()
    report = r1.judge(ConformancePlan(Level.COMMUNICATION, ("PC",)), on_result=pull_the_plug)
    verdicts = {r.check.id: r.outcome.verdict for r in report.results}
    assert verdicts["PC-06"] is verdicts["PC-29"] is CheckVerdict.BLOCKED
    assert r1.rig.now_us - times[0] < 30_000_000
    assert failing(report) == []
    assert "1017h:00 was E803; not verified: the node was lost" in report.unrestored


def test_of_a_lost_node_only_what_was_written_is_told() -> None:
    def pull_the_plug(receives: int) -> None:
        if link.sent and str(link.sent[-1]).startswith("000#81"):
            r1.power(on=False)

    r1 = configured()
    link = SpyLink(r1, pull_the_plug)
    report = r1.judge(ConformancePlan(Level.INTRUSIVE, ("NMT",), confirm=yes), link=link)
    assert report.count(CheckVerdict.BLOCKED)
    assert "1017h:00 was E803; not verified: the node was lost" in report.unrestored
    untouched = ("1014h", "1029h", "2003h")
    assert not [line for line in report.unrestored if line.startswith(untouched)]


def test_after_a_second_reset_of_a_kind_only_what_the_first_changed_is_read() -> None:
    class Node:
        def __init__(self) -> None:
            self.values, self.read = {(0x2000 + n, 0): bytes([n]) for n in range(50)}, 0

        def upload(self, index: int, sub: int) -> bytes:
            self.read += 1
            return self.values[index, sub]

        def download(self, index: int, sub: int, data: bytes) -> None:
            self.values[index, sub] = data

    node = Node()
    begin = dict(node.values)
    state = KnownState(cast("BusExchange", SimpleNamespace(boots=0)), cast("SdoClient", node))
    state.learn(begin)
    reads = []
    for resets, changed in ((["000#82"], 7), (["000#82"], 7), ([], 9), (["000#82", "000#81"], 9)):
        node.values[0x2000 + changed, 0] = b"\xff"
        node.read = 0
        state.forget()
        state.tidy_after(resets)
        assert node.values == begin
        reads.append(node.read >= len(begin))
    assert reads == [True, False, True, True]


def test_a_text_that_was_lost_is_told_as_text() -> None:
    state = KnownState(cast("BusExchange", None), cast("SdoClient", None))
    values = {(0x1008, 0): b"reference", (0x2005, 0): b"a longer text", (0x1014, 0): b"abcd"}
    state.original.update(values)
    state._begin.update(dict.fromkeys(values, b""))
    state.written |= values.keys() | {(0x2001, 0)}
    state.give_up()
    assert [line.partition(";")[0] for line in state.unrestored] == [
        "1008h:00 was 'reference'",
        "2005h:00 was 'a longer text'",
        "1014h:00 was 61626364",
    ]


def test_a_node_that_comes_back_is_restored_then() -> None:
    def pull_the_plug(result: Result) -> None:
        if result.check.id == "PC-05":
            r1.power(on=False)
            back_us = r1.rig.now_us + 9_000_000
            r1.rig.event_queue.put("power", back_us, lambda now_us: r1.power(on=True))

    r1 = configured()
    before = r1.values()
    report = r1.judge(ConformancePlan(Level.COMMUNICATION, ("PC-0*",)), on_result=pull_the_plug)
    assert report.results[-1].outcome.verdict is CheckVerdict.BLOCKED
    assert report.unrestored == ()
    lost = [at for at, value in r1.values().items() if value != before[at]]
    assert lost == [(0x2001, 0)]  # of the manufacturer: this level does not write it


WRITING = ("DE", "DS", "NMT", "HB", "PC", "PR", "ST", "IO", "OD")
"""Groups that write objects; no blocks: any byte begins one."""


def written_on(link: SpyLink) -> set[int]:
    return {
        int.from_bytes(frame.data[1:3], "little")
        for frame in link.sent
        if frame.can_id == 0x605 and frame.data and frame.data[0] & 0xE0 == 0x20
    }


def test_what_must_be_refused_is_written_to_objects_of_the_manufacturer_too() -> None:
    r1 = R1()
    link = SpyLink(r1)
    report = r1.judge(ConformancePlan(Level.COMMUNICATION, ("DE", "OD-2*"), confirm=yes), link=link)
    assert 0x2001 in written_on(link)
    reasons = {r.check.id: r.outcome.reason for r in report.results}
    assert reasons["DE-11"].endswith("h would be written with a valid value: --intrusive")


def test_what_must_never_be_written_never_is() -> None:
    r1 = configured()
    never = frozenset({0x1017, 0x1400, 0x1A00, *range(0x2000, 0x2010)})
    link = SpyLink(r1)
    report = r1.judge(
        ConformancePlan(Level.INTRUSIVE, WRITING, confirm=yes, never=never), link=link
    )
    assert not written_on(link) & never
    assert written_on(link) > {0x1006, 0x1014, 0x1800}
    assert failing(report) == []
    assert report.unrestored == (
        "1017h:00 was E803",
        "1400h:02 was 01",
        "1600h:00 was 01",  # a mapping only changes while 1400h:01 disables the PDO
        "2001h:00 was EFBE",
    )


def test_objects_of_the_profile_are_not_written_unless_allowed() -> None:
    r1 = R1()
    link = SpyLink(r1)
    r1.judge(ConformancePlan(Level.INTRUSIVE, WRITING, confirm=yes), link=link)
    written = written_on(link)
    assert 0x1017 in written
    assert not [index for index in written if index >= 0x6000]


def test_what_concerns_other_nodes_is_asked_for() -> None:
    asked: list[str] = []

    def no(question: str) -> bool:
        asked.append(question)
        return False

    report = R1().judge(ConformancePlan(Level.INTRUSIVE, ("NMT-06", "LS-01", "ST-05"), confirm=no))
    assert [r.outcome.verdict for r in report.results] == [CheckVerdict.NOT_APPLICABLE] * 3
    assert asked == [
        "send NMT commands to all nodes of the bus",
        "send LSS requests, which every node of the bus takes",
    ]


def test_the_bus_is_not_loaded_more_than_allowed() -> None:
    r1 = R1()
    link = SpyLink(r1)
    plan = ConformancePlan(Level.INTRUSIVE, ("US", "BU", "BD", "OD"), confirm=yes, bit_rate=125_000)
    report = r1.judge(plan, link=link)
    sent_us = sum(frame_bits(frame) for frame in link.sent) * 8
    assert 0.05 < sent_us / report.duration_us < 0.3


@pytest.mark.parametrize("level", [Level.READ_ONLY, Level.COMMUNICATION])
def test_a_load_that_is_too_low_accuses_nobody_and_blocks_nothing(level: Level) -> None:
    plan = ConformancePlan(
        level, ("NMT", "HB", "UE", "US"), bit_rate=125_000, max_load=0.01, confirm=yes
    )
    report = R1().judge(plan)
    assert failing(report) == []
    assert report.count(CheckVerdict.BLOCKED) == 0
    assert report.count(CheckVerdict.PASS) > 3
    doubted = [r.outcome for r in report.results if r.outcome.verdict is CheckVerdict.INCONCLUSIVE]
    assert all("your --max-load is too low for this check" in one.reason for one in doubted)
    assert report.unrestored == ()


class DeafLink(SpyLink):
    """A link that loses what starts the node."""

    def send(self, traffic: Frames, /) -> None:
        super().send(tuple(frame for frame in traffic if str(frame)[:6] != "000#01"))


@pytest.mark.parametrize(
    ("max_load", "verdict"), [(0.3, CheckVerdict.FAIL), (0.01, CheckVerdict.INCONCLUSIVE)]
)
def test_a_failure_with_too_low_a_load_is_none(max_load: float, verdict: CheckVerdict) -> None:
    r1 = R1()
    plan = ConformancePlan(Level.COMMUNICATION, ("NMT-03",), bit_rate=125_000, max_load=max_load)
    outcome = r1.judge(plan, link=DeafLink(r1)).results[0].outcome
    assert outcome.verdict is verdict
    assert ("your --max-load is too low for this check" in outcome.reason) == (max_load < 0.1)
