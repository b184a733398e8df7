"""Whatever a file is: findings in lines, never a traceback; tools/fuzz-eds does more."""

from __future__ import annotations

from random import Random

import pytest

from tests.host.canopen.data_sheet.mutations import judge, mutated


@pytest.mark.parametrize("seed", range(10))
def test_a_mutated_eds_is_judged_read_and_mended(seed: int) -> None:
    chance = Random(seed)
    for _ in range(25):
        judge(*mutated(chance))


def test_noise_is_no_eds() -> None:
    chance = Random(0)
    for size in (0, 1, 2, 3, 10, 1_000, 20_000):
        assert judge("a.eds", chance.randbytes(size)) == "refused"
