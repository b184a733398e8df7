"""A heartbeat that runs while 1017h is 0."""

from __future__ import annotations

import pytest

from tickrig.device import make_epos
from tickrig.emulators.testing.conformance.conformance import conformance
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report
from tickrig.wire.can import CanFrame, Frames

NMT = ("NMT-03", "HB")
EACH_US = 400_000


class Beating:
    """A slave of ours whose program sends heartbeats by itself, until 1017h is written.

    Args:
        frames: of each period.
    """

    node_id, tick_us = 5, 1_000

    def __init__(self, *frames: str) -> None:
        self._slave = make_epos(5)
        self._frames = tuple(CanFrame.parse(text) for text in frames)
        self._next_us = EACH_US

    @property
    def due_us(self) -> int:
        return min(self._slave.due_us, self._next_us)

    def reset(self) -> None:
        self._slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        if any(frame.can_id == 0x605 and frame.data[:3] == b"\x2b\x17\x10" for frame in rx):
            self._frames = ()
        sent = self._slave.tick(now_us, rx)
        if now_us < self._next_us:
            return sent
        self._next_us += EACH_US
        return (*self._frames, *sent)


def judge(slave: Beating, level: str, only: tuple[str, ...] = NMT) -> Report:
    return conformance(slave, level=level, only=only)


def test_who_only_reads_tells_a_heartbeat_that_1017h_does_not() -> None:
    report = judge(Beating("705#7F"), "read-only", ("UE",))
    assert report.findings == ("heartbeat each 400 ms, but 1017h = 0",)
    assert report.unrestored == ()


def test_a_heartbeat_that_the_run_has_ended_is_not_restored() -> None:
    report = judge(Beating("705#7F"), "communication")
    assert report.count(CheckVerdict.FAIL) == 0
    assert report.findings == ("heartbeat each 400 ms, but 1017h = 0",)
    assert report.unrestored == ("heartbeat each 400 ms: gone, and 1017h = 0 as before",)


@pytest.mark.parametrize("frames", [(), ("705#00",), ("705#R1", "705#7F")], ids=str)
def test_boot_up_and_answers_to_guarding_are_no_heartbeat(frames: tuple[str, ...]) -> None:
    report = judge(Beating(*frames), "read-only", ("UE-01",))
    assert (report.findings, report.unrestored) == ((), ())


def test_a_heartbeat_that_1017h_tells_of_is_no_finding() -> None:
    slave = make_epos(5)
    slave.dictionary[0x1017, 0].value = 100
    for level in ("read-only", "communication"):
        report = conformance(slave, level=level, only=NMT[:1] if level != "read-only" else "UE-01")
        assert (report.findings, report.unrestored) == ((), ())
