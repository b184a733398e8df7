from __future__ import annotations

import pytest

from tickrig.emulators.testing.campaign.plan import LARGEST, Seeds


@pytest.mark.parametrize(
    ("text", "seeds"),
    [("7", [7]), ("0-3", [0, 1, 2, 3]), (" 9, 3-4 ,4-5", [3, 4, 5, 9]), ("1,2,3", [1, 2, 3])],
)
def test_seeds_are_ascending_and_each_is_there_once(text: str, seeds: list[int]) -> None:
    parsed = Seeds.parse(text)
    assert [parsed[index] for index in range(len(parsed))] == seeds
    assert Seeds.parse(str(parsed)) == parsed
    with pytest.raises(IndexError):
        parsed[len(seeds)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "'' is no seed and no range: write 7, 0-9999 or 3,17,100-199"),
        ("a-b", "'a-b' is no seed"),
        ("1-2-3", "'1-2-3' is no seed"),
        ("-5", "'-5' is no seed"),
        ("1,,2", "'' is no seed"),
        ("9-0", "9-0 runs backwards: write 0-9"),
        (f"0-{LARGEST + 1}", f"the largest seed is {LARGEST}"),
    ],
)
def test_nonsense_is_told(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Seeds.parse(text)
