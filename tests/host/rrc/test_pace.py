"""The client leaves the RRC a tenth of its time, whatever its own clock does."""

from __future__ import annotations

import re

import pytest

from tests.host.rigs import standby_bench
from tests.host.spy_link import SpyLink
from tickrig.host.rrc import RrcClient, RrcLoad, RrcRefused
from tickrig.wire.rrc.message import PACE_WITHOUT_VR2, pace_lines_s


class FastClock(SpyLink):
    """A link whose clock is 1 % fast."""

    @property
    def now_us(self) -> int:
        return super().now_us * 101 // 100

    def receive(self, timeout_us: int, /) -> bytes:
        return super().receive(-(-timeout_us * 100 // 101))


@pytest.mark.parametrize("stable", [False, True])
@pytest.mark.parametrize("confirm", [False, True])
def test_a_host_whose_clock_is_fast_is_never_too_much(stable: bool, confirm: bool) -> None:
    bench = standby_bench()
    client = RrcClient(FastClock(bench.link))
    client.start()
    client.stablemode(on=stable)
    client.status(on=True)
    for number in range(2_000):
        client.output(number % 100, 0, confirm=confirm)
        assert int(bench.rrc.read("backlog_pct")) < 100
    assert bench.rrc.read("state") == "Output"


def test_a_stall_of_100_ms_is_not_made_up_for() -> None:
    bench = standby_bench(stable=True)
    bench.client.status(on=True)
    for _ in range(20):
        bench.rig.run_for(100_000)
        for _ in range(20):
            bench.client.output(10, 0, confirm=False)
            assert int(bench.rrc.read("backlog_pct")) < 50
    assert bench.rrc.read("state") == "Output"


def test_refusals_cost_and_are_paid_for() -> None:
    bench = standby_bench(stable=True, max_refusals=10_000)
    client = bench.client
    client.status(on=True)
    bench.link.spoil = lambda line: line[:-2] + b"?\n"
    for _ in range(1_000):
        client.output(10, 0, confirm=False)
        assert int(bench.rrc.read("backlog_pct")) < 100
    assert bench.rrc.read("state") == "Standby"


@pytest.mark.parametrize("stable", [False, True])
def test_the_client_tells_the_load_that_the_rrc_has(stable: bool) -> None:
    bench = standby_bench(stable=stable)
    client, pace = bench.client, 160 if stable else 100
    assert client.load == RrcLoad(load_pct=30, margin_pct=70, pace_lines_s=pace)
    client.status(on=True)
    client.run_for(1_500_000)
    assert client.load == RrcLoad(load_pct=50, margin_pct=50, pace_lines_s=pace)
    assert bench.rrc.read("load_pct") == 50
    assert bench.rrc.read("pace_lines_s") == pace
    until_us = client.now_us + 1_500_000
    while client.now_us < until_us:
        client.output(1, 0, confirm=False)
    assert client.load.load_pct == pytest.approx(90, abs=1)
    assert client.load.margin_pct == 100 - client.load.load_pct
    assert bench.rrc.read("load_pct") == pytest.approx(90, abs=5)
    client.run_for(1_000_000)
    assert client.load.load_pct == 50


def test_a_client_at_its_pace_sends_so_many_lines() -> None:
    bench = standby_bench(stable=True)
    bench.client.output(1, 0)
    bench.link.sent.clear()
    until_us = bench.client.now_us + 1_000_000
    while bench.client.now_us < until_us:
        bench.client.output(1, 0)
    assert len(bench.link.sent) == pytest.approx(bench.client.load.pace_lines_s, abs=1)


def test_an_overflow_is_refused_with_the_pace_of_the_rrc() -> None:
    refused = str(RrcRefused("device", "ReceiveBufferOverflow"))
    paces = [pace_lines_s(stable=stable, status=True) for stable in (True, False)]
    assert [int(number) for number in re.findall(r"\b\d+", refused)] == [*paces, PACE_WITHOUT_VR2]


def test_a_client_waits_for_the_work_of_an_overflow() -> None:
    bench = standby_bench(stable=True)
    bench.link.send(b"x" * 257 + b"\n")
    while b"ReceiveBufferOverflow" not in bench.link.heard:
        bench.client.run_for(1_000)
    heard_us = bench.client.now_us
    bench.client.output(1, 0)
    sent_us, line = bench.link.sent[-1]
    assert line.startswith(b"output")
    assert sent_us - heard_us >= 36_500
