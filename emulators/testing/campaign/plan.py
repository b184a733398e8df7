"""All runs of a campaign, by number."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.emulators.testing.campaign.order import CampaignOrder, CampaignRefusal, Collected, Run
from tickrig.host.text.values import list_item

# Seeds of a campaign, in the notation of users: `0-9999`, `3,17,100-199`.

LARGEST: Final = (1 << 63) - 1
_RANGE: Final = re.compile(r"([0-9]{1,19})(?:-([0-9]{1,19}))?")


@dataclass(frozen=True, slots=True)
class Seeds:
    """The seeds of a campaign, in ascending order without duplicates.

    Attributes:
        ranges: first and last seed of each range. The ranges do not touch or overlap.

    >>> seeds = Seeds.parse("7,0-3,2-4")
    >>> str(seeds), len(seeds), seeds[5]
    ('0-4,7', 6, 7)
    """

    ranges: tuple[tuple[int, int], ...]

    @classmethod
    def parse(cls, text: str) -> Seeds:
        """Return the seeds that a text lists, such as `7` or `3,17,100-199`.

        Raises:
            ValueError: the text is not a valid list of seeds.
        """
        return cls.of_ranges([_range(part.strip()) for part in text.split(",")])

    @classmethod
    def of_ranges(cls, ranges: list[tuple[int, int]]) -> Seeds:
        """Return the seeds of ranges, which may overlap."""
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


_MOST: Final = 10_000_000
"""Largest number of runs of a campaign: their numbers fit into memory."""

_KEPT: Final = "kept"
"""The folder of traces in the commands that replay."""


class Shard(NamedTuple):
    """A part of a campaign that runs separately, such as on another machine.

    `3/8` is the third of eight parts.

    >>> str(Shard.parse("3/8"))
    '3/8'
    """

    part: int = 1
    parts: int = 1

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Read a shard; raise ValueError if it is invalid."""
        part, slash, parts = text.partition("/")
        digits = slash and part.isdecimal() and parts.isdecimal() and len(text) <= 15
        if not digits or not 1 <= int(part) <= int(parts):
            raise ValueError(f"{text!r} is no part of a campaign: write 3/8 for the third of eight")
        return cls(int(part), int(parts))

    def __str__(self) -> str:
        return f"{self.part}/{self.parts}"


_WHOLE: Final = Shard()


@dataclass(frozen=True, slots=True)
class CampaignPlan:
    """The runs of a campaign: all tests with the first seed, then all with the second, and so on.

    Attributes:
        order: options by which workers collect and run the tests.
        collected: collected tests.
        seeds: seeds of the runs.
        shard: part of the runs that this campaign executes.
    """

    order: CampaignOrder
    collected: Collected
    seeds: Seeds
    shard: Shard = _WHOLE

    def __post_init__(self) -> None:
        if (runs := len(self.seeds) * len(self.collected.tests)) > _MOST:
            raise CampaignRefusal(
                f"--seeds {self.seeds}: that makes {runs} runs; {_MOST} are the most"
            )

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the command line."""
        return tuple(text.partition("=")[0].strip() for text in self.order.parameters)

    def numbers(self) -> Iterator[int]:
        """Yield the numbers of the runs that this part of the campaign does, in ascending order.

        The runs are spread so that each part of the campaign runs each test.
        """
        tests, (part, parts) = len(self.collected.tests), self.shard
        for index in range(len(self.seeds)):
            first = (part - 1 - index) % parts
            yield from range(index * tests + first, (index + 1) * tests, parts)

    def size(self) -> int:
        """Return how many runs this shard has."""
        return sum(1 for _ in self.numbers())

    def run(self, number: int) -> Run:
        """Return a run by its number."""
        index, test = divmod(number, len(self.collected.tests))
        return Run(number, self.collected.tests[test].nodeid, self.seeds[index])

    def values(self, number: int) -> tuple[str, ...]:
        """Return the values of all parameters for a run of the campaign, in order of the columns.

        A value is empty if the test of the run does not have the parameter.

        Args:
            number: number of the run.
        """
        test = self.collected.tests[number % len(self.collected.tests)]
        return tuple(test.values.get(name, "") for name in self.parameters)

    def command(self, number: int) -> str:
        """Return the command that replays a run, with a trace, for a shell."""
        test = self.collected.tests[number % len(self.collected.tests)]
        words = ["pytest", test.place, "--bench-mode", "virtual"]
        if self.order.bench:
            words += ["--bench", self.order.bench]
        words += ["--bench-seed", str(self.run(number).seed)]
        for name, value in test.values.items():
            words += ["--bench-param", f"{name}={list_item(value)}"]
        return shlex.join([*words, "--bench-artifacts", _KEPT])

    @property
    def head(self) -> dict[str, str | list[str]]:
        """Properties, by name, that must be equal to continue a campaign."""
        return {
            "tests": [test.nodeid for test in self.collected.tests],
            "seeds": str(self.seeds),
            "shard": str(self.shard),
            "rig file": self.order.bench,
            "tickrig": self.order.version,
            "files of the tests": self.collected.digest,
        }
