"""Whatever a file is: findings in lines, never a traceback; tools/fuzz-eds does more."""

from __future__ import annotations

import re
from random import Random

import pytest

from tests.host.canopen.data_sheet.mutations import SMALL, judge, mutated


@pytest.mark.parametrize("seed", range(10))
def test_a_mutated_eds_is_judged_read_and_mended(seed: int) -> None:
    chance = Random(seed)
    for _ in range(25):
        judge(*mutated(chance))


def test_noise_is_no_eds() -> None:
    chance = Random(0)
    for size in (0, 1, 2, 3, 10, 1_000, 20_000):
        assert judge("a.eds", chance.randbytes(size)) == "refused"


@pytest.mark.parametrize(
    "key", ["NrOfRXPDO", "SubNumber", "DefaultValue", "LowLimit", "1", "Lines"]
)
@pytest.mark.parametrize("digits", ["0x" + "F" * 5_000, "9" * 5_000, "0" + "7" * 5_000])
def test_a_number_of_5000_digits_is_told_in_a_line(key: str, digits: str) -> None:
    text = re.sub(rf"^{key}=.*$", f"{key}={digits}", SMALL, count=1, flags=re.MULTILINE)
    assert digits in text
    judge("a.eds", text.encode())
    judge("a.eds", SMALL.replace("\n1=0x1000", f"\n{digits}=0x1000").encode())
