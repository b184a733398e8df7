"""A peer that is killed or hangs while data flows delays nobody, and is found again."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.host.rtc.engines.openrtm.name_server import free_port
from tests.host.rtc.engines.openrtm.ports.foreign import Peer, Served
from tickrig.host.control.clock import ServingClock
from tickrig.host.rtc.system.schedule import RealTime

WITNESS = """
import time
worst = 0.0
print(flush=True)
due = time.monotonic()
end = due + float({seconds})
while due < end:
    due += 0.005
    time.sleep(max(0.0, due - time.monotonic()))
    worst = max(worst, time.monotonic() - due)
print(worst)
"""
"""Tells by how much a process that does nothing is late on this machine."""


@pytest.fixture
def lasting(foreign_stubs: Path) -> Iterator[Peer]:
    """Return a foreign component whose references are the same after a restart."""
    peer = Peer(foreign_stubs, free_port())
    try:
        yield peer
    finally:
        peer.resume()
        peer.kill()


def join(system: Served, ours: str, ior: str, **values: str) -> Any:
    """Connect a port of ours with a peer's, and return our connector."""
    port = system.manager.port(ours)
    code, _ = system.connect(system.service(ours), system.reference(ior), **values)
    assert code == "RTC_OK"
    return port.connectors[-1]


def test_a_killed_peer_is_lost_in_a_line_and_found_again(
    system: Served, lasting: Peer, caplog: pytest.LogCaptureFixture
) -> None:
    connector = join(system, "ConsoleIn0.out", lasting.iors["in"])
    system.console_in.enter(1)
    system.until(lambda: len(lasting.ask("received")) == 1)
    with caplog.at_level(logging.WARNING):
        lasting.kill()
        system.console_in.enter(2)
        system.until(lambda: connector.state == "lost")
        lasting.start()
        system.until(lambda: connector.state == "connected")
    assert [received[2] for received in lasting.ask("received")] == [2]
    lost, found = (record.getMessage() for record in caplog.records)
    assert lost.startswith("ConsoleIn0.out to Peer0.in: the peer does not answer: NoAnswerError: ")
    assert lost.endswith(("not reachable", "the connection broke"))
    assert "the peer answers again" in found


def test_a_peer_that_hangs_is_lost_and_found_again(system: Served, lasting: Peer) -> None:
    pushed = join(system, "ConsoleIn0.out", lasting.iors["in"])
    pulled = join(system, "ConsoleOut0.in", lasting.iors["out"], dataport__dataflow_type="pull")
    lasting.pause()
    system.console_in.enter(*range(100))
    system.until(lambda: (pushed.state, pulled.state) == ("lost", "lost"))
    system.until(lambda: pushed.buffer.dropped > 0)
    lasting.resume()
    system.until(lambda: (pushed.state, pulled.state) == ("connected", "connected"))
    system.until(lambda: lasting.ask("received")[-1][2] == 99)
    lasting.ask("wait", 7)
    system.until(lambda: system.numbers == [7])


def test_a_peer_that_has_the_object_no_more_is_lost(
    system: Served, lasting: Peer, caplog: pytest.LogCaptureFixture
) -> None:
    connector = join(system, "ConsoleIn0.out", lasting.iors["in"])
    lasting.ask("lie", "put", "gone")
    system.console_in.enter(1)
    system.until(lambda: connector.state == "lost")
    assert caplog.records[0].getMessage().endswith("NoAnswerError: it has ended")


@pytest.mark.realtime
def test_no_period_is_late_because_a_peer_dies_or_hangs(system: Served, lasting: Peer) -> None:
    connector = join(system, "ConsoleIn0.out", lasting.iors["in"])
    pulled = join(system, "ConsoleOut0.in", lasting.iors["out"], dataport__dataflow_type="pull")
    clock = ServingClock()
    clock.serve = system.calls.serve
    runner, start_us = RealTime(system.manager, clock), system.manager.now_us
    states: set[tuple[int, str]] = set()
    plan = [(500_000, lasting.pause), (2_500_000, lasting.resume), (3_000_000, lasting.kill)]
    plan += [(4_000_000, threading.Thread(target=lasting.start).start), (6_500_000, runner.stop)]

    def after_tick(now_us: int) -> None:
        system.console_in.enter(now_us)
        states.update((now_us // 500_000, one.state) for one in (connector, pulled))
        while plan and now_us - start_us >= plan[0][0]:
            plan.pop(0)[1]()

    runner.after_tick.append(after_tick)
    words = [sys.executable, "-c", WITNESS.format(seconds=6)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as witness:
        assert witness.stdout is not None
        witness.stdout.readline()
        runner.run()
        own_us = float(witness.stdout.readline()) * 1e6
    if own_us > 200_000:
        pytest.skip(f"this machine itself was {own_us / 1e6:.1f} s late")
    assert {state for _, state in states} == {"connected", "lost"}
    assert runner.worst_late_us < 500_000 + own_us  # one call into the peer would be 1 s
    assert connector.state == "connected"
