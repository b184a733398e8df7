"""Whatever a rig file is: a bench, or lines with the mistakes; tools/fuzz rig-files does more."""

from __future__ import annotations

from random import Random

import pytest

from tests.emulators.testing.rig_file.mutations import SEEDS, judge, mutated


@pytest.mark.parametrize("seed", range(20))
def test_a_mutated_rig_file_is_a_bench_or_told_to_be_wrong(seed: int) -> None:
    chance = Random(seed)
    for _ in range(20):
        judge(*mutated(chance))


def test_noise_is_no_rig_file() -> None:
    chance = Random(0)
    for size in (0, 1, 2, 10, 1_000, 100_000):
        assert judge("noise.toml", chance.randbytes(size)) == "mistakes"


@pytest.mark.parametrize("at", range(len(SEEDS)))
def test_what_is_mutated_is_right(at: int) -> None:
    assert judge("seed.toml", SEEDS[at].encode()) == "ok"
