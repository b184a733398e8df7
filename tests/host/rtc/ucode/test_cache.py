"""The cache by itself: who goes first, what is asked for."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tickrig.emulators.tkernel.resolution import ResolutionService, SimSource
from tickrig.emulators.tkernel.ucode_table import UcodeTable
from tickrig.host.rtc.ucode.cache import CacheLimits, LookupCache

SECOND_US = 1_000_000
BASE = "http://127.0.0.1:8640"
LIMITS = CacheLimits(2, 10 * SECOND_US, 60 * SECOND_US, 5 * SECOND_US, SECOND_US)
PLACES = {name: f'{{"x_m": {n}, "y_m": 0}}' for n, name in enumerate("abc")}


class CacheBench:
    """A cache of texts before a service that knows a, b and c."""

    def __init__(self) -> None:
        self.service = ResolutionService(UcodeTable(contents=PLACES), BASE)
        self.source, self.cache, self.now_us = SimSource(self.service), LookupCache(str), 0

    def look_up(self, name: str, limits: CacheLimits = LIMITS) -> str | None:
        address = f"{BASE}/contents/{name}"
        return self.cache.look_up(address, self.source, limits, self.now_us)

    def run(self, seconds: float) -> tuple[str, ...]:
        self.now_us += round(seconds * SECOND_US)
        return self.cache.update(self.source, LIMITS, self.now_us)


@pytest.fixture
def bench() -> CacheBench:
    return CacheBench()


def test_what_was_asked_for_is_there_later(bench: CacheBench) -> None:
    assert bench.look_up("a") is None
    assert bench.run(0.003) == ()
    assert bench.look_up("a") is None
    assert bench.run(0.001) == (f"{BASE}/contents/a",)
    assert bench.look_up("a") == PLACES["a"]
    assert (bench.cache.counts.hits, bench.cache.counts.misses) == (1, 2)
    assert bench.service.read("requests") == 1


def test_the_one_that_was_not_used_for_the_longest_time_goes_first(bench: CacheBench) -> None:
    for name in "abac":
        bench.look_up(name)
        bench.run(0.1)
    assert len(bench.cache) == 2
    assert bench.look_up("a") == PLACES["a"]
    assert bench.look_up("c") == PLACES["c"]
    assert bench.look_up("b") is None


def test_no_more_requests_wait_than_there_are_entries(bench: CacheBench) -> None:
    for name in "abcdefgh":
        bench.look_up(name)
    assert bench.service.read("requests") == 2
    assert len(bench.run(1)) == 0  # they have made room for others meanwhile
    assert bench.look_up("a") is None
    assert len(bench.run(1)) == 1


def test_an_old_one_serves_while_it_is_asked_for_again(bench: CacheBench) -> None:
    bench.look_up("a")
    bench.run(1)
    bench.run(11)
    bench.service.table = UcodeTable(contents={"a": '{"x_m": 9, "y_m": 0}'})
    assert bench.look_up("a") == PLACES["a"]
    assert (bench.cache.counts.stale, bench.cache.counts.age_us) == (1, 11 * SECOND_US)
    bench.run(1)
    assert bench.look_up("a") == '{"x_m": 9, "y_m": 0}'


def test_one_that_is_there_no_more_serves_no_more(bench: CacheBench) -> None:
    bench.look_up("a")
    bench.run(11)
    bench.service.inputs.set("unknown_ucode", 1)
    bench.run(11)
    bench.look_up("a")
    bench.run(1)
    assert bench.look_up("a") is None
    assert bench.cache.counts.unknown == 1


def test_after_a_failure_it_is_asked_for_again_a_second_later(bench: CacheBench) -> None:
    bench.service.inputs.set("unreachable", 1)
    bench.look_up("a")
    bench.run(0.5)
    assert bench.cache.trouble.endswith("connection refused")
    bench.service.inputs.set("unreachable", 0)
    bench.look_up("a")
    assert bench.run(0.4) == ()
    bench.run(0.7)
    bench.look_up("a")
    assert bench.run(0.4) == (f"{BASE}/contents/a",)
    assert bench.cache.trouble == ""


def test_a_slow_answer_comes_and_one_that_is_too_slow_fails(bench: CacheBench) -> None:
    bench.service.inputs.set("slow", 1)
    bench.service.inputs.set("delay_ms", 900)
    bench.look_up("a")
    assert bench.run(0.903) == ()
    assert len(bench.run(0.001)) == 1
    bench.service.inputs.set("delay_ms", 1_000)
    bench.look_up("b")
    assert bench.run(1) == ()
    assert bench.cache.trouble.endswith("timed out")


def test_a_source_that_was_closed_owes_nothing(bench: CacheBench) -> None:
    bench.look_up("a")
    bench.source.close()
    bench.cache.forget_requests()
    bench.run(1)
    bench.look_up("a")
    assert bench.run(1) == (f"{BASE}/contents/a",)


def test_a_smaller_cache_has_less(bench: CacheBench) -> None:
    for name in "ab":
        bench.look_up(name)
        bench.run(0.1)
    bench.look_up("b", replace(LIMITS, entries=1))
    assert len(bench.cache) == 1
