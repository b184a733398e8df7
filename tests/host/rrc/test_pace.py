"""The client leaves the RRC a tenth of its time, whatever its own clock does."""

from __future__ import annotations

import pytest

from tests.host.rigs import standby_bench
from tickrig.host.links.link import Link
from tickrig.host.rrc import RrcClient


class FastClock:
    """A `Link[bytes]` whose clock is 1 % fast."""

    def __init__(self, link: Link[bytes]) -> None:
        self._link = link

    @property
    def now_us(self) -> int:
        return self._link.now_us * 101 // 100

    def send(self, traffic: bytes, /) -> None:
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        return self._link.receive(-(-timeout_us * 100 // 101))

    def close(self) -> None:
        self._link.close()


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
