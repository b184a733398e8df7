"""Seeds of a campaign, as people write them: `0-9999`, `3,17,100-199`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

LARGEST: Final = (1 << 63) - 1
_RANGE: Final = re.compile(r"([0-9]{1,19})(?:-([0-9]{1,19}))?")


@dataclass(frozen=True, slots=True)
class Seeds:
    """Seeds in ascending order, each once.

    Attributes:
        ranges: first and last seed of each, neither touching nor overlapping the next.

    >>> seeds = Seeds.parse("7,0-3,2-4")
    >>> str(seeds), len(seeds), seeds[5]
    ('0-4,7', 6, 7)
    """

    ranges: tuple[tuple[int, int], ...]

    @classmethod
    def parse(cls, text: str) -> Seeds:
        """Read seeds.

        Raises:
            ValueError: what is wrong with them.
        """
        return cls.of_ranges([_range(part.strip()) for part in text.split(",")])

    @classmethod
    def of_ranges(cls, ranges: list[tuple[int, int]]) -> Seeds:
        """Return those of ranges, which may overlap."""
        joined: list[tuple[int, int]] = []
        for first, last in sorted(ranges):
            if joined and first <= joined[-1][1] + 1:
                joined[-1] = joined[-1][0], max(last, joined[-1][1])
            else:
                joined.append((first, last))
        return cls(tuple(joined))

    def __len__(self) -> int:
        return sum(last - first + 1 for first, last in self.ranges)

    def __getitem__(self, index: int) -> int:
        for first, last in self.ranges:
            if index <= last - first:
                return first + index
            index -= last - first + 1
        raise IndexError(index)

    def __str__(self) -> str:
        return ",".join(
            str(first) if first == last else f"{first}-{last}" for first, last in self.ranges
        )


def _range(text: str) -> tuple[int, int]:
    match = _RANGE.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is no seed and no range: write 7, 0-9999 or 3,17,100-199")
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise ValueError(f"{text} runs backwards: write {last}-{first}")
    if last > LARGEST:
        raise ValueError(f"{text}: the largest seed is {LARGEST}")
    return first, last
