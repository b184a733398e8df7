"""Values shown from OutPorts and put into InPorts of a running system."""

from __future__ import annotations

import re

import pytest

from tests.host.rtc.chain import PERIOD_US, Chain
from tickrig.host.rtc import RtcRefused
from tickrig.host.rtc.commands.system_control import HELD, LEASE_US, Probes
from tickrig.host.rtc.system.system import describe
from tickrig.wire.rtc_types.rtc import Time, TimedLong


class Bench(Chain):
    """A chain and its probes."""

    def __init__(self) -> None:
        super().__init__()
        self.probes = Probes(self.manager)

    def run(self, periods: int) -> None:
        for _ in range(periods):
            self.manager.run_for(PERIOD_US)
            self.probes.tick(self.manager.now_us)

    def seen(self, since: int = 0) -> list[tuple[int, int]]:
        seen, _ = self.probes.watch("ConsoleIn0.out", since)
        return [(one.number, one.value.data) for one in seen if isinstance(one.value, TimedLong)]


def test_what_an_outport_writes_is_seen_from_the_first_look_on() -> None:
    bench = Bench()
    bench.source.enter(1, 2, 3)
    bench.run(1)
    assert bench.probes.watch("ConsoleIn0.out") == ((), 0)
    bench.run(2)
    assert bench.seen() == [(1, 2), (2, 3)]
    assert bench.seen(since=1) == [(2, 3)]
    assert bench.numbers == [1, 2, 3]


def test_of_many_values_the_latest_are_held() -> None:
    bench = Bench()
    bench.seen()
    bench.source.enter(*range(HELD + 5))
    bench.run(HELD + 5)
    assert [number for number, _ in bench.seen()] == list(range(6, HELD + 6))


def test_a_port_that_nobody_asks_for_is_watched_no_more() -> None:
    bench = Bench()
    bench.seen()
    bench.run(LEASE_US // PERIOD_US)
    assert len(bench.source.out.connectors) == 2
    bench.run(1)
    assert len(bench.source.out.connectors) == 1


def test_a_watched_component_can_end() -> None:
    bench = Bench()
    bench.seen()
    bench.manager.delete("ConsoleIn0")
    bench.run(1)
    with pytest.raises(RtcRefused, match="no component 'ConsoleIn0'; known: ConsoleOut0"):
        bench.seen()


def test_an_injected_value_arrives_and_leaves_no_connector() -> None:
    bench = Bench()
    bench.run(2)
    bench.probes.inject("ConsoleOut0.in", 7)
    bench.probes.inject("ConsoleOut0.in", 8)
    bench.run(1)
    assert bench.sink.received == [TimedLong(Time.from_us(2_000), n) for n in (7, 8)]
    assert len(bench.sink.in_.connectors) == 1


def test_an_injected_value_waits_for_a_component_to_be_active() -> None:
    bench = Bench()
    bench.run(1)
    bench.manager.deactivate("ConsoleOut0")
    bench.run(1)
    bench.probes.inject("ConsoleOut0.in", 7)
    bench.run(10)
    assert bench.numbers == []
    bench.manager.activate("ConsoleOut0")
    bench.run(1)
    assert bench.numbers == [7]


def test_probes_are_not_saved() -> None:
    bench = Bench()
    before = describe(bench.manager)
    bench.seen()
    bench.probes.inject("ConsoleOut0.in", 7)
    assert describe(bench.manager) == before


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("ConsoleIn0.out", "ConsoleIn0.out is a DataOutPort; values go into a DataInPort"),
        ("ConsoleOut0.x", "ConsoleOut0 has no port 'x'; known: in"),
        ("ConsoleOut0.in", "TimedLong.data takes a whole number (long), not null"),
    ],
)
def test_a_value_that_cannot_be_injected_is_refused(name: str, error: str) -> None:
    bench = Bench()
    with pytest.raises(RtcRefused, match=re.escape(error)):
        bench.probes.inject(name, None)
    assert len(bench.sink.in_.connectors) == 1


def test_values_of_an_inport_are_not_shown() -> None:
    with pytest.raises(RtcRefused, match="is a DataInPort; values are shown of a DataOutPort"):
        Bench().probes.watch("ConsoleOut0.in")


def test_a_connector_with_a_port_of_no_component_is_ended_by_its_names() -> None:
    bench = Bench()
    bench.run(1)
    assert bench.seen() == []
    (_, watching) = bench.manager.port("ConsoleIn0.out").connectors
    first, second = watching.profile.ports
    bench.manager.disconnect(second, first)
    assert len(bench.manager.port("ConsoleIn0.out").connectors) == 1
    with pytest.raises(RtcRefused, match="no component ''; known: ConsoleIn0"):
        bench.manager.disconnect(first, second)
