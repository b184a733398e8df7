from __future__ import annotations

import pytest

from tickrig.emulators.testing.campaign.order import (
    CampaignOrder,
    CampaignRefusal,
    Collected,
    CollectedTest,
)
from tickrig.emulators.testing.campaign.plan import CampaignPlan, Seeds, Shard


def plan(tests: int, seeds: str, shard: str = "1/1") -> CampaignPlan:
    order = CampaignOrder(tests=("t.py",), parameters=("flip=0.1,0.2",), bench="rig one.toml")
    found = [
        CollectedTest(f"t.py::test_{n}", {"flip": f"0.{n}"}, f"../t.py::test_{n}")
        for n in range(tests)
    ]
    collected = Collected(tuple(found), (), "digest")
    return CampaignPlan(order, collected, Seeds.parse(seeds), Shard.parse(shard))


@pytest.mark.parametrize("parts", [1, 2, 3, 8, 50])
@pytest.mark.parametrize("tests", [1, 2, 3, 8])
def test_shards_have_each_run_once_and_all_tests(tests: int, parts: int) -> None:
    shards = [plan(tests, "5-24", f"{part}/{parts}") for part in range(1, parts + 1)]
    numbers = [number for shard in shards for number in shard.numbers()]
    assert sorted(numbers) == list(range(20 * tests))
    assert sum(shard.size() for shard in shards) == 20 * tests
    if parts <= 8:
        for shard in shards:
            assert len({shard.run(number).nodeid for number in shard.numbers()}) == tests


def test_a_run_is_a_test_with_a_seed() -> None:
    two = plan(2, "5,9")
    assert [two.run(number)[1:] for number in two.numbers()] == [
        ("t.py::test_0", 5),
        ("t.py::test_1", 5),
        ("t.py::test_0", 9),
        ("t.py::test_1", 9),
    ]
    assert two.values(3) == ("0.1",)
    assert two.command(3) == (
        "pytest ../t.py::test_1 --bench-mode virtual --bench 'rig one.toml' --bench-seed 9 "
        "--bench-param flip=0.1 --bench-artifacts kept"
    )


@pytest.mark.parametrize("text", ["", "3", "0/8", "9/8", "a/b", "1/2/3", "-1/8", "1/0"])
def test_what_is_no_shard_is_told(text: str) -> None:
    with pytest.raises(ValueError, match="no part of a campaign: write 3/8 for the third of eight"):
        Shard.parse(text)


def test_more_runs_than_fit_are_refused() -> None:
    with pytest.raises(CampaignRefusal, match="that makes 20000002 runs; 10000000 are the most"):
        plan(2, "0-10000000")
