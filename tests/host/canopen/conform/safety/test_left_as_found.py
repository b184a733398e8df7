"""What a run leaves behind: nothing, whatever becomes of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import pytest

from tests.host.canopen.conform.r1 import EDS, R1, yes
from tickrig.device.canopen.dictionary import Entry
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report, Result
from tickrig.host.canopen.eds import read_sound
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.nmt import NmtState

SOME: Final = ("NMT", "HB", "DE", "DS", "PC-0*", "PC-1*", "PR-1*", "SY-0*", "OD-1[04]*")
"""Checks that change much of each kind."""

SETTINGS: Final = {
    (0x1017, 0): 500,
    (0x1014, 0): 0x6A5,
    (0x1015, 0): 25,
    (0x1016, 1): 0x0007_00C8,
    (0x1400, 1): 0x8000_0205,
    (0x1400, 2): 1,
    (0x1600, 0): 1,
    (0x1801, 2): 240,
    (0x1802, 1): 0x4000_0385,
    (0x1A02, 1): 0x2000_0008,
    (0x1A02, 0): 1,
    (0x2000, 0): 0x5A,
    (0x2001, 0): 0x1234,
    (0x2006, 0): 0x1F,
}
"""What somebody has configured before the run."""


class Meddler:
    """A link on which something happens at one of its calls.

    Args:
        link: the bus.
        at: the call, from 1 on.
        act: what happens then.
    """

    def __init__(self, link: CanHost, at: int, act: Callable[[], None]) -> None:
        self._link, self._left, self._act = link, at, act

    @property
    def now_us(self) -> int:
        return self._link.now_us

    def send(self, traffic: Frames, /) -> None:
        self._count()
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> Frames:
        return self._link.receive(timeout_us)

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        self._count()
        return self._link.receive_stamped(timeout_us)

    def close(self) -> None:
        self._link.close()

    def _count(self) -> None:
        self._left -= 1
        if not self._left:
            self._act()


class Ear:
    """A device that remembers all that it is told."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave, self.tick_us = slave, slave.tick_us
        self.heard: list[CanFrame] = []
        self.changes: list[Entry] = []
        for entry in slave.dictionary:
            entry.watch(self.changes.append)

    @property
    def due_us(self) -> int:
        return self._slave.due_us

    def reset(self) -> None:
        self._slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        self.heard += rx
        return self._slave.tick(now_us, rx)


def configured() -> R1:
    """Give R1 in Operational, with settings that are not its defaults."""
    r1 = R1(("1029", "1F80"))
    for at, number in SETTINGS.items():
        entry = r1.slave.dictionary[at]
        entry.assign(number.to_bytes(entry.size, "little"))
    r1.slave.enter(NmtState.OPERATIONAL)
    r1.rig.run_for(1_000_000)
    return r1


def told(r1: R1) -> dict[tuple[int, int], bytes]:
    """Return what all objects hold, but for errors that have been cleared."""
    return {at: data for at, data in r1.values().items() if at[0] != 0x1003 or not at[1]}


def judge(r1: R1, level: Level, *only: str) -> Report:
    return r1.judge(ConformancePlan(level, only, confirm=yes))


SAMPLE: Final = (5, 400, *range(700, 8_400, 590), 8_440)
"""Calls of the link at which something happens; a run makes 8472, the last ones to restore."""


@pytest.mark.parametrize("known", [True, False], ids=["EDS", "no EDS"])
def test_who_only_reads_is_heard_to_read(known: bool) -> None:
    slave = configured().slave
    ear, wire = Ear(slave), CanWire()
    rig = Rig(Station(ear, wire.end()))
    link = CanHost(rig, wire.end())
    rig.run_for(2_000_000)
    device = read_sound(EDS)[0] if known else None
    report = ConformRun(link, 5, ConformancePlan(Level.READ_ONLY), device=device).run()
    assert report.count(CheckVerdict.PASS) > 20
    requests = {frame.data[0] >> 5 for frame in ear.heard}
    assert {frame.can_id for frame in ear.heard} == {0x605}
    assert requests <= {2, 3, 4, 5}, "upload, its segments, abort, block upload"
    assert ear.changes == []


@pytest.mark.parametrize("level", [Level.COMMUNICATION, Level.INTRUSIVE])
def test_all_is_as_it_was(level: Level) -> None:
    r1 = configured()
    before = told(r1)
    report = judge(r1, level)
    assert report.unrestored == ()
    assert told(r1) == before
    assert r1.slave.state is NmtState.OPERATIONAL


def test_what_was_read_since_the_last_check_is_not_read_again() -> None:
    r1, asked = configured(), list[str]()
    r1.wire.observers.append(lambda at_us, frame: asked.append(str(frame)))
    assert judge(r1, Level.INTRUSIVE, "NMT-12").exit_status == 0
    for name, times in {"181001": 1, "032000": 2, "002000": 3}.items():
        assert asked.count(f"605#40{name}00000000") == times, name


def test_all_is_as_it_was_though_the_node_boots_behind_the_last_check() -> None:
    r1 = configured()
    before = told(r1)

    def boot(result: Result) -> None:
        r1.slave.reset()
        r1.rig.run_for(100_000)

    report = r1.judge(ConformancePlan(Level.INTRUSIVE, ("NMT-12",), confirm=yes), on_result=boot)
    assert report.unrestored == ()
    assert told(r1) == before


@pytest.mark.parametrize("call", SAMPLE)
def test_all_is_as_it_was_after_an_interruption(call: int) -> None:
    fired = []

    def interrupt() -> None:
        fired.append(call)
        raise KeyboardInterrupt

    r1 = configured()
    before = told(r1)
    r1.link = Meddler(r1.link, call, interrupt)  # type: ignore[assignment]
    report = judge(r1, Level.COMMUNICATION, *SOME)
    assert fired
    assert report.unrestored == ()
    assert told(r1) == before
    assert r1.slave.state is NmtState.OPERATIONAL


@pytest.mark.parametrize("call", [1_600, 2_400, 4_500, 7_200, 9_300])
def test_all_is_as_it_was_though_the_node_was_away(call: int) -> None:
    r1 = configured()
    before, link = told(r1), r1.link

    def cut_power() -> None:
        r1.power(on=False)
        r1.rig.event_queue.put("power", link.now_us + 2_000_000, lambda now_us: r1.power(on=True))

    r1.link = Meddler(link, call, cut_power)  # type: ignore[assignment]
    report = judge(r1, Level.INTRUSIVE, *SOME)
    assert not report.aborted
    assert report.unrestored == ()
    assert told(r1) == before
    assert r1.slave.state is NmtState.OPERATIONAL
