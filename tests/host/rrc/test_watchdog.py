from __future__ import annotations

import pytest

from tests.host.rigs import ScriptedLink, standby_bench
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc import RrcClient
from tickrig.wire.rrc.replies import RrcEvent


@pytest.mark.parametrize("stable", [False, True])
@pytest.mark.parametrize("time_us", [30_000, 100_000, 2_550_000])
def test_waiting_in_the_client_keeps_the_watchdog_alive(stable: bool, time_us: int) -> None:
    bench = standby_bench(stable=stable)
    bench.client.watchdog(time_us)
    bench.client.status()
    bench.client.run_for(10_000_000)
    assert bench.state() == "Standby"


def test_the_watchdog_is_renewed_with_its_own_command_and_value() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(300_000)
    bench.link.sent.clear()
    bench.client.run_for(1_000_000)
    assert set(bench.link.lines) == {b"watchdog1e7"}


def test_it_is_renewed_three_times_in_its_time() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(300_000)
    bench.client.run_for(50_000)
    bench.link.sent.clear()
    bench.client.run_for(3_000_000)
    assert len(bench.link.sent) == 30


def test_every_second_renewal_may_be_lost() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(300_000)
    numbers = iter(range(1_000))
    bench.link.spoil = lambda line: b"" if next(numbers) % 2 else line
    bench.client.run_for(10_000_000)
    assert bench.state() == "Standby"


def test_a_stream_of_commands_needs_no_renewal() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(100_000)
    bench.link.sent.clear()
    for _ in range(100):
        bench.client.output(30, 0)
        bench.client.run_for(20_000)
    assert set(bench.link.lines) == {b"output1e007"}
    assert bench.state() == "Output"


def test_a_refused_stream_is_no_renewal() -> None:
    bench = standby_bench(stable=True, max_refusals=1_000)
    bench.client.watchdog(100_000)
    bench.link.spoil = lambda line: line.replace(b"output1e007", b"output1e008")
    for _ in range(50):
        bench.client.output(30, 0)
        bench.client.run_for(20_000)
    assert bench.state() == "Standby"


def test_a_program_that_hangs_lets_it_trip() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(100_000)
    bench.rig.run_for(200_000)  # not in the client
    bench.client.wait_for(RrcEvent.BY_WATCHDOG, 0)
    assert bench.state() == "PowerOffByOthers"


def test_it_is_renewed_while_an_answer_is_awaited() -> None:
    link = ScriptedLink({b"watchdog0a": [b"OK:watchdog\n"]})
    client = RrcClient(link)
    client.watchdog(100_000)
    with pytest.raises(LinkTimeout):
        client.beep()
    assert link.sent.count(b"watchdog0a") >= 6


def test_it_is_renewed_while_events_are_awaited() -> None:
    bench = standby_bench()
    bench.client.watchdog(100_000)
    assert list(bench.client.events(1_000_000)) == []
    assert bench.state() == "Standby"


def test_renewals_cannot_be_mistaken_for_a_new_watchdog() -> None:
    link = ScriptedLink(
        {b"watchdog0a": [b"OK:watchdog\n"], b"watchdog14": [b"ER:CommandChecksum\n"]}
    )
    client = RrcClient(link)
    client.watchdog(100_000)
    client.run_for(35_000)  # the reply to a renewal is on its way
    with pytest.raises(Exception, match="watchdog14"):
        client.watchdog(200_000)
    assert client.watchdog_us == 100_000


def test_the_client_stops_renewing_when_the_watchdog_is_switched_off() -> None:
    bench = standby_bench()
    bench.client.watchdog(100_000)
    bench.client.watchdog(0)
    bench.link.sent.clear()
    bench.client.run_for(1_000_000)
    assert bench.link.sent == []


def test_the_client_stops_renewing_when_vr2_is_off() -> None:
    bench = standby_bench()
    bench.client.watchdog(100_000)
    bench.press_power()
    bench.client.wait_for(RrcEvent.INITIALIZED, 1_000_000)
    bench.link.sent.clear()
    bench.client.run_for(1_000_000)
    assert bench.link.sent == []
    assert bench.client.watchdog_us == 0
